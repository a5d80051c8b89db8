"""What charts are made of: voxels in bytes, tables of whole fifths, cameras that look a little askew.

Fifths are whole bytes, k / 5 = 51 k / 255, so that what is of one colour hangs on no rounding.  Cameras are
turned against all axes, and their middle is beside the volume's: an edge that runs through the centres of
pixels would leave each of them to chance.
"""

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import Floats, Vector
from volref.scene.camera import Camera
from volref.scene.mesh import Mesh
from volref.scene.scene import Scene
from volref.scene.transfer import TransferFunction
from volref.scene.volume import Volume

WIDTH, HEIGHT = 48, 40

# The opacities of tables are meant for this many world units, where nothing else is said.
UNIT_DISTANCE = 2.0

BLUE, CYAN, YELLOW, RED = (0.2, 0.2, 1.0), (0.2, 0.8, 0.8), (1.0, 0.8, 0.2), (1.0, 0.2, 0.2)

# How far beside a volume's middle a camera looks, in its diagonals.
ASKEW = 0.013

# Not quite an axis.
UPWARDS = (0.08, 1.0, 0.05)


def indices(nx: int, ny: int, nz: int) -> tuple[Floats, Floats, Floats]:
    """Return x, y and z (nz, ny, nx) of voxels, 0 for the first.

    Examples
    --------
    >>> x, y, z = indices(3, 2, 1)
    >>> x[0, 0].tolist(), y[0, :, 0].tolist()
    ([0.0, 1.0, 2.0], [0.0, 1.0])
    """
    z, y, x = np.meshgrid(*(np.arange(float(n)) for n in (nz, ny, nx)), indexing="ij")
    return x, y, z


def bytes_volume(
    values: ArrayLike,
    spacing: Vector = (1.0, 1.0, 1.0),
    direction: ArrayLike | None = None,
    origin: Vector = (0.0, 0.0, 0.0),
) -> Volume:
    """Return a volume of whole numbers 0..255."""
    voxels = np.rint(np.clip(values, 0, 255)).astype(np.uint8)
    turned = np.eye(3) if direction is None else direction
    return Volume(voxels, spacing, origin, turned)


def rainbow(most: float = 0.6, unit_distance: float = UNIT_DISTANCE, least: float = 0.0) -> TransferFunction:
    """Return a table whose colour and opacity change all over: from `least` at 0 to `most` at 255."""
    opacities = least + (most - least) * np.arange(4) / 3
    return TransferFunction.from_opacity(
        [0, 85, 170, 255], [BLUE, CYAN, YELLOW, RED], opacities, unit_distance
    )


def view(
    volume: Volume,
    direction: ArrayLike,
    *,
    distance: float = 1.4,
    fov_y: float = 32.0,
    up: ArrayLike = UPWARDS,
) -> Camera:
    """Return a camera that looks from a direction, some diagonals away, past the middle of a volume."""
    corners = volume.corners
    diagonal = float(np.linalg.norm(corners.max(axis=0) - corners.min(axis=0)))
    target = corners.mean(axis=0) + ASKEW * diagonal * np.array([1.0, -0.7, 0.4])
    towards = np.asarray(direction, dtype=np.float64)
    eye = target + towards / np.linalg.norm(towards) * distance * diagonal
    return Camera.look_at(eye, target, np.asarray(up, np.float64), fov_y, 0.05 * diagonal, 4.0 * diagonal)


def pictured(
    volume: Volume,
    look: TransferFunction,
    camera: Camera,
    *,
    meshes: tuple[Mesh, ...] = (),
    background: ArrayLike = (0.0, 0.0, 0.0, 0.0),
) -> Scene:
    """Return a scene of a chart's size."""
    return Scene(volume, look, camera, WIDTH, HEIGHT, meshes, background=background)
