"""Scenes of probes: each makes one thing large and leaves all others out.

flat      one value everywhere: filters of the volume and of the table have nothing to do
opaque    the first sample ends the ray: what is seen is one lookup
magnified a table that runs through its whole range every few entries: 1/512 of a weight is many codes
"""

import numpy as np

from volref.golden.charts.building import RED, YELLOW, bytes_volume, indices, pictured, view
from volref.golden.charts.places import letter
from volref.scene.mesh import Mesh
from volref.scene.scene import Scene
from volref.scene.transfer import TransferFunction
from volref.scene.volume import Volume

SEED = 11

# Entries of a table of 256 from one end of a ramp to the next.
PERIOD = 8

TRIANGLES = 60

CLEAR = (0.0, 0.2, 1.0)


def _flat(nx: int, ny: int, nz: int) -> Volume:
    """Return a volume of one value, that of the table's end."""
    return bytes_volume(np.full((nz, ny, nx), 255))


def wedge() -> Scene:
    """Return a flat haze in a box that is seen askew: no two of its edges alike."""
    volume = _flat(9, 6, 12)
    look = TransferFunction.from_opacity([0, 255], [(1.0, 0.6, 0.2)] * 2, [0.2, 0.2])
    return pictured(volume, look, view(volume, (0.9, 0.6, 0.3)))


def wedge_on_a_background() -> Scene:
    """Return the same on a background of some alpha."""
    scene = wedge()
    assert isinstance(scene.volume, Volume)
    assert isinstance(scene.transfer, TransferFunction)
    return pictured(scene.volume, scene.transfer, scene.camera, background=(0.4, 0.2, 0.6, 0.8))


def magnified() -> Scene:
    """Return an opaque block of waves, its colours ramps that are eight entries of the table long."""
    x, y, z = indices(5, 4, 4)
    volume = bytes_volume(127.5 + 120 * np.sin(1.1 * x + 0.3 * z) * np.cos(0.8 * y - 0.9 * z))
    entry = np.arange(256)
    table = np.ones((256, 4))
    for channel, period in enumerate((PERIOD, 3 * PERIOD, 16 * PERIOD)):
        phase = entry % (2 * period)
        table[:, channel] = np.minimum(phase, 2 * period - phase) / period
    # A fifth is a whole byte, so are 51 levels of it: ramps are rounded to bytes here, not by each program.
    table = np.rint(255 * table) / 255
    look = TransferFunction.from_opacity((entry + 0.5) / 256 * 255, table[:, :3], table[:, 3])
    return pictured(volume, look, view(volume, (0.6, 0.5, 1.0)))


def triangles() -> Scene:
    """Return slivers of triangles in many colours, and a volume that is not seen."""
    random = np.random.default_rng(SEED)
    volume = _flat(8, 8, 8)
    look = TransferFunction.from_opacity([0, 255], [(1.0, 1.0, 1.0)] * 2, [0, 0])
    middle = random.uniform(0, 7, (TRIANGLES, 1, 3))
    corners = middle + random.uniform(-1.6, 1.6, (TRIANGLES, 3, 3))
    colors = random.integers(0, 6, (TRIANGLES, 3, 3)) / 5
    mesh = Mesh(corners.reshape(-1, 3), np.arange(3 * TRIANGLES).reshape(-1, 3), colors.reshape(-1, 3))
    return pictured(volume, look, view(volume, (0.4, 0.5, 1.0), distance=1.1), meshes=(mesh,))


def waves() -> Scene:
    """Return an opaque block of waves through a table that bends."""
    x, y, z = indices(8, 7, 6)
    volume = bytes_volume(127.5 + 127.5 * np.sin(0.6 * x + 0.3 * z) * np.cos(0.5 * y - 0.4 * z))
    look = TransferFunction.from_opacity(
        [0, 80, 120, 255], [(0.0, 0.0, 0.4), (0.2, 0.8, 1.0), YELLOW, RED], [1, 1, 1, 1]
    )
    return pictured(volume, look, view(volume, (0.6, 0.5, 1.0)))


def dense_letter() -> Scene:
    """Return an F, dense: where its edges are is where the grid is."""
    volume = letter(9)
    look = TransferFunction.from_opacity([0, 60, 140, 255], [CLEAR, CLEAR, YELLOW, RED], [0, 0, 1, 1])
    return pictured(volume, look, view(volume, (0.55, 0.35, 1.0)))


def behind_a_veil() -> Scene:
    """Return a dark front, denser from left to right, and a white block behind all of it."""
    nx = 15
    x, _, z = indices(nx, 8, 12)
    values = np.where(z >= 4, 17 * x, 255.0)
    volume = bytes_volume(values)
    colors = [(0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (1.0, 1.0, 1.0), (1.0, 1.0, 1.0)]
    look = TransferFunction.from_opacity([0, 240, 250, 255], colors, [0.0, 0.95, 1.0, 1.0], 2.0)
    return pictured(volume, look, view(volume, (0.12, 0.09, 1.0)))


def curve() -> Scene:
    """Return an opaque ramp of greys."""
    x, _, _ = indices(16, 8, 4)
    volume = bytes_volume(17 * x)
    look = TransferFunction.from_opacity([0, 255], [(0.0, 0.0, 0.0), (1.0, 1.0, 1.0)], [1, 1])
    return pictured(volume, look, view(volume, (0.2, 0.3, 1.0)))
