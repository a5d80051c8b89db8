"""Scenes that show a slice through a volume: along its axes, pixel by voxel, or anywhere.

An axis slice of a volume of 4 x 3 samples in x and y, along z, with columns to the right and rows down:

    pixel (0, 0)  (1, 0)  (2, 0)  (3, 0)        shows voxel  x = 0, 1, 2, 3 of y = 0
          (0, 1)  (1, 1)  (2, 1)  (3, 1)                                       y = 1
          (0, 2)  (1, 2)  (2, 2)  (3, 2)                                       y = 2

so that row `r` of the image is `values[index, r, :]`.
"""

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import LARGEST_LENGTH, LEAST_LENGTH, Floats, float_array, number, one_of, whole_number
from volref.scene.camera import Camera
from volref.scene.lights import unit_vector
from volref.scene.plane import Plane
from volref.scene.scene import LARGEST_IMAGE_SIDE, Scene
from volref.scene.transfer import TransferFunction
from volref.scene.transform import affine
from volref.scene.volume import Volume

AXES = ("x", "y", "z")


def axis_slice(
    volume: Volume,
    transfer: TransferFunction,
    axis: str = "z",
    index: float = 0.0,
    *,
    columns: str = "right",
    rows: str = "down",
    background: ArrayLike = (0.0, 0.0, 0.0, 0.0),
) -> Scene:
    """Scene of the slice of `volume` at `index` along `axis`, one pixel a voxel.

    Pixels across are voxels along x (y for the axis x), pixels down are voxels along y (z for the axes x and
    y).  At a whole index each pixel shows the value of its voxel exactly; between two, the mean of both by
    distance.  Where the voxels are not as wide as high, neither is what the image shows to scale.

    Parameters
    ----------
    volume, transfer, background
        As of `Scene`.
    axis
        "x", "y" or "z": the index that is the same all over the slice.
    index
        Which slice, from 0 for the first sample; any number within the volume.
    columns
        Which way the index across grows: to the "right" or to the "left".
    rows
        Which way the index down grows: "down" or "up".

    Raises
    ------
    SceneError
        If the slice lies outside the volume, or a word is unknown.

    Examples
    --------
    >>> volume = Volume(np.arange(24).reshape(2, 3, 4))
    >>> scene = axis_slice(volume, TransferFunction([0], [(1, 1, 1)], opacity=[1]), "y", 2)
    >>> scene.width, scene.height, scene.slice_plane.point.tolist()
    (4, 2, [1.5, 2.0, 0.5])
    """
    one_of("slice.axis", axis, AXES)
    one_of("slice.columns", columns, ("right", "left"))
    one_of("slice.rows", rows, ("down", "up"))
    along = AXES.index(axis)
    low, high = volume.index_bounds
    at = number("slice.index", index, low=float(low[along]), high=float(high[along]))
    across, down = (k for k in range(3) if k != along)
    center = (np.array(volume.size) - 1.0) / 2
    center[along] = at
    view_from_index = np.zeros((3, 3))
    view_from_index[0, across] = 1.0 if columns == "right" else -1.0
    view_from_index[1, down] = -1.0 if rows == "down" else 1.0
    view_from_index[2, along] = 1.0
    index_from_world = volume.index_from_world
    if np.linalg.det(view_from_index @ index_from_world[:3, :3]) < 0:
        view_from_index[2] *= -1.0  # so that the world is not seen in a mirror, if the words allow it
    view = affine(view_from_index, -view_from_index @ center) @ index_from_world
    # One unit of view space is one index, so the rays begin half an index before the slice.
    width, height = volume.size[across], volume.size[down]
    camera = Camera(view, "orthographic", height=float(height), near=-0.5, far=0.5)
    plane = Plane(_world_point(volume, center), index_from_world[along, :3])
    return Scene(
        volume, transfer, camera, width, height, background=background, mode="slice", slice_plane=plane
    )


def _world_point(volume: Volume, index: Floats) -> Floats:
    matrix = volume.world_from_index
    return np.asarray(matrix[:3, :3] @ index + matrix[:3, 3])


def oblique_slice(
    volume: Volume,
    transfer: TransferFunction,
    point: ArrayLike,
    normal: ArrayLike,
    up: ArrayLike,
    width: int,
    height: int,
    pixel_size: float,
    *,
    background: ArrayLike = (0.0, 0.0, 0.0, 0.0),
) -> Scene:
    """Scene of the slice of `volume` through `point`, seen against `normal` (multi-planar reformation).

    Parameters
    ----------
    volume, transfer, background
        As of `Scene`.
    point
        World point (x, y, z) in the middle of the image.
    normal
        Towards the viewer.
    up
        Upwards in the image; not along `normal`.
    width, height
        Size of the image in pixels.
    pixel_size
        World distance of neighbouring pixels.

    Raises
    ------
    SceneError
        If `normal` is zero, `up` lies along it, or a size is not above 0.

    Examples
    --------
    >>> volume = Volume(np.zeros((8, 8, 8)))
    >>> table = TransferFunction([0], [(1, 1, 1)], opacity=[1])
    >>> scene = oblique_slice(volume, table, (4, 4, 4), (1, 1, 0), (0, 0, 1), 16, 12, 0.5)
    >>> scene.camera.height, scene.slice_plane.normal.round(6).tolist()
    (6.0, [0.707107, 0.707107, 0.0])
    """
    middle = float_array("slice.point", point, (3,), limit=LARGEST_LENGTH)
    towards = unit_vector("slice.normal", normal)
    rows = whole_number("slice.height", height, low=1, high=LARGEST_IMAGE_SIDE)
    size = number("slice.pixel_size", pixel_size, low=LEAST_LENGTH, high=LARGEST_LENGTH)
    # Far enough from the plane for the difference to have digits left.
    away = max(size, 1e-6 * float(np.abs(middle).max()))
    camera = Camera.orthographic(middle + away * towards, middle, up, rows * size, 0.0, 2 * away)
    return Scene(
        volume,
        transfer,
        camera,
        width,
        rows,
        background=background,
        mode="slice",
        slice_plane=Plane(middle, towards),
    )
