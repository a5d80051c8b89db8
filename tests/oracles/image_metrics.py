"""Measures of two images by the book: scalar loops, one formula per line, nothing shared with volref."""

import math


def ssim_by_loop(a, b):
    """Mean SSIM of two grey images (lists of rows), one 11 x 11 window and one pixel at a time."""
    square = [[math.exp(-(i * i + j * j) / (2 * 1.5**2)) for i in range(-5, 6)] for j in range(-5, 6)]
    total = sum(map(sum, square))
    weights = [(i, j, square[j][i] / total) for j in range(11) for i in range(11)]
    found = []
    for y in range(len(a) - 10):
        for x in range(len(a[0]) - 10):
            mean_a = sum(w * a[y + j][x + i] for i, j, w in weights)
            mean_b = sum(w * b[y + j][x + i] for i, j, w in weights)
            var_a = sum(w * (a[y + j][x + i] - mean_a) ** 2 for i, j, w in weights)
            var_b = sum(w * (b[y + j][x + i] - mean_b) ** 2 for i, j, w in weights)
            both = sum(w * (a[y + j][x + i] - mean_a) * (b[y + j][x + i] - mean_b) for i, j, w in weights)
            luminance = (2 * mean_a * mean_b + 0.01**2) / (mean_a**2 + mean_b**2 + 0.01**2)
            structure = (2 * both + 0.03**2) / (var_a + var_b + 0.03**2)
            found.append(luminance * structure)
    return sum(found) / len(found)


def lightness_of_grey_code(code):
    """CIE L* of a grey sRGB code value in 0..1."""
    light = code / 12.92 if code <= 0.04045 else ((code + 0.055) / 1.055) ** 2.4
    root = light ** (1 / 3) if light > (6 / 29) ** 3 else light / (3 * (6 / 29) ** 2) + 4 / 29
    return 116 * root - 16


def delta_e_2000_of_greys(lightness_a, lightness_b):
    """CIE Delta E 2000 of two greys: the lightness term alone is left of the formula."""
    square = ((lightness_a + lightness_b) / 2 - 50) ** 2
    return abs(lightness_a - lightness_b) / (1 + 0.015 * square / math.sqrt(20 + square))


def percentile(numbers, part):
    """The number below which `part` of them lie, linear between neighbours of the sorted list."""
    ordered = sorted(numbers)
    place = part * (len(ordered) - 1)
    low = math.floor(place)
    high = min(low + 1, len(ordered) - 1)
    return ordered[low] + (ordered[high] - ordered[low]) * (place - low)
