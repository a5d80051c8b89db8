"""atan(y, x) and acos(x) of shaders: GL leaves their error open, and implementations take short polynomials.

n numbers, in the control type of the device.  Where samples lie on the cones of a radar an error of 1.6e-4 in
the elevation is a tenth of the way between sweeps 0.1 degrees apart: it is modelled.

    rounded       as NumPy rounds them
    swiftshader   acos: Abramowitz and Stegun 4.4.45, 6.7e-5 off; atan: 4.4.49, 3e-7
    mesa          acos: its cubic under a root, 1.6e-4 off; atan: a polynomial of degree 11, 3e-6
"""

import numpy as np

from volref.arrays import Floats
from volref.emulation.device import Device

# Coefficients as the sources of the two have them, from the constant on.
SWIFTSHADER_ARCSINE = (1.5707288, -0.2121144, 0.0742610, -0.0187293)
SWIFTSHADER_ARCTANGENT = (
    -0.3333314528,
    0.1999355085,
    -0.1420889944,
    0.1065626393,
    -0.0752896400,
    0.0429096138,
    -0.0161657367,
    0.0028662257,
)
MESA_ARCSINE = (np.pi / 2, np.pi / 4 - 1, 0.08132463, -0.02363318)
MESA_ARCTANGENT = (
    0.9999793128310355,
    -0.3326756418091246,
    0.1938924977115610,
    -0.1173503194786851,
    0.0536813784310406,
    -0.0121323213173444,
)


def arccosine(device: Device, x: Floats) -> Floats:
    """Return acos(x) (n,) as a device computes it; NaN beyond -1..1.

    Examples
    --------
    >>> half = np.array([0.5], np.float32)
    >>> [round(abs(arccosine(Device.named(name), half).item() - np.pi / 3), 6)
    ...  for name in ("ideal", "swiftshader", "llvmpipe")]
    [0.0, 4.6e-05, 6.3e-05]
    """
    if device.angles == "rounded":
        return np.asarray(np.arccos(x))
    kind = x.dtype.type
    right, size = kind(np.pi / 2), np.abs(x)
    cubic = SWIFTSHADER_ARCSINE if device.angles == "swiftshader" else MESA_ARCSINE
    arcsine = np.copysign(right - np.sqrt(kind(1) - size) * _polynomial(cubic, size), x)
    return np.asarray(right - arcsine)


def arctangent(device: Device, y: Floats, x: Floats) -> Floats:
    """Return atan(y, x) (n,), -pi to pi, as a device computes it.

    Examples
    --------
    >>> y, x = np.array([[1, -1], [-1, 2]], np.float32)
    >>> np.degrees(arctangent(Device.named("swiftshader"), y, x)).astype(np.float64).round(3).tolist()
    [135.0, -26.565]
    """
    if device.angles == "rounded":
        return np.asarray(np.arctan2(y, x))
    return _swiftshader_arctangent(y, x) if device.angles == "swiftshader" else _mesa_arctangent(y, x)


def _swiftshader_arctangent(y: Floats, x: Floats) -> Floats:
    """Turn the point into the first octant, by half turns, quarters and a mirror, and the angle back."""
    kind = x.dtype.type
    right = kind(np.pi / 2)
    lower = y < 0
    x, y = np.where(lower, -x, x), np.abs(y)
    left = x < 0
    x, y = np.where(left, y, x), np.where(left, -x, y)
    steep = ~(y < x)
    x, y = np.where(steep, y, x), np.where(steep, x, y)
    ratio = y / x
    square = ratio * ratio
    angle = ratio + ratio * (square * _polynomial(SWIFTSHADER_ARCTANGENT, square))
    turned = np.where(lower, kind(-np.pi), kind(0)) + np.where(left, right, kind(0))
    turned = turned + np.where(x == 0, kind(0), np.where(steep, right - angle, angle))
    return np.where(lower & left & steep, -angle, turned)


def _mesa_arctangent(y: Floats, x: Floats) -> Floats:
    """Take the arctangent of |y / x|, or of |x / y| for x <= 0, and put a right angle to it."""
    kind = x.dtype.type
    right = kind(np.pi / 2)
    flip = x <= 0
    above, below = np.where(flip, np.abs(x), y), np.where(flip, y, np.abs(x))
    reciprocal = kind(1) / below
    ratio = np.abs(above * reciprocal)
    part = np.minimum(ratio, kind(1)) / np.maximum(ratio, kind(1))
    angle = _polynomial(MESA_ARCTANGENT, part * part) * part
    angle = np.where(ratio > 1, right - angle, angle)
    angle = np.where(flip, right, kind(0)) + angle
    return np.where(np.minimum(y, reciprocal) < 0, -angle, angle)


def _polynomial(coefficients: tuple[float, ...], x: Floats) -> Floats:
    """Return the polynomial by Horner's rule in the type of x."""
    kind = x.dtype.type
    total = np.full_like(x, coefficients[-1])
    for coefficient in coefficients[-2::-1]:
        total = kind(coefficient) + x * total
    return total
