"""First hits by brute force: every ray against every triangle (Moller and Trumbore 1997), in float64.

Written from the camera's two matrices alone; shares no code with the z-buffer.
"""

from typing import NamedTuple

import numpy as np

EPS = np.finfo(np.float64).eps


class Lines(NamedTuple):
    """Rays whose parameter is the depth along the viewing axis, counted from the eye (or eye plane)."""

    origins: np.ndarray
    directions: np.ndarray


class Hits(NamedTuple):
    """Per ray: the triangle hit first, its depth and distance, the rounding to expect, and the margin.

    `margin` is the distance in pixels to the nearest border of a triangle the ray hits or just misses:
    its edges and the lines where the near and the far plane cut it.
    """

    triangle: np.ndarray
    depth: np.ndarray
    distance: np.ndarray
    rounding: np.ndarray
    margin: np.ndarray


def pixel_lines(camera, width, height, x, y):
    """Return the lines through image points (x, y) in pixels, for projections without shear of the image."""
    clip = camera.clip_from_view(width, height)
    ndc_x, ndc_y = 2 * x / width - 1, 1 - 2 * y / height
    world_from_view = np.linalg.inv(camera.view_from_world)
    rotation, eye = world_from_view[:3, :3], world_from_view[:3, 3]
    zero, one = np.zeros_like(ndc_x), np.ones_like(ndc_x)
    if clip[3, 3] == 0:
        view = np.stack([(ndc_x + clip[0, 2]) / clip[0, 0], (ndc_y + clip[1, 2]) / clip[1, 1], -one], axis=1)
        return Lines(np.broadcast_to(eye, view.shape), view @ rotation.T)
    view = np.stack([(ndc_x - clip[0, 3]) / clip[0, 0], (ndc_y - clip[1, 3]) / clip[1, 1], zero], axis=1)
    return Lines(view @ rotation.T + eye, np.broadcast_to(-rotation[:, 2], view.shape))


def first_hits(camera, width, height, triangles, pixels, chunk=100):
    """Return the hits of the rays through the centres of flat `pixels` (R,) with triangles (T, 3, 3)."""
    y, x = np.divmod(pixels, width)
    parts = [
        _hits(camera, width, height, triangles, x[some] + 0.5, y[some] + 0.5)
        for some in np.array_split(np.arange(len(pixels)), 1 + len(pixels) // chunk)
    ]
    return Hits(*(np.concatenate(field) for field in zip(*parts, strict=True)))


def _hits(camera, width, height, triangles, x, y):
    lines = pixel_lines(camera, width, height, x, y)
    here = _volumes(lines, triangles)
    u, v, det, t = here
    with np.errstate(all="ignore"):
        depth = t / det
        inside = (u * det >= 0) & (v * det >= 0) & ((det - u - v) * det >= 0) & (det != 0)
        between = (depth >= camera.near) & (depth <= camera.far)
    depth = np.where(inside & between, depth, np.inf)
    first = depth.argmin(axis=1)
    nearest = depth[np.arange(len(x)), first]
    hit = np.isfinite(nearest)
    distance, rounding = _distance(camera, lines, triangles[first], nearest)
    margin = _margin(camera, width, height, triangles, x, y, here)
    return (
        np.where(hit, first, -1),
        nearest,
        np.where(hit, distance, np.inf),
        rounding,
        margin,
    )


def _volumes(lines, triangles):
    """Return the four volumes (R, T) of the method: u det, v det, det and depth det.

    With the ray o + t d, its moment m = o x d, the corner a and the edges e, f, multiplied out so that each
    is a matrix product: (o - a) . (d x f) = m . f - d . (f x a), and likewise for the others.
    """
    origin, direction = lines
    a, e, f = triangles[:, 0], triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    moment, normal = np.cross(origin, direction), np.cross(e, f)
    return (
        moment @ f.T - direction @ np.cross(f, a).T,
        direction @ np.cross(e, a).T - moment @ e.T,
        -direction @ normal.T,
        origin @ normal.T - (a * normal).sum(axis=1),
    )


def _margin(camera, width, height, triangles, x, y, here):
    """Distance in pixels: each volume is affine in x and y, so value / |gradient| is exact."""
    right = _volumes(pixel_lines(camera, width, height, x + 1, y), triangles)
    below = _volumes(pixel_lines(camera, width, height, x, y + 1), triangles)

    def borders(volumes):
        u, v, det, t = volumes
        yield from (u, v, det - u - v, t - camera.near * det)
        # Beyond an infinite far plane there is nothing.
        yield camera.far * det - t if np.isfinite(camera.far) else t

    sign = np.sign(here[2])
    inward = np.full(here[0].shape, np.inf)
    closest = np.full(here[0].shape, np.inf)
    for value, value_x, value_y in zip(borders(here), borders(right), borders(below), strict=True):
        gradient = np.hypot(value_x - value, value_y - value)
        # A border that no pixel of the image can reach has no gradient.
        endless = np.where(sign * value >= 0, np.inf, -np.inf)
        away = np.divide(sign * value, gradient, out=endless, where=gradient > 0)
        inward = np.minimum(inward, away)
        closest = np.minimum(closest, np.abs(away))
    return np.where(inward >= -1.0, closest, np.inf).min(axis=1)


def _distance(camera, lines, triangles, depth):
    """Return the distance from where volref's ray starts, and a bound on the rounding of both sides.

    Some forty operations each add up to eps relative to the largest number in play; grazing rays and thin
    triangles magnify that by 1 / cosine and 1 / sine.
    """
    length = np.linalg.norm(lines.directions, axis=1)
    start = camera.near if camera.is_parallel else 0.0
    edge1, edge2 = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    normal = np.cross(edge1, edge2)
    area = np.linalg.norm(normal, axis=1)
    cosine = np.abs((normal * lines.directions).sum(axis=1)) / (area * length)
    sine = area / (np.linalg.norm(edge1, axis=1) * np.linalg.norm(edge2, axis=1))
    from_corner = lines.origins - triangles[:, 0]
    with np.errstate(all="ignore"):
        finite = -(normal * from_corner).sum(axis=1) / (normal * lines.directions).sum(axis=1)
    finite = np.where(np.isfinite(depth), finite, 0.0)
    scale = np.abs(lines.origins).max(axis=1) + np.abs(triangles).max(axis=(1, 2)) + finite
    return (finite - start) * length, 40 * EPS * scale / (cosine * sine)
