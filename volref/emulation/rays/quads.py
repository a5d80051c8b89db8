"""Fragments as a GPU walks them: in quads of two by two pixels of one triangle, with helpers beyond its edge.

Only a program whose table has mip levels is walked so, see `mipmaps.py`: no other sees its neighbours.

L lanes, four for each quad, numbered from the lower left one, x first.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from volref.arrays import Booleans, Floats, Indices, Integers
from volref.emulation.device import Device
from volref.emulation.pipeline import Pipeline
from volref.emulation.rays.box import CORNERS, Box
from volref.emulation.rays.entering import faces, read_target
from volref.emulation.rays.paths import Ends
from volref.emulation.textures.mipmaps import LANES
from volref.errors import SceneError
from volref.scene.scene import Scene
from volref.stages.raster import Fragments


class Lanes(NamedTuple):
    """Fragments of whole quads: pixels (L,), held within the image, varyings (3, L), and which are drawn."""

    pixel: Integers
    varyings: Floats
    drawn: Booleans


def lanes_of(fragments: Fragments, scene: Scene, box: Box) -> Lanes:
    """Return the lanes of the box's fragments, whose varyings are coordinates in texture space.

    Helpers have the coordinates at which their pixel's line of sight meets the plane of their triangle.
    """
    x, y = fragments.pixel % scene.width, scene.height - 1 - fragments.pixel // scene.width
    across = -(-scene.width // 2)
    quad = (y // 2) * across + x // 2
    key, inverse = np.unique(
        fragments.triangle * (across * (scene.height // 2 + 1)) + quad, return_inverse=True
    )
    lane = inverse * LANES + y % 2 * 2 + x % 2
    first = np.zeros(len(key), np.intp)
    first[inverse] = np.arange(len(inverse))
    corner_x, corner_y = x[first] // 2 * 2, y[first] // 2 * 2
    all_x = (corner_x[:, None] + np.array([0, 1, 0, 1])).reshape(-1)
    all_y = (corner_y[:, None] + np.array([0, 0, 1, 1])).reshape(-1)
    varyings = beyond(box, fragments.triangle[first].repeat(LANES), all_x, all_y, scene)
    varyings[:, lane] = fragments.varyings
    drawn = np.zeros(len(all_x), np.bool_)
    drawn[lane] = True
    held_x, held_y = np.minimum(all_x, scene.width - 1), np.minimum(all_y, scene.height - 1)
    return Lanes((scene.height - 1 - held_y) * scene.width + held_x, varyings, drawn)


def beyond(box: Box, triangle: Indices, x: Integers, y: Integers, scene: Scene) -> Floats:
    """Return where lines of sight through pixel centres meet the planes of triangles of the box (3, L)."""
    corners = CORNERS[box.triangles[triangle]]
    fixed = np.argmax((corners == corners[:, :1]).all(axis=1), axis=1)
    matrix = box.clip_from_texture
    ndc = np.stack([(2 * x + 1) / scene.width - 1, (2 * y + 1) / scene.height - 1])
    # Two equations, clip xy = ndc clip w, for the two coordinates that are not fixed.
    rows = matrix[:2, None, :] - ndc[:, :, None] * matrix[3]
    place = np.empty((3, len(x)))
    for axis in range(3):
        here = np.flatnonzero(fixed == axis)
        value = corners[here, 0, axis]
        one, two = (k for k in range(3) if k != axis)
        a, b = rows[:, here, one], rows[:, here, two]
        c = -(rows[:, here, axis] * value + rows[:, here, 3])
        with np.errstate(divide="ignore", invalid="ignore"):
            divisor = a[0] * b[1] - a[1] * b[0]
            place[one, here] = (c[0] * b[1] - c[1] * b[0]) / divisor
            place[two, here] = (a[0] * c[1] - a[1] * c[0]) / divisor
        place[axis, here] = value
    return place


def rays_in_quads(
    scene: Scene, pipeline: Pipeline, box: Box, device: Device, targets: Mapping[str, Floats]
) -> tuple[Ends, Booleans]:
    """Return the ends of the rays of all lanes (L,), and which of them are drawn.

    Raises
    ------
    SceneError
        If the rays of the program do not start at the varying of the box's front faces.
    """
    if (pipeline.rays.kind, pipeline.rays.front) != ("coordinates", "varying"):
        message = f"pipeline.table.filter must be 'linear' or 'nearest' for rays of {pipeline.rays.kind!r}, "
        message += (
            "got 'linear-mipmap'; mip levels are known for front faces that are walked from their varying"
        )
        raise SceneError(message)
    lanes = lanes_of(faces(scene, box, device, "back"), scene, box)
    unused = np.zeros(0)
    fragments = Fragments(lanes.pixel, lanes.pixel, unused, unused, lanes.varyings, lanes.drawn)
    exits = read_target(targets["back_coordinates"], fragments, pipeline, box, device)
    return Ends(lanes.pixel, lanes.varyings.astype(device.control_type), exits), lanes.drawn
