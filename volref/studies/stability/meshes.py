"""Cases of surfaces: how far away they are, which is in front, and which pixels they cover."""

import math
from collections.abc import Sequence

import numpy as np

from volref.arrays import Floats
from volref.phantoms.separable import pixel_ray
from volref.scene import Camera, Mesh, Scene
from volref.studies.stability import textbook
from volref.studies.stability.case import EPS, Case, Measured, measured
from volref.truth.meshes import surfaces

FAMILY = "Surfaces"

RED, GREEN = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)


def wall(distance: float, color: Sequence[float] = RED) -> Mesh:
    """Return a triangle across the -z axis, `distance` in front of the origin."""
    size = 4 * distance
    points = [(-size, -size, -distance), (size, -size, -distance), (0.0, size, -distance)]
    return Mesh(points, [(0, 1, 2)], colors=color)


def ahead(near: float, far: float) -> Camera:
    """Return a camera at the origin that looks along -z."""
    return Camera.look_at((0, 0, 0), (0, 0, -1), (0, 1, 0), 30.0, near, far)


def _distances(near: float, far: float, distances: list[float]) -> Measured:
    camera = ahead(near, far)
    found = [
        surfaces.visible_surface(Scene(None, None, camera, 1, 1, [wall(d)])).distance[0, 0] for d in distances
    ]
    naive = [textbook.window_depth(d, near, far) for d in distances]
    return measured(distances, naive, found, 4 * EPS)


def _in_front() -> Measured:
    """Put green at 1e4 and red a billionth of that behind it, red first in the list; near plane 1e-3."""
    behind = 1e4 * (1 + 1e-9)
    scene = Scene(None, None, ahead(1e-3, 1e6), 1, 1, [wall(behind, RED), wall(1e4, GREEN)])
    first, second = (textbook.window_depth(d, 1e-3, 1e6) for d in (behind, 1e4))
    naive = GREEN if second < first else RED
    return measured(GREEN, naive, surfaces.visible_surface(scene).color[0, 0], 0.0)


def _coincident() -> Measured:
    """Put two walls in one place."""
    scene = Scene(None, None, ahead(0.1, 100.0), 4, 4, [wall(5.0, GREEN), wall(5.0, RED)])
    found = surfaces.visible_surface(scene).color.reshape(-1, 3)
    return measured(np.tile(GREEN, (16, 1)), np.tile(RED, (16, 1)), found, 0.0)


def _floor() -> Measured:
    """1 / distance, 0 where nothing is met, of a floor that reaches from far ahead to behind the camera."""
    corners = np.array([(-900.0, -1.0, 50.0), (900.0, -1.0, 50.0), (0.0, -1.0, -2000.0)])
    camera = Camera.look_at((0, 0, 0), (0, -0.5, -1), (0, 1, 0), 40.0, 0.1, 1e4)
    scene = Scene(None, None, camera, 8, 8, [Mesh(corners, [(0, 1, 2)])])
    rays = [pixel_ray(camera, 8, 8, x, y)[1] for y in range(8) for x in range(8)]
    truth = [max(-d[1], 0.0) for d in rays]
    covered = _covered_after_division(corners, camera, 8)
    found = 1 / surfaces.visible_surface(scene).distance.ravel()
    # At distances d of at least 1 the error of 1 / d is at most that of d.
    return measured(truth, np.where(covered, truth, 0.0), found, 16 * EPS * 2001)


def _covered_after_division(corners: Floats, camera: Camera, size: int) -> Floats:
    """Tell which pixel centres lie in the triangle of the corners divided by w, whatever its sign."""
    view = corners @ camera.view_from_world[:3, :3].T + camera.view_from_world[:3, 3]
    clip = np.column_stack([view, np.ones(3)]) @ camera.clip_from_view(size, size).T
    x, y = (clip[:, :2] / clip[:, 3:]).T
    row, column = np.divmod(np.arange(size * size), size)
    px, py = 2 * (column + 0.5) / size - 1, 1 - 2 * (row + 0.5) / size
    turns = [(x[b] - x[a]) * (py - y[a]) - (y[b] - y[a]) * (px - x[a]) for a, b in ((0, 1), (1, 2), (2, 0))]
    return np.asarray((np.array(turns) > 0).all(axis=0) | (np.array(turns) < 0).all(axis=0))


def _without_area() -> Measured:
    """Put a triangle shrunk to a line before a real one 5 away."""
    line = np.array([(-1.0, 0.0, -3.0), (1.0, 0.0, -3.0), (0.0, 0.0, -3.0)])
    real = wall(5.0)
    both = Mesh(np.concatenate([line, real.vertices]), [(0, 1, 2), (3, 4, 5)])
    scene = Scene(None, None, ahead(0.1, 100.0), 1, 1, [both])
    found = [surfaces.visible_surface(scene).distance[0, 0], both.dropped]
    hits = [
        textbook.distance_by_determinant((0, 0, 0), (0, 0, -1), triangle)
        for triangle in (line, real.vertices)
    ]
    return measured([5.0, 1.0], [float(np.min(hits)), 0.0], found, 5 * 4 * EPS)


