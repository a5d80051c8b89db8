"""Scenes of recipes by name: a specimen, how it is looked at, and what stands beside it.

Volumes are bytes or whole numbers.  What `exp` makes of a field in the last digit is then rounded away, and
the scene is the same on every machine.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import Floats
from volref.emulation.textures.radar_image import reach
from volref.errors import SceneError
from volref.io.guard import nearest
from volref.phantoms.fields import gaussian_blobs, marschner_lobb, shells
from volref.phantoms.meshes import box_mesh, sphere_mesh
from volref.phantoms.specimens import filaments, vessel
from volref.phantoms.storms import make_storm, radar_of_scan, sample_cartesian, sample_polar
from volref.scene import Camera, Light, Material, Mesh, RadarVolume, Scene, TransferFunction, Volume

WIDTH, HEIGHT = 64, 48

Choice = TypeVar("Choice")

# Oblique to every axis: no ray is parallel to a face.
VIEW = (1.0, 0.7, 0.55)


@dataclass(frozen=True)
class Specimen:
    """What is looked at: how the volume is made, values, colours and opacities of its table."""

    make: Callable[[], Volume | RadarVolume]
    values: tuple[float, ...]
    opacity: tuple[float, ...]
    unit_distance: float

    def transfer(self, opacity: float) -> TransferFunction:
        """Return the table, its opacities times a factor."""
        places = np.linspace(0, 1, len(self.values))
        colors = np.stack([np.interp(places, RAMP_AT, channel) for channel in RAMP], axis=-1)
        opacities = np.minimum(np.array(self.opacity) * opacity, 1.0)
        return TransferFunction.from_opacity(self.values, colors, opacities, self.unit_distance)


# From blue over cyan and yellow to red: every value has a colour of its own.
RAMP_AT = (0.0, 0.35, 0.7, 1.0)
RAMP = ((0.1, 0.1, 0.9, 1.0), (0.2, 0.6, 0.7, 0.3), (0.9, 1.0, 0.2, 0.1))


def scene_of(
    specimen: str,
    *,
    view: ArrayLike = VIEW,
    distance: float = 1.6,
    fov_y: float = 29.0,
    parallel: bool = False,
    opacity: float = 1.0,
    mesh: str | None = None,
    light: str | None = None,
    background: ArrayLike = (0.0, 0.0, 0.0, 0.0),
) -> Scene:
    """Return a small scene.

    Parameters
    ----------
    specimen
        A name in `SPECIMENS`.
    view, distance, fov_y, parallel
        Direction from the middle to the eye, how many diagonals away it is, opening in degrees.
    opacity
        A factor of the table's.
    mesh
        "inside", "front", "behind" or "through": an opaque mesh, and where.
    light
        "sun" or "lamps": lights and a material.

    Raises
    ------
    SceneError
        If a name is not known.

    Examples
    --------
    >>> scene = scene_of("blobs", mesh="inside")
    >>> scene.volume.size, scene.width, len(scene.meshes)
    ((22, 20, 17), 64, 1)
    """
    found = _one_of("scene.specimen", SPECIMENS, specimen)
    volume = found.make()
    camera, middle, diagonal = _camera(volume, view, distance, fov_y, parallel=parallel)
    more: dict[str, Any] = {}
    if light is not None:
        lights, material = _one_of("scene.light", LIGHTS, light)(middle, diagonal)
        more = {"lights": lights, "material": material}
    if mesh is not None:
        way = np.array(view) / np.linalg.norm(view)
        more["meshes"] = (_one_of("scene.mesh", MESHES, mesh)(middle, way, diagonal),)
    transfer = found.transfer(opacity)
    return Scene(volume, transfer, camera, WIDTH, HEIGHT, background=background, **more)


def _camera(
    volume: Volume | RadarVolume, view: ArrayLike, distance: float, fov_y: float, *, parallel: bool
) -> tuple[Camera, Floats, float]:
    """Return a camera, the middle of the volume and its diagonal."""
    middle, diagonal = _extent(volume)
    way = np.array(view, np.float64) / np.linalg.norm(view)
    # Straight at the middle, coordinates of textures would be simple fractions, which hang on a comparison.
    target = middle + 0.013 * diagonal
    eye = target + way * distance * diagonal
    up = (0.1, 1.0, 0.2) if abs(way[2]) > 0.9 else (0.1, 0.2, 1.0)
    near, far = 0.05 * diagonal, 4.0 * diagonal
    if parallel:
        return Camera.orthographic(eye, target, up, 0.9 * diagonal, near, far), middle, diagonal
    return Camera.look_at(eye, target, up, fov_y, near, far), middle, diagonal


def _extent(volume: Volume | RadarVolume) -> tuple[Floats, float]:
    """Return the middle and the diagonal of a volume; of a radar, whose sky is flat, the ground's side."""
    if isinstance(volume, RadarVolume):
        return np.array(volume.origin), 2 * reach(volume)
    low, high = volume.corners.min(axis=0), volume.corners.max(axis=0)
    return (low + high) / 2, float(np.linalg.norm(high - low))


