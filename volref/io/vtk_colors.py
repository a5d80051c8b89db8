"""The colour spaces in which VTK interpolates, with VTK's own constants (vtkMath, vtkColorTransferFunction).

n colours; every array is (3, n).  VTK's CIELAB has a white of (0.9505, 1, 1.089) and matrices of four
digits, so white comes back from Lab as (0.99998, 1, 0.99998); colour-science, which has all digits, gives
the same Lab to 0.01 and colours to 1.4e-3; tests hold both together.
"""

import numpy as np

from volref.arrays import Booleans, Floats

XYZ_OF_RGB = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
RGB_OF_XYZ = np.array([[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]])
WHITE = np.array([[0.9505], [1.0], [1.089]])

# Colours less saturated than this (radians) have a hue that says nothing.
LEAST_SATURATION = 0.05


def lab_of_rgb(rgb: Floats) -> Floats:
    """Return CIELAB (L, a, b) of sRGB codes in 0..1."""
    linear = np.where(rgb > 0.04045, ((rgb + 0.055) / 1.055) ** 2.4, rgb / 12.92)
    xyz = XYZ_OF_RGB @ linear / WHITE
    f = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16 / 116)
    return np.stack([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


def rgb_of_lab(lab: Floats) -> Floats:
    """Return sRGB codes of CIELAB: divided by the largest where that is above 1, and at least 0."""
    y = (lab[0] + 16) / 116
    f = np.stack([lab[1] / 500 + y, y, y - lab[2] / 200])
    xyz = np.where(f**3 > 0.008856, f**3, (f - 16 / 116) / 7.787) * WHITE
    linear = RGB_OF_XYZ @ xyz
    curved = 1.055 * np.maximum(linear, 0.0031308) ** (1 / 2.4) - 0.055
    rgb = np.where(linear > 0.0031308, curved, 12.92 * linear)
    return np.asarray(np.maximum(rgb / np.maximum(rgb.max(axis=0), 1.0), 0.0))


def hsv_of_rgb(rgb: Floats) -> Floats:
    """Return hue, saturation and value, each in 0..1; the hue of grey is 0."""
    red, green, blue = rgb
    value, spread = rgb.max(axis=0), np.ptp(rgb, axis=0)
    apart = np.where(spread > 0, spread, 1.0)
    hue = np.select(
        [spread == 0, red == value, green == value],
        [0.0, (green - blue) / apart / 6, 1 / 3 + (blue - red) / apart / 6],
        2 / 3 + (red - green) / apart / 6,
    )
    saturation = np.divide(spread, value, out=np.zeros_like(value), where=value > 0)
    return np.stack([np.where(hue < 0, hue + 1, hue), saturation, value])


def rgb_of_hsv(hsv: Floats) -> Floats:
    """Return red, green and blue of hue, saturation and value."""
    hue, saturation, value = hsv
    away = np.abs(6 * hue - np.array([[3.0], [2.0], [4.0]]))
    pure = np.clip(np.array([[-1.0], [2.0], [2.0]]) + np.array([[1.0], [-1.0], [-1.0]]) * away, 0.0, 1.0)
    return np.asarray((saturation * pure + 1 - saturation) * value)


def nearer_hues(first: Floats, second: Floats) -> tuple[Floats, Floats]:
    """Return two (3, n) colours in HSV, one hue lowered by 1 where that is the shorter way around."""
    first, second = first.copy(), second.copy()
    first[0], second[0] = (
        np.where(first[0] - second[0] > 0.5, first[0] - 1, first[0]),
        np.where(second[0] - first[0] > 0.5, second[0] - 1, second[0]),
    )
    return first, second


def diverging(first: Floats, second: Floats, share: Floats) -> Floats:
    """Return sRGB codes between two colours by way of Moreland's Msh, through white where hues are far apart.

    Msh are polar coordinates of CIELAB: the magnitude M, the saturation s (an angle from the L axis), and
    the hue h (K. Moreland, "Diverging Color Maps for Scientific Visualization", ISVC 2009).
    """
    one, other = _msh_of_lab(lab_of_rgb(first)), _msh_of_lab(lab_of_rgb(second))
    apart = _angle_between(one[2], other[2]) > 0.33 * np.pi
    distinct = (one[1] > LEAST_SATURATION) & (other[1] > LEAST_SATURATION) & apart
    white = np.zeros_like(one)
    white[0] = np.maximum(np.maximum(one[0], other[0]), 88.0)
    in_first = share < 0.5
    other = np.where(distinct & in_first, white, other)
    one = np.where(distinct & ~in_first, white, one)
    share = np.where(distinct, np.where(in_first, 2 * share, 2 * share - 1), share)
    grey, other_grey = one[1] < LEAST_SATURATION, other[1] < LEAST_SATURATION
    saturated, other_saturated = one[1] > LEAST_SATURATION, other[1] > LEAST_SATURATION
    one[2] = np.where(grey & other_saturated, _hue_for_grey(other, one[0]), one[2])
    other[2] = np.where(other_grey & saturated, _hue_for_grey(one, other[0]), other[2])
    between = (1 - share) * one + share * other
    turn = other[2] - one[2]
    # VTK 9.7 turns forward by the smaller angle where the difference is more than half a turn.
    turn = np.where(np.abs(turn) > np.pi, _angle_between(one[2], other[2]), turn)
    between[2] = one[2] + share * turn
    return rgb_of_lab(_lab_of_msh(between))


def _angle_between(one: Floats, other: Floats) -> Floats:
    around = np.abs(one - other) % (2 * np.pi)
    return np.asarray(np.where(around > np.pi, 2 * np.pi - around, around))


def _msh_of_lab(lab: Floats) -> Floats:
    magnitude = np.sqrt((lab**2).sum(axis=0))
    dark: Booleans = magnitude <= 0.001
    saturation = np.where(dark, 0.0, np.arccos(np.clip(lab[0] / np.where(dark, 1.0, magnitude), -1.0, 1.0)))
    hue = np.where(saturation > 0.001, np.arctan2(lab[2], lab[1]), 0.0)
    return np.stack([magnitude, saturation, hue])


def _lab_of_msh(msh: Floats) -> Floats:
    magnitude, saturation, hue = msh
    around = magnitude * np.sin(saturation)
    return np.stack([magnitude * np.cos(saturation), around * np.cos(hue), around * np.sin(hue)])


def _hue_for_grey(msh: Floats, magnitude: Floats) -> Floats:
    """Return the hue that a grey of this magnitude is given, so that the change looks even."""
    own, saturation, hue = msh
    spread = np.sqrt(np.maximum(magnitude**2 - own**2, 0.0))
    away = own * np.sin(saturation)
    spin = saturation * np.divide(spread, away, out=np.zeros_like(away), where=away != 0)
    turned = np.where(hue > -0.3 * np.pi, hue + spin, hue - spin)
    return np.asarray(np.where(own >= magnitude - 0.1, hue, turned))