def _edge_through_centers() -> Measured:
    """How often 64 pixels are covered by two triangles whose common edge runs through 8 pixel centres."""
    corners = [(-4.0, -4.0, 0.0), (4.0, -4.0, 0.0), (4.0, 4.0, 0.0), (-4.0, 4.0, 0.0)]
    camera = Camera.orthographic((0, 0, 5), (0, 0, 0), (0, 1, 0), 8.0, 0.0, 10.0)
    found, naive = 0, 0
    for face in ((0, 1, 2), (0, 2, 3)):
        scene = Scene(None, None, camera, 8, 8, [Mesh(corners, [face])])
        found += int(np.isfinite(surfaces.visible_surface(scene).distance).sum())
        column, row = np.meshgrid(np.arange(8), np.arange(8))
        naive += int((column + row >= 7).sum() if face[1] == 1 else (column + row <= 7).sum())
    return measured(64, naive, found, 0.0)


def _inside_a_cube() -> Measured:
    """Measure the way to the wall ahead from the middle of a cube of half side 1, opening 90 degrees."""
    camera = Camera.look_at((0, 0, 0), (0, 0, -1), (0, 1, 0), 90.0, 1e-3, 10.0)
    rays = [pixel_ray(camera, 8, 8, x, y)[1] for y in range(8) for x in range(8)]
    truth = [1 / -d[2] for d in rays]
    scene = Scene(None, None, camera, 8, 8, [cube((0.0, 0.0, 0.0), 1.0)])
    found = surfaces.visible_surface(scene).distance.ravel()
    return measured(truth, np.ones(64), found, 16 * EPS * math.sqrt(3))


def cube(middle: Sequence[float], half: float, color: Sequence[float] = RED) -> Mesh:
    """Return the surface of a cube."""
    corner = np.array([(x, y, z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)])
    quads = [(0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5)]
    faces = [face for a, b, c, d in quads for face in ((a, b, c), (a, c, d))]
    return Mesh(np.asarray(middle) + half * corner, faces, colors=color)


ON_AXIS = "the distance of a wall straight ahead"
WINDOW = "a float32 depth buffer from 0 to 1, read back"
SUM_TO_ONE = "the weights of the three corners, which lie equally deep, add up to 1 within 3 ulp"
HIT = "the ray is off by 8 ulp (matrices, tangent, length), the hit by as many"

CASES = (
    Case(
        "near-1e-3-far-1e6",
        FAMILY,
        "How far is a wall at 1, 100, 1e4 and 9e5, with the near plane at 1e-3 and the far one at 1e6?",
        ON_AXIS,
        WINDOW,
        SUM_TO_ONE,
        lambda: _distances(1e-3, 1e6, [1.0, 100.0, 1e4, 9e5]),
        "relative",
    ),
    Case(
        "near-1e-3-far-1e9",
        FAMILY,
        "And with the far plane at 1e9, up to 9e8?",
        ON_AXIS,
        WINDOW,
        SUM_TO_ONE,
        lambda: _distances(1e-3, 1e9, [0.002, 1.0, 1e4, 9e8]),
        "relative",
    ),
    Case(
        "a-billionth-in-front",
        FAMILY,
        "Of two walls at 1e4, one a billionth nearer, which is seen?",
        "the nearer one, which is green and comes last",
        "a float32 depth buffer, in which both are equal and the first stays",
        "exact: a colour; the keys near / distance differ by a billionth in float64",
        _in_front,
    ),
    Case(
        "coincident-walls",
        FAMILY,
        "Of two walls in one place, is the first of the scene seen at every pixel?",
        "green: the rule of the scene model",
        "less-or-equal, by which the last drawn wins",
        "exact: a colour",
        _coincident,
    ),
    Case(
        "floor-through-the-camera-plane",
        FAMILY,
        "Is a floor that reaches behind the camera met where it should be (1 / distance per pixel)?",
        "the ray meets y = -1 at 1 / -d_y, upwards nowhere",
        "corners divided by w although two of them lie behind the camera",
        "weights off by 4 ulp multiply corners up to 2001 away, and the ray is off by 8: 16 eps of 2001",
        _floor,
    ),
    Case(
        "triangle-without-area",
        FAMILY,
        "Is a triangle shrunk to a line counted as dropped, and the real one behind it met?",
        "1 dropped, and the distance of the real one: 5",
        "Moeller and Trumbore without the test for a determinant of 0",
        SUM_TO_ONE,
        _without_area,
    ),
    Case(
        "edge-through-pixel-centres",
        FAMILY,
        "How often are 64 pixels covered by two triangles with an edge through 8 of the centres?",
        "64 times: each once",
        "a test that takes edges for inside, which covers 8 pixels twice",
        "exact: a count",
        _edge_through_centers,
    ),
    Case(
        "camera-inside-a-cube",
        FAMILY,
        "From inside a closed mesh, how far is its wall?",
        "1 / cos of the ray's angle to the axis",
        "the depth along the axis, 1, taken for the distance",
        HIT,
        _inside_a_cube,
    ),
)
