"""Images inside volref, and their 8-bit encodings at the border.

Inside: float64 (height, width, 4), row 0 at the top, premultiplied alpha, in the working space (linear
unless a pipeline says otherwise).  PNG wants straight alpha and code values.
"""

import numpy as np

from volref.arrays import Bytes, Floats, one_of

ENCODINGS = ("srgb", "gamma2.2", "none")

# The exponent of "gamma2.2": what shaders that say pow(c, 1 / 2.2) do (VPT among them).
GAMMA = 2.2


def straight_from_premultiplied(rgba: Floats) -> Floats:
    """Divide colour by alpha (..., 4); where alpha is 0 the colour becomes 0.

    Examples
    --------
    >>> straight_from_premultiplied(np.array([[0.25, 0.0, 0.5, 0.5], [0.0, 0.0, 0.0, 0.0]])).tolist()
    [[0.5, 0.0, 1.0, 0.5], [0.0, 0.0, 0.0, 0.0]]
    """
    alpha = rgba[..., 3:]
    result = np.zeros_like(rgba)
    np.divide(rgba[..., :3], alpha, out=result[..., :3], where=alpha > 0)
    result[..., 3] = rgba[..., 3]
    return result


def premultiplied_from_straight(rgba: Floats) -> Floats:
    """Multiply colour by alpha (..., 4)."""
    return np.concatenate([rgba[..., :3] * rgba[..., 3:], rgba[..., 3:]], axis=-1)


def encode_srgb(linear: Floats) -> Floats:
    """Return sRGB code values in 0..1 of linear light (IEC 61966-2-1), negative light as 0.

    Examples
    --------
    >>> encode_srgb(np.array([0.0, 0.0031308, 1.0])).round(6).tolist()
    [0.0, 0.04045, 1.0]
    """
    light = np.maximum(linear, 0.0)
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


def decode_srgb(code: Floats) -> Floats:
    """Return linear light of sRGB code values in 0..1; the inverse of `encode_srgb`."""
    value = np.maximum(code, 0.0)
    return np.where(value <= 12.92 * 0.0031308, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def encode_light(light: Floats, encoding: str) -> Floats:
    """Return code values in 0..1 of light: "srgb", "gamma2.2" (light^(1/2.2)), or "none" as it is.

    Examples
    --------
    >>> encode_light(np.array([0.0, 0.5, 1.0]), "gamma2.2").round(6).tolist()
    [0.0, 0.72974, 1.0]
    """
    if one_of("encoding", encoding, ENCODINGS) == "none":
        return light
    return encode_srgb(light) if encoding == "srgb" else np.maximum(light, 0.0) ** (1 / GAMMA)


def decode_light(code: Floats, encoding: str) -> Floats:
    """Return the light of code values; the inverse of `encode_light`."""
    if one_of("encoding", encoding, ENCODINGS) == "none":
        return code
    return decode_srgb(code) if encoding == "srgb" else np.maximum(code, 0.0) ** GAMMA


def bytes_from_unit(unit: Floats) -> Bytes:
    """Quantise 0..1 to 0..255: clip, then round to the nearest, ties to even.

    Clipping comes first: 1.004 would wrap to 0, and truncation would turn 254.9 into 254.

    Examples
    --------
    >>> bytes_from_unit(np.array([-1.0, 0.5, 0.999, 1.004])).tolist()
    [0, 128, 255, 255]
    """
    return np.rint(np.clip(unit, 0.0, 1.0) * 255.0).astype(np.uint8)


def bytes24_from_unit(unit: Floats) -> Bytes:
    """Quantise 0..1 to 0..2^24 - 1 and return the three bytes (..., 3) of each, the highest first.

    A whole number is split, not a fraction: 1 stays 1, where fract(v (1, 256, 65536)) packs it as 0.

    Examples
    --------
    >>> bytes24_from_unit(np.array([0.0, 0.5, 1.0])).tolist()
    [[0, 0, 0], [128, 0, 0], [255, 255, 255]]
    """
    code = np.rint(np.clip(unit, 0.0, 1.0) * (2**24 - 1)).astype(np.uint32)
    return np.stack([code >> 16, code >> 8 & 255, code & 255], axis=-1).astype(np.uint8)


def unit_from_bytes24(codes: Bytes) -> Floats:
    """Return 0..1 of three bytes (..., 3), the highest first; undoes `bytes24_from_unit` to 3e-8.

    Examples
    --------
    >>> unit_from_bytes24(np.array([[255, 255, 255]], np.uint8)).tolist()
    [1.0]
    """
    high, middle, low = np.moveaxis(codes.astype(np.uint32), -1, 0)
    return np.asarray((high << 16 | middle << 8 | low) / (2**24 - 1))


def encode_rgba8(rgba: Floats, encoding: str = "srgb") -> Bytes:
    """Return straight 8-bit RGBA (..., 4) of a premultiplied working-space image.

    `encoding` is "srgb" or "gamma2.2" for a linear working space, or "none" to store the numbers as they
    are.  Alpha is never encoded.
    """
    straight = straight_from_premultiplied(rgba)
    straight[..., :3] = encode_light(straight[..., :3], encoding)
    return bytes_from_unit(straight)


def decode_rgba8(codes: Bytes, encoding: str = "srgb") -> Floats:
    """Return the premultiplied working-space image of straight 8-bit RGBA; undoes `encode_rgba8`."""
    straight = codes / 255.0
    straight[..., :3] = decode_light(straight[..., :3], encoding)
    return premultiplied_from_straight(straight)
