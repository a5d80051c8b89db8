"""The obvious formulas, as tutorials and shaders have them: what the study holds volref against.

Each is right in exact arithmetic or nearly so, and each goes wrong somewhere.  They are here to be wrong:
nothing else in volref uses them.
"""

from collections.abc import Sequence

import numpy as np

from volref.arrays import Floats, Numbers

F4 = np.float32


def riemann(opacity: float, segments: int) -> tuple[float, float]:
    """Return alpha and transmittance of equal segments with opacity = extinction x length.

    The first term of 1 - exp(-x), good for x << 1 (Max 1995, eq. 9, "may be approximated by").
    """
    alpha, transmittance = 0.0, 1.0
    for _ in range(segments):
        alpha += transmittance * opacity
        transmittance *= 1.0 - opacity
    return alpha, transmittance


def opacity(depth: Numbers) -> Floats:
    """Return 1 - exp(-depth) as it stands in the papers."""
    return np.asarray(1 - np.exp(-depth))


def corrected_opacity(alpha: Numbers, ratio: Numbers | float) -> Floats:
    """Return 1 - (1 - alpha)^ratio as it stands in the papers (Engel et al. 2006, eq. 9.2)."""
    return np.asarray(1 - np.power(1 - alpha, ratio))


def logarithmic_opacity(alpha: Numbers, ratio: Numbers | float) -> Floats:
    """Return 1 - exp(ratio log(1 - alpha)), the same with the power written out."""
    with np.errstate(all="ignore"):
        return np.asarray(1 - np.exp(ratio * np.log(1 - alpha)))


def front_to_back(opacities: Numbers, color: float) -> tuple[Numbers, Numbers]:
    """Return colour and transmittance of equally coloured segments, C += T a c and T *= 1 - a."""
    transmittance, total = opacities.dtype.type(1), opacities.dtype.type(0)
    for a in opacities:
        total += transmittance * a * opacities.dtype.type(color)
        transmittance *= 1 - a
    return total, transmittance


def slab(origin: Sequence[float], direction: Sequence[float], pick: str) -> tuple[float, float]:
    """Return t_near and t_far of a ray in the unit box with products by 1 / direction.

    `pick` says how the two products of an axis are sorted: "minimum" (NaN wins), "fmin" (NaN loses), or
    "sign" (swapped where the direction is below 0).
    """
    o, d = np.array(origin), np.array(direction)
    with np.errstate(all="ignore"):
        inverse = 1 / d
        first, second = (0 - o) * inverse, (1 - o) * inverse
    if pick == "sign":
        lower, upper = np.where(d < 0, second, first), np.where(d < 0, first, second)
        return float(lower.max()), float(upper.min())
    if pick == "fmin":
        return float(np.fmax.reduce(np.fmin(first, second))), float(np.fmin.reduce(np.fmax(first, second)))
    return float(np.minimum(first, second).max()), float(np.maximum(first, second).min())


def lerp(low: Numbers, high: Numbers, fraction: Numbers | float) -> Floats:
    """Return low + fraction (high - low) in the type of its arguments."""
    with np.errstate(all="ignore"):
        return np.asarray(low + np.asarray(fraction, low.dtype) * (high - low))


def weighted_corners(corners: Numbers, fractions: Floats) -> Floats:
    """Return the sum of eight corner values times products of f and 1 - f, at points (3, n), in float32."""
    total = np.zeros(fractions.shape[1], F4)
    f = fractions.astype(F4)
    for corner, value in enumerate(corners.astype(F4)):
        weight = np.ones(fractions.shape[1], F4)
        for axis in range(3):
            weight = weight * (f[axis] if corner >> axis & 1 else 1 - f[axis])
        total = total + weight * value
    return total.astype(np.float64)


def window_depth(distance: float, near: float, far: float) -> float:
    """Return the distance that is read back from a float32 depth buffer (0 to 1, near plane at 0)."""
    z, n, f = F4(distance), F4(near), F4(far)
    with np.errstate(all="ignore"):
        depth = f / (f - n) - f * n / ((f - n) * z)
        return float(n * f / (f - depth * (f - n)))


def quadratic_root(a: float, b: float, c: float) -> float:
    """Return (-b + sqrt(b^2 - 4 a c)) / (2 a), the school formula."""
    return float((-b + np.sqrt(b * b - 4 * a * c)) / (2 * a))


def pack_fract(unit: Floats) -> Floats:
    """Return numbers of 0..1 after packing into three bytes with fract, and back.

    The shader classic: fract(v (1, 256, 65536)), less what the next channel holds, stored as bytes.
    """
    scale = 256.0 ** np.arange(3)
    parts = np.modf(unit[:, None] * scale)[0]
    parts[:, :-1] -= parts[:, 1:] / 256
    stored = np.floor(parts * 256).clip(0, 255) / 256
    return np.asarray((stored / scale).sum(axis=1))


def distance_by_determinant(origin: Sequence[float], direction: Sequence[float], triangle: Floats) -> float:
    """Return the distance to a triangle by Moeller and Trumbore (1997), without its test for det = 0."""
    a, b, c = triangle
    p = np.cross(direction, c - a)
    with np.errstate(all="ignore"):
        inverse = 1 / np.dot(b - a, p)
        return float(np.dot(c - a, np.cross(np.asarray(origin) - a, b - a)) * inverse)
