"""Small scenes on which emulations are held to real WebGL, by name, each with what is special about it.

`needs` are the kinds of scenes that only some systems draw: "mesh" (opaque meshes), "parallel" (rays without
an eye), "lit" (lights and a material), "gradients" (a table of the gradient too), "radar" (a radar in place
of a volume, see `radar_scenes.py`).  A scene without any suits every system, but for those of radars only.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tests.webgl import radar_scenes
from volref import Camera, Light, Material, Mesh, Scene, TransferFunction, TransferFunction2D, Volume
from volref.phantoms.meshes import box_mesh, sphere_mesh

WIDTH, HEIGHT = 96, 72

# Colours of meshes and backgrounds are fifths: whole bytes, so that no rounding decides on what is all one.

# A turn about an oblique axis: orthogonal to rounding.
TURNED = np.linalg.qr(np.array([[2.0, -1.0, 0.5], [1.0, 2.0, 0.3], [-0.4, 0.2, 2.0]]))[0]


@dataclass(frozen=True)
class Example:
    """A scene and the kinds it is of."""

    make: Callable[[], Scene]
    needs: frozenset[str] = frozenset()


def field(size=(24, 20, 17), *, border=False, **place):
    """Volume of bytes with slopes everywhere: waves in a ball that ends before the faces, or does not."""
    nx, ny, nz = size
    z, y, x = np.meshgrid(*((np.arange(n) + 0.5) / n for n in (nz, ny, nx)), indexing="ij")
    waves = 0.6 + 0.2 * np.sin(9 * x + 4 * z) * np.cos(7 * y - 3 * z) + 0.2 * np.cos(11 * z + 5 * x * y)
    radius = np.sqrt((x - 0.5) ** 2 + (y - 0.47) ** 2 + (z - 0.52) ** 2)
    ball = 1.0 if border else np.clip((0.5 - radius) / 0.18, 0.0, 1.0)
    return Volume(np.rint(255 * np.clip(waves * ball, 0.0, 1.0)).astype(np.uint8), **place)


def transfer(opacity=0.5, unit_distance=4.0):
    """Transparent for low values, then denser, with a colour that changes throughout."""
    colors = [(0.1, 0.2, 0.9), (0.1, 0.5, 1.0), (0.9, 0.7, 0.2), (1.0, 0.3, 0.1)]
    opacities = np.array([0.0, 0.05, 0.5, 1.0]) * opacity
    return TransferFunction.from_opacity([0, 60, 150, 255], colors, opacities, unit_distance)


def towards(volume, direction, *, distance=1.6, fov_y=35.0, up=(0.1, 0.2, 1.0), off=0.0):
    """Camera that looks from a direction at the middle of a volume, from some of its diagonals away.

    off: how far beside the middle, in diagonals.  Straight from the middle, coordinates are simple fractions.
    """
    low, high = volume.corners.min(axis=0), volume.corners.max(axis=0)
    diagonal = float(np.linalg.norm(high - low))
    target = (low + high) / 2 + off * diagonal
    eye = target + np.array(direction) / np.linalg.norm(direction) * distance * diagonal
    return Camera.look_at(eye, target, up, fov_y, 0.05 * diagonal, 4.0 * diagonal)


def scene(volume, camera, look=None, **more):
    return Scene(volume, look or transfer(), camera, WIDTH, HEIGHT, **more)


def oblique():
    """Perspective from an oblique direction; 17 slices in 5 x 4 tiles, three of them empty."""
    volume = field()
    return scene(volume, towards(volume, (1.0, 0.7, 0.55)))


def axis_aligned():
    """Straight along z, over a background: rays through the middle are parallel to two axes, almost."""
    volume = field()
    camera = towards(volume, (0.0, 0.0, 1.0), up=(0.0, 1.0, 0.0), off=0.013)
    return scene(volume, camera, background=(0.2, 0.2, 0.4, 0.6))


def eleven_slices():
    """An atlas of 4 x 3 tiles: neither square nor full."""
    volume = field((19, 23, 11), spacing=(1.0, 1.0, 2.0))
    return scene(volume, towards(volume, (-0.6, 1.0, 0.8)))


def turned():
    """Voxels of three lengths in a volume that is turned and moved."""
    volume = field((17, 20, 13), spacing=(0.7, 1.1, 1.9), direction=TURNED, origin=(3.0, -2.0, 5.0))
    return scene(volume, towards(volume, (0.8, -0.9, 0.6)))


def dense():
    """Opaque after a few samples."""
    volume = field((20, 20, 16))
    return scene(volume, towards(volume, (0.9, 0.8, -0.5)), transfer(1.0, 1.0))


def thin():
    """Nowhere near opaque."""
    volume = field((20, 20, 16))
    return scene(volume, towards(volume, (0.5, -0.9, 0.7)), transfer(0.15, 8.0))


def full():
    """Values above 0 up to the faces: what is beyond the outer slices and tiles shows."""
    volume = field((16, 18, 14), border=True)
    return scene(volume, towards(volume, (1.0, 0.4, 0.9)), transfer(0.4, 6.0))


def inside():
    """An eye within the box."""
    volume = field()
    camera = towards(volume, (1.0, 0.6, 0.4), distance=0.2, fov_y=70.0)
    return scene(volume, camera, transfer(0.3, 6.0))


def parallel():
    """Parallel rays, oblique to the box."""
    volume = field()
    eye = np.array(volume.corners.mean(axis=0)) + np.array([30.0, 20.0, 25.0])
    camera = Camera.orthographic(eye, volume.corners.mean(axis=0), (0, 0, 1), 30.0, 1.0, 120.0)
    return scene(volume, camera)


def _with(mesh: Callable[[np.ndarray, np.ndarray], Mesh]) -> Scene:
    """Scene with a mesh that is made for the middle of the volume and the way to the eye from there."""
    volume = field()
    camera = towards(volume, (1.0, 0.7, 0.55))
    middle = volume.corners.mean(axis=0)
    return scene(volume, camera, meshes=(mesh(middle, np.array([1.0, 0.7, 0.55])),))


def mesh_in_front():
    """A ball between the eye and the box."""
    return _with(lambda middle, way: sphere_mesh(3.0, middle + 22 * way, (0.2, 0.8, 0.4), subdivisions=1))


def mesh_inside():
    """A box within the volume."""
    return _with(lambda middle, _: box_mesh((7.0, 6.0, 5.0), middle, (1.0, 0.8, 0.2)))


def mesh_behind():
    """A ball behind the box, seen through it and beside it."""
    return _with(lambda middle, way: sphere_mesh(12.0, middle - 30 * way, (0.8, 0.2, 0.6), subdivisions=2))


def mesh_through():
    """A bent sheet that cuts the box and stands out from it."""
    corners = np.array([(-20.0, -14.0, -5.0), (18.0, -16.0, 3.0), (20.0, 15.0, 6.0), (-19.0, 16.0, -3.0)])
    colors = [(0.2, 0.6, 1.0), (0.0, 1.0, 0.4), (1.0, 0.6, 0.0), (0.8, 0.8, 0.8)]
    return _with(lambda middle, _: Mesh(corners + middle, [(0, 1, 2), (0, 2, 3)], colors))


def lit():
    """Two lights and a material."""
    volume = field()
    lights = (Light.point((40, -10, 30), (1.0, 0.9, 0.8)), Light.point((-20, 30, 40), (0.2, 0.3, 0.5)))
    material = Material("phong", ambient=0.3, diffuse=0.6, specular=0.3, shininess=12.0)
    return scene(volume, towards(volume, (1.0, 0.7, 0.55)), lights=lights, material=material)


def lit_by_a_sun():
    """Light from one side and from everywhere on voxels of three lengths; no highlights."""
    volume = field((17, 20, 13), spacing=(0.7, 1.1, 1.9), direction=TURNED, origin=(3.0, -2.0, 5.0))
    lights = (Light.ambient((0.1, 0.15, 0.2)), Light.directional((-1.0, 0.4, -0.6), (1.0, 0.9, 0.8)))
    material = Material("lambert", ambient=0.1, diffuse=0.9)
    return scene(volume, towards(volume, (0.8, -0.9, 0.6)), lights=lights, material=material)


def lit_from_near():
    """A light that is weaker with distance, narrow highlights on both sides of surfaces."""
    volume = field((19, 23, 11), spacing=(1.0, 1.0, 2.0), border=True)
    near = Light.point((25.0, 30.0, 20.0), (3.0, 2.5, 2.0), attenuation=(1.0, 0.0, 0.004))
    lights = (near, Light.ambient((0.05, 0.05, 0.1)), Light.directional((0.0, 0.0, -1.0), (0.2, 0.3, 0.4)))
    material = Material("blinn-phong", ambient=0.1, diffuse=0.5, specular=0.6, shininess=9.0, two_sided=True)
    camera = towards(volume, (-0.6, 1.0, 0.8))
    return scene(volume, camera, transfer(0.4, 5.0), lights=lights, material=material)


def edges():
    """Opacity and colour of value and gradient magnitude."""
    volume = field((20, 22, 18))
    value, magnitude = np.meshgrid(np.arange(16) / 15, np.arange(8) / 7)
    colors = [value, magnitude, 1 - value, 0.6 * value * np.sqrt(magnitude)]
    look = TransferFunction2D(np.stack(colors, axis=-1), (0, 255), (0, 200), 2.0)
    return scene(volume, towards(volume, (0.7, 0.9, -0.4)), look, lights=(Light.ambient((0.9, 0.8, 0.7)),))


MESH = frozenset({"mesh"})
RADAR = frozenset({"radar"})

EXAMPLES = {
    "oblique": Example(oblique),
    "axis-aligned": Example(axis_aligned),
    "eleven slices": Example(eleven_slices),
    "turned": Example(turned),
    "dense": Example(dense),
    "thin": Example(thin),
    "full": Example(full),
    "inside": Example(inside),
    "parallel": Example(parallel, frozenset({"parallel"})),
    "mesh in front": Example(mesh_in_front, MESH),
    "mesh inside": Example(mesh_inside, MESH),
    "mesh behind": Example(mesh_behind, MESH),
    "mesh through": Example(mesh_through, MESH),
    "lit": Example(lit, frozenset({"lit"})),
    "lit by a sun": Example(lit_by_a_sun, frozenset({"lit"})),
    "lit from near": Example(lit_from_near, frozenset({"lit"})),
    "edges": Example(edges, frozenset({"lit", "gradients"})),
    "radar storm": Example(radar_scenes.storm, RADAR),
    "radar from above": Example(radar_scenes.from_above, RADAR),
    "radar near the pole": Example(radar_scenes.near_the_pole, RADAR),
    "radar horizon": Example(radar_scenes.around_the_horizon, RADAR),
    "radar uneven": Example(radar_scenes.uneven, RADAR),
    "radar inside": Example(radar_scenes.inside, RADAR),
    "radar parallel": Example(radar_scenes.parallel, RADAR | {"parallel"}),
}
