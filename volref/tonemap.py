"""Tone mapping: light of any strength to what a screen can show.

Every operator acts on each colour channel by itself, on straight colour, and leaves alpha alone.  The
background is in the image already: where it is opaque, straight and premultiplied are one, and what is
mapped is what is seen.  Where it is not, the colour of the volume alone is mapped, and a page that shows the
image over its own background will not get what mapping the sum would have given: the curves bend.

Operators, of a channel c that exposure has multiplied:

    linear             c
    exponential        1 - exp(-c), a film's response; VPT's ExposureToneMapper
    reinhard           c / (1 + c)                                Reinhard et al. 2002, equation 3
    reinhard-extended  c (1 + c / white^2) / (1 + c)              equation 4: `white` becomes 1
    hable              f(c) / f(white), white = 11.2              Hable 2010, who has exposure 2
    artistic           ((s - low) / (high - low))^e, where s is mixed with the mean of the three channels by
                       `saturation` and e = -log2((mid - low) / (high - low)): VPT's ArtisticToneMapper

VPT's exponent bends against its name: a mid below the middle of low and high darkens (its version of 2019
had the reciprocal).  At mid in the middle, its default, it is 1.
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import LARGEST_LENGTH, LEAST_LENGTH, Floats, float_array, number, one_of, plain_array
from volref.errors import SceneError
from volref.image import premultiplied_from_straight, straight_from_premultiplied


def tone_map(
    rgba: ArrayLike, operator: str = "reinhard", *, exposure: float = 1.0, gamma: float = 1.0, **shape: float
) -> Floats:
    """Return a premultiplied linear image (..., 4) mapped by `operator`, its alpha unchanged.

    Parameters
    ----------
    operator
        "linear", "exponential", "reinhard", "reinhard-extended", "hable" or "artistic".
    exposure
        What the light is multiplied by first.
    gamma
        The result is raised to 1 / gamma.  At 1 it is still light, to be written as sRGB; at 2.2 it is code
        values, to be written with encoding "none".
    shape
        `white` of "reinhard-extended" (which needs it) and "hable" (default 11.2); `low` (0), `mid` (0.5),
        `high` (1) and `saturation` (1) of "artistic".

    Raises
    ------
    SceneError
        If the image or a number breaks a rule, or the operator has no such parameter.

    Examples
    --------
    >>> tone_map([[3.0, 1.0, 0.0, 1.0]], "reinhard").tolist()
    [[0.75, 0.5, 0.0, 1.0]]
    >>> tone_map([[1.5, 0.5, 0.0, 0.5]], "reinhard").tolist()  # the same colour, half transparent
    [[0.375, 0.25, 0.0, 0.5]]
    """
    one_of("operator", operator, tuple(OPERATORS))
    curve, usual = OPERATORS[operator]
    for name in shape:
        if name not in usual:
            message = f"tone_map must be given what {operator!r} has, got {name}; "
            raise SceneError(message + (f"use {', '.join(usual)}" if usual else "leave it out"))
    scale = number("exposure", exposure, low=0, high=LARGEST_LENGTH)
    power = 1 / number("gamma", gamma, above=0, high=1e3)
    image = np.atleast_1d(plain_array("image", rgba))
    pixels = float_array("image", image.reshape(-1, image.shape[-1]), ("pixels", 4), limit=LARGEST_LENGTH)
    straight = straight_from_premultiplied(pixels)
    light = np.clip(straight[:, :3] * scale, 0.0, LARGEST_LENGTH)
    straight[:, :3] = curve(light, dict(usual) | shape) ** power
    return premultiplied_from_straight(straight).reshape(image.shape)


Curve = Callable[[Floats, Mapping[str, float]], Floats]


def _linear(light: Floats, _: Mapping[str, float]) -> Floats:
    return light


def _exponential(light: Floats, _: Mapping[str, float]) -> Floats:
    return -np.expm1(-light)


def _reinhard(light: Floats, _: Mapping[str, float]) -> Floats:
    return light / (1 + light)


def _reinhard_extended(light: Floats, shape: Mapping[str, float]) -> Floats:
    white = _white(shape)
    return light / (1 + light) * (1 + light / white**2)


def _hable(light: Floats, shape: Mapping[str, float]) -> Floats:
    return hable_curve(light) / hable_curve(np.array(_white(shape)))


def hable_curve(x: Floats) -> Floats:
    """Return Hable's f(x) = (x (A x + C B) + D E) / (x (A x + B) + D F) - E / F.

    A shoulder strength 0.15, B linear strength 0.5, C linear angle 0.1, D toe strength 0.2, E / F toe angle
    0.02 / 0.3 (John Hable, Filmic Tonemapping Operators, 2010).  Written over one denominator, since the
    difference loses digits near black: x (A (F - E) x + B (C F - E)) / (F (x (A x + B) + D F)).

    Examples
    --------
    >>> hable_curve(np.array([0.0, 11.2])).round(6).tolist()
    [0.0, 0.725129]
    """
    return x * (0.042 * x + 0.005) / (0.3 * (x * (0.15 * x + 0.5) + 0.06))


def _artistic(light: Floats, shape: Mapping[str, float]) -> Floats:
    low, mid, high, saturation = (
        number(name, shape[name], low=-1e6, high=1e6) for name in ("low", "mid", "high", "saturation")
    )
    if not low < mid < high:
        message = f"low, mid and high must rise, got {low:g}, {mid:g} and {high:g}; sort them"
        raise SceneError(message)
    unit = (light - low) / (high - low)
    mean = unit.mean(axis=-1, keepdims=True)
    mixed = mean + (unit - mean) * saturation
    # GLSL leaves the power of a negative number undefined; black is what it means.
    return np.asarray(np.maximum(mixed, 0.0) ** -np.log2((mid - low) / (high - low)))


def _white(shape: Mapping[str, float]) -> float:
    if np.isnan(shape["white"]):
        message = "white must be given to 'reinhard-extended', got none; state the light that becomes 1"
        raise SceneError(message)
    return number("white", number("white", shape["white"], above=0), low=LEAST_LENGTH, high=LARGEST_LENGTH)


ARTISTIC = {"low": 0.0, "mid": 0.5, "high": 1.0, "saturation": 1.0}

# What each operator is, and its parameters with their defaults; NaN stands for one that must be given.
OPERATORS: Mapping[str, tuple[Curve, Mapping[str, float]]] = MappingProxyType(
    {
        "linear": (_linear, {}),
        "exponential": (_exponential, {}),
        "reinhard": (_reinhard, {}),
        "reinhard-extended": (_reinhard_extended, {"white": np.nan}),
        "hable": (_hable, {"white": 11.2}),
        "artistic": (_artistic, ARTISTIC),
    }
)