def _bytes(volume: Volume) -> Volume:
    """Return a volume of 0..1 as bytes."""
    values = np.rint(255 * np.clip(volume.values, 0, 1)).astype(np.uint8)
    return Volume(values, volume.spacing, volume.origin, volume.direction, volume.centering)


def _turned() -> Volume:
    """Return voxels of three lengths in a volume that is turned and moved."""
    blobs = _bytes(gaussian_blobs((17, 20, 13)))
    turn = np.linalg.qr(np.array([[2.0, -1.0, 0.5], [1.0, 2.0, 0.3], [-0.4, 0.2, 2.0]]))[0]
    return Volume(blobs.values, (0.7, 1.1, 1.9), (3.0, -2.0, 5.0), turn)


def _storm() -> Volume:
    """Return a storm on a box, in half dBZ, its height stretched to be seen."""
    box = sample_cartesian(make_storm(), size=(28, 28, 14), ceiling=16_000.0)
    values = np.rint(2 * box.values).astype(np.int16)
    return Volume(values, (*box.spacing[:2], 5 * box.spacing[2]))


def _radar() -> RadarVolume:
    scan = sample_polar(make_storm(), azimuths=60, gates=50, gate_length=2000.0)
    rounded = np.rint(2 * scan.dbz) / 2
    return radar_of_scan(type(scan)(scan.elevation_deg, scan.azimuth_deg, scan.range_m, rounded, scan.time_s))


SPECIMENS: dict[str, Specimen] = {
    "blobs": Specimen(
        lambda: _bytes(gaussian_blobs((22, 20, 17))), (0, 60, 150, 255), (0, 0.1, 0.5, 0.8), 4.0
    ),
    "turned": Specimen(_turned, (0, 60, 150, 255), (0, 0.1, 0.5, 0.8), 4.0),
    "waves": Specimen(
        lambda: _bytes(marschner_lobb((20, 20, 18), centering="cell")),
        (0, 90, 120, 160, 255),
        (0.02, 0.05, 0.5, 0.1, 0.4),
        4.0,
    ),
    "shells": Specimen(
        lambda: _bytes(shells((24, 22, 20), centering="cell")), (0, 120, 200, 255), (0, 0.02, 0.4, 0.8), 3.0
    ),
    "artery": Specimen(
        lambda: vessel((24, 18, 36), spacing=5.3), (-200, 40, 200, 400, 1100), (0, 0.02, 0.3, 0.7, 0.9), 12.0
    ),
    "filaments": Specimen(
        lambda: filaments((32, 32, 14)), (100, 250, 600, 2500), (0, 0.15, 0.6, 0.9), 2.0
    ),
    "storm": Specimen(_storm, (-64, 20, 60, 120), (0, 0.1, 0.5, 0.9), 12_000.0),
    "radar": Specimen(_radar, (-32, 0, 25, 55, 95.5), (0, 0.1, 0.4, 1, 1), 12_000.0),
}  # fmt: skip

MeshAt = Callable[[Floats, Floats, float], Mesh]


def _sheet(middle: Floats, _: Floats, diagonal: float) -> Mesh:
    """Return a bent sheet that cuts the box and stands out from it."""
    corners = np.array([(-20.0, -14, -5), (18, -16, 3), (20, 15, 6), (-19, 16, -3)]) * diagonal / 36
    colors = [(0.2, 0.6, 1.0), (0.0, 1.0, 0.4), (1.0, 0.6, 0.0), (0.8, 0.8, 0.8)]
    return Mesh(corners + middle, [(0, 1, 2), (0, 2, 3)], colors)


MESHES: dict[str, MeshAt] = {
    "inside": lambda m, _, d: box_mesh((0.2 * d, 0.17 * d, 0.14 * d), m, (1.0, 0.8, 0.2)),
    "front": lambda m, w, d: sphere_mesh(0.06 * d, m + (0.7 * w + 0.1) * d, (0.2, 0.8, 0.4), subdivisions=1),
    "behind": lambda m, w, d: sphere_mesh(0.3 * d, m - 0.9 * d * w, (0.8, 0.2, 0.6), subdivisions=2),
    "through": _sheet,
}

Lighting = tuple[tuple[Light, ...], Material]


def _sun(_: Floats, __: float) -> Lighting:
    lights = (Light.ambient((0.1, 0.15, 0.2)), Light.directional((-1.0, 0.4, -0.6), (1.0, 0.9, 0.8)))
    return lights, Material("lambert", ambient=0.1, diffuse=0.9)


def _lamps(middle: Floats, diagonal: float) -> Lighting:
    warm = Light.point(middle + np.array([1.0, -0.4, 0.8]) * diagonal, (1.0, 0.9, 0.8))
    cold = Light.point(middle + np.array([-0.6, 0.8, 1.0]) * diagonal, (0.2, 0.3, 0.5))
    return (warm, cold), Material("phong", ambient=0.3, diffuse=0.6, specular=0.3, shininess=12.0)


LIGHTS: dict[str, Callable[[Floats, float], Lighting]] = {"sun": _sun, "lamps": _lamps}


def _one_of(name: str, choices: Mapping[str, Choice], got: str) -> Choice:
    if got in choices:
        return choices[got]
    message = f"{name} must be one of {', '.join(choices)}, got {got!r}; {nearest(got, choices)}"
    raise SceneError(message)
