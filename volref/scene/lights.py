"""Lights, and how a material answers them.

At a point with the straight colour c, the unit normal n, the unit direction v to the viewer, and for each
light the unit direction l to it and its colour L, weakened to a L at the point,

    ambient    = k_a sum of L                      over the ambient lights
    diffuse    = k_d sum of a L max(0, n . l)      over the others (Lambert 1760)
    specular   = k_s sum of a L max(0, r . v)^s    with r = 2 (n . l) n - l   (Phong 1975), or
                 k_s sum of a L max(0, n . h)^s    with h = (l + v) / |l + v| (Blinn 1977)

and the point shines with c (ambient + diffuse) + specular; there is no specular part where n . l <= 0, and
where there is no normal, as where the gradient is zero, only the ambient part.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import LARGEST_LENGTH, Floats, Vector, float_array, number, one_of, set_fields
from volref.errors import SceneError

LIGHT_KINDS = ("ambient", "directional", "point", "headlight")
MODELS = ("lambert", "phong", "blinn-phong", "unlit")
WHITE = (1.0, 1.0, 1.0)


@dataclass(frozen=True, eq=False, init=False)
class Light:
    """A light; build one with `ambient`, `directional`, `point` or `headlight`.

    Parameters
    ----------
    kind
        One of these four words.
    color
        Working-space colour, at least 0.
    direction
        Unit vector in which the light travels ("directional" only).
    position
        World position ("point" only).
    attenuation
        (c0, c1, c2): at the distance d a point light is weakened to 1 / (c0 + c1 d + c2 d^2).

    Examples
    --------
    >>> Light.directional((0, 0, -2)).direction.tolist()
    [0.0, 0.0, -1.0]
    """

    kind: str
    color: Vector
    direction: Floats | None
    position: Floats | None
    attenuation: Vector

    def __init__(
        self,
        kind: str,
        color: ArrayLike = WHITE,
        direction: ArrayLike | None = None,
        position: ArrayLike | None = None,
        attenuation: ArrayLike = (1.0, 0.0, 0.0),
    ) -> None:
        one_of("light.kind", kind, LIGHT_KINDS)
        _only_for("light.direction", direction, kind, "directional")
        _only_for("light.position", position, kind, "point")
        set_fields(
            self,
            kind=kind,
            color=_at_least_zero("light.color", color),
            direction=unit_vector("light.direction", direction) if kind == "directional" else None,
            position=float_array("light.position", position, (3,), limit=LARGEST_LENGTH)
            if kind == "point"
            else None,
            attenuation=_checked_attenuation(attenuation),
        )

    @classmethod
    def ambient(cls, color: ArrayLike = WHITE) -> Self:
        """Light from all sides."""
        return cls("ambient", color)

    @classmethod
    def directional(cls, direction: ArrayLike, color: ArrayLike = WHITE) -> Self:
        """Light from far away that travels in `direction`."""
        return cls("directional", color, direction=direction)

    @classmethod
    def point(
        cls, position: ArrayLike, color: ArrayLike = WHITE, attenuation: ArrayLike = (1.0, 0.0, 0.0)
    ) -> Self:
        """Light from a point, weakened by 1 / (c0 + c1 d + c2 d^2) at the distance d; by default not."""
        return cls("point", color, position=position, attenuation=attenuation)

    @classmethod
    def headlight(cls, color: ArrayLike = WHITE) -> Self:
        """Light that comes along each viewing ray."""
        return cls("headlight", color)


@dataclass(frozen=True, eq=False, init=False)
class Material:
    """How surfaces and volumes answer light, see the head of `volref.scene.lights`.

    Parameters
    ----------
    model
        "lambert" (no highlights), "phong", "blinn-phong", or "unlit": a volume emits its colours as they are,
        whatever lights there are for the meshes.
    ambient, diffuse, specular
        k_a, k_d and k_s, at least 0.
    shininess
        The exponent s, at least 0.
    two_sided
        Whether normals are turned towards the viewer first.
    """

    model: str
    ambient: float
    diffuse: float
    specular: float
    shininess: float
    two_sided: bool

    def __init__(
        self,
        model: str = "phong",
        *,
        ambient: float = 0.1,
        diffuse: float = 0.7,
        specular: float = 0.2,
        shininess: float = 10.0,
        two_sided: bool = False,
    ) -> None:
        set_fields(
            self,
            model=one_of("material.model", model, MODELS),
            ambient=number("material.ambient", ambient, low=0),
            diffuse=number("material.diffuse", diffuse, low=0),
            specular=number("material.specular", specular, low=0),
            shininess=number("material.shininess", shininess, low=0, high=1e6),
            two_sided=bool(two_sided),
        )


def unit_vector(name: str, value: ArrayLike | None) -> Floats:
    """Return a vector (3,) of length 1 in the direction of `value`.

    Raises
    ------
    SceneError
        If it has no direction.

    Examples
    --------
    >>> unit_vector("plane.normal", (0, 3, 4)).tolist()
    [0.0, 0.6, 0.8]
    """
    vector = float_array(name, value, (3,), limit=LARGEST_LENGTH)
    largest = np.abs(vector).max()
    if largest == 0:
        message = f"{name} must have a direction, got {vector.tolist()}; give a vector that is not zero"
        raise SceneError(message)
    # Scaled first: the squares of numbers below 1e-162 are zero.
    scaled = vector / largest
    unit: Floats = scaled / np.linalg.norm(scaled)
    unit.flags.writeable = False
    return unit


def _only_for(name: str, value: ArrayLike | None, kind: str, needed: str) -> None:
    if (value is None) == (kind != needed):
        return
    got = "none" if value is None else f"one for a {kind!r} light"
    message = f"{name} must be given for a {needed!r} light and for no other, got {got}; "
    raise SceneError(message + f"build it with Light.{kind}(...)")


def _at_least_zero(name: str, value: ArrayLike) -> Vector:
    array = float_array(name, value, (3,))
    if (array < 0).any():
        message = f"{name} must be at least 0, got {array.tolist()}; raise it to 0"
        raise SceneError(message)
    red, green, blue = array.tolist()
    return red, green, blue


def _checked_attenuation(value: ArrayLike) -> Vector:
    attenuation = _at_least_zero("light.attenuation", value)
    if attenuation[0] == 0:
        message = f"light.attenuation must have a first number above 0, got {list(attenuation)}; "
        raise SceneError(message + "give (1, 0, k) for 1 / (1 + k d^2)")
    return attenuation
