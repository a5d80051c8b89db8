"""Transfer functions one sample at a time, in plain Python floats: the judge of the array forms.

Written from the definitions in the docstrings and papers, with no code of volref.
"""

import math


def texel(x, first, last, count):
    """Both neighbouring entries and the weight of the second, for texel centres clamped at the ends."""
    place = (x - first) / (last - first) * count - 0.5
    place = min(max(place, 0.0), count - 1.0)
    below = math.floor(place)
    return below, min(below + 1, count - 1), place - below


def bilinear_2d(rgba, value_domain, magnitude_domain, value, magnitude):
    """Straight red, green, blue and opacity of a table rgba[row][column][channel]."""
    left, right, across = texel(value, *value_domain, len(rgba[0]))
    low, high, up = texel(magnitude, *magnitude_domain, len(rgba))
    corners = [
        (rgba[low][left], (1 - across) * (1 - up)),
        (rgba[low][right], across * (1 - up)),
        (rgba[high][left], (1 - across) * up),
        (rgba[high][right], across * up),
    ]
    return [sum(float(entry[c]) * weight for entry, weight in corners) for c in range(4)]


def piecewise(positions, column, x):
    """Linear between positions, held beyond; at a jump the later entry from the position on."""
    later = [k for k, p in enumerate(positions) if p <= x]
    if not later:
        return column[0]
    k = later[-1]
    if k == len(positions) - 1:
        return column[k]
    share = (x - positions[k]) / (positions[k + 1] - positions[k])
    return column[k] + share * (column[k + 1] - column[k])


def natural_spline(at, points, x):
    """The natural cubic spline through (at, points), by the textbook's tridiagonal system (Thomas)."""
    n = len(at) - 1
    h = [at[i + 1] - at[i] for i in range(n)]
    upper, right = [0.0], [0.0]  # of the equations for the second derivatives, the first of which is 0
    for i in range(1, n):
        divided = (points[i + 1] - points[i]) / h[i] - (points[i] - points[i - 1]) / h[i - 1]
        pivot = 2 * (h[i - 1] + h[i]) - h[i - 1] * upper[-1]
        right.append((6 * divided - h[i - 1] * right[-1]) / pivot)
        upper.append(h[i] / pivot)
    second = [0.0] * (n + 1)
    for i in range(n - 1, 0, -1):
        second[i] = right[i] - upper[i] * second[i + 1]
    i = max(k for k in range(n) if k == 0 or at[k] <= x)
    a, b = (at[i + 1] - x) / h[i], (x - at[i]) / h[i]
    bend = (a**3 - a) * second[i] + (b**3 - b) * second[i + 1]
    return a * points[i] + b * points[i + 1] + bend * h[i] ** 2 / 6


def catmull_rom(at, points, x):
    """The cubic through two control points with the slopes of the chords of their neighbours."""
    n = len(at) - 1

    def slope(k):
        low, high = max(k - 1, 0), min(k + 1, n)
        return (points[high] - points[low]) / (at[high] - at[low])

    i = max(k for k in range(n) if k == 0 or at[k] <= x)
    h = at[i + 1] - at[i]
    u = (x - at[i]) / h
    return (
        (2 * u**3 - 3 * u**2 + 1) * points[i]
        + (u**3 - 2 * u**2 + u) * h * slope(i)
        + (-2 * u**3 + 3 * u**2) * points[i + 1]
        + (u**3 - u**2) * h * slope(i + 1)
    )


def vpt_canvas(bumps, size, *, rounded, blend):
    """VPT's bumps, pixel by pixel: the fragment shader, then the blending of a canvas of 8 bits or floats."""
    canvas = [[[0.0] * 4 for _ in range(size)] for _ in range(size)]
    for bump in bumps:
        position, extent, color = bump["position"], bump["size"], bump["color"]
        for row in range(size):
            for column in range(size):
                x = (position["x"] - (column + 0.5) / size) / extent["x"]
                y = (position["y"] - (row + 0.5) / size) / extent["y"]
                source = [min(max(color[c] * math.exp(-(x * x + y * y)), 0), 1) for c in "rgba"]
                own = source[3] if blend == "source-alpha" else 1.0
                for c in range(4):
                    mixed = source[c] * own + canvas[row][column][c] * (1 - source[3])
                    mixed = min(max(mixed, 0), 1)
                    canvas[row][column][c] = round(mixed * 255) / 255 if rounded else mixed
    return canvas
