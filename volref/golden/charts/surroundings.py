"""Charts of what is around a volume: backgrounds, meshes, lights."""

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import Vector
from volref.golden.charts.building import (
    BLUE,
    HEIGHT,
    RED,
    UPWARDS,
    WIDTH,
    YELLOW,
    bytes_volume,
    indices,
    pictured,
    rainbow,
    view,
)
from volref.golden.charts.places import TURN, letter
from volref.phantoms.meshes import box_mesh, sphere_mesh
from volref.scene.lights import Light, Material
from volref.scene.mesh import Mesh
from volref.scene.scene import Scene
from volref.scene.transfer import TransferFunction
from volref.scene.volume import Volume

# What lit charts are lit by: one side much brighter than the other, in two colours.
SUN = Light.directional((-1.0, -0.6, -0.8), (0.6, 0.6, 0.4))
LAMP = Light.point((-14.0, 20.0, 6.0), (0.2, 0.2, 0.6))
SKY = Light.ambient((0.2, 0.2, 0.2))


def _ball(
    size: tuple[int, int, int] = (12, 12, 12), spacing: tuple[float, float, float] = (1.0, 1.0, 1.0)
) -> Volume:
    """Return a ball with soft edges that fills the box."""
    x, y, z = indices(*size)
    nx, ny, nz = size
    radius = np.sqrt(((x + 0.5) / nx - 0.5) ** 2 + ((y + 0.5) / ny - 0.5) ** 2 + ((z + 0.5) / nz - 0.5) ** 2)
    return bytes_volume(255 * np.clip((0.48 - radius) / 0.25, 0, 1), spacing)


def on_a_background() -> Scene:
    """Return a soft ball on a background that lets light through."""
    volume = _ball()
    camera = view(volume, (0.5, 0.6, 1.0))
    return pictured(volume, rainbow(0.5), camera, background=(0.2, 0.4, 0.6, 0.8))


def stripes_behind() -> Scene:
    """Return a thin slab of opacity .1 per unit before opaque stripes."""
    volume = bytes_volume(np.full((8, 10, 12), 255.0))
    look = TransferFunction.from_opacity([0, 255], [(1.0, 0.6, 0.2)] * 2, [0.1, 0.1], 1.0)
    bars = tuple(_bar(0.9 + 2.4 * number, color) for number, color in enumerate((BLUE, YELLOW, RED, BLUE)))
    return pictured(volume, look, view(volume, (0.3, 0.35, 1.0)), meshes=bars)


def _bar(x: float, color: tuple[float, float, float]) -> Mesh:
    """Return an upright bar that leans back into the slab."""
    corners = [(x, -2.0, -1.0), (x + 1.3, -2.0, -1.0), (x + 1.9, 11.0, 6.5), (x + 0.6, 11.0, 6.5)]
    return Mesh(corners, [(0, 1, 2), (0, 2, 3)], color)


def wide_sphere() -> Scene:
    """Return a ball of triangles under a wide angle, where depth and distance are far apart."""
    x, y, z = indices(14, 12, 10)
    volume = bytes_volume(90 + 60 * np.sin(0.6 * x) * np.cos(0.5 * y + 0.4 * z) + 5 * x)
    camera = view(volume, (0.3, 0.25, 1.0), distance=0.55, fov_y=95.0)
    ball = sphere_mesh(5.2, volume.corners.mean(axis=0), (0.6, 0.8, 0.2), subdivisions=2)
    return pictured(volume, rainbow(0.7), camera, meshes=(ball,))


def sheet_through() -> Scene:
    """Return a bent sheet through a haze, from the eye to far behind."""
    x, y, z = indices(12, 10, 11)
    volume = bytes_volume(120 + 60 * np.sin(0.6 * x) * np.cos(0.5 * y + 0.4 * z))
    corners = [(-6.0, -4.0, 13.0), (16.0, -3.0, 8.0), (18.0, 14.0, -4.0), (-5.0, 13.0, 2.0)]
    sheet = Mesh(
        corners, [(0, 1, 2), (0, 2, 3)], [(0.2, 0.6, 1.0), (0.0, 1.0, 0.4), (1.0, 0.6, 0.0), (0.8, 0.8, 0.8)]
    )
    block = box_mesh((3.0, 3.0, 3.0), (8.0, 7.0, 9.0), (1.0, 0.2, 0.6))
    camera = view(volume, (0.4, 0.7, 1.0), distance=1.3)
    return pictured(volume, rainbow(0.5), camera, meshes=(sheet, block), background=(0.2, 0.2, 0.4, 1.0))


def values_as_opacity() -> Scene:
    """Return F and a haze that reaches all faces, for a program that takes the value for opacity."""
    x, y, _ = indices(10, 12, 11)
    values = np.maximum(letter(11).values, 30 + 4 * x + 3 * y)
    volume = bytes_volume(values)
    return pictured(volume, rainbow(0.8), view(volume, (0.75, 0.4, 1.0)))


def bright_on_grey() -> Scene:
    """Return F on a grey background, for a program with a tone map and gamma."""
    volume = letter(9)
    return pictured(volume, rainbow(0.4), view(volume, (0.55, 0.35, 1.0)), background=(0.4, 0.4, 0.6, 1.0))


def _lit(volume: Volume, direction: ArrayLike, material: Material) -> Scene:
    look = TransferFunction.from_opacity([0, 60, 160, 255], [(0.8, 0.8, 0.8)] * 4, [0, 0.4, 0.8, 0.8], 1.0)
    lights = SUN, LAMP, SKY
    camera = view(volume, direction, up=volume.direction @ UPWARDS)
    return Scene(volume, look, camera, WIDTH, HEIGHT, lights=lights, material=material)


def _hill(spacing: Vector = (1.0, 1.0, 1.0), direction: ArrayLike | None = None) -> Volume:
    """Return values that fall evenly from a point near the middle: gradients are long everywhere."""
    x, y, z = indices(12, 12, 12)
    away = np.sqrt((x - 6.0) ** 2 + 0.7 * (y - 5.3) ** 2 + 1.4 * (z - 5.0) ** 2)
    return bytes_volume(255 * np.clip(1.1 - away / 5.2, 0, 1), spacing, direction)


def lit_sphere() -> Scene:
    """Return a ball under a sun, a lamp and a sky."""
    return _lit(
        _hill(), (0.5, 0.6, 1.0), Material("phong", ambient=0.4, diffuse=0.8, specular=0.2, shininess=6)
    )


def lit_turned() -> Scene:
    """Return a ball of voxels of three lengths, turned, under the same lights."""
    volume = _hill((1.2, 0.9, 0.6), TURN)
    return _lit(volume, TURN @ (0.5, 0.4, 1.0), Material("lambert", ambient=0.4, diffuse=0.8))
