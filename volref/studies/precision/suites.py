"""The suites: small scenes that ask different things of an integrator, as a table."""

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import gcd
from pathlib import Path

from volref.errors import SceneError
from volref.io.guard import nearest
from volref.io.scenes import load_scene
from volref.phantoms import transfer as tables
from volref.phantoms.fields import gaussian_blobs, shells
from volref.phantoms.meshes import torus_mesh
from volref.phantoms.specimens import vessel
from volref.phantoms.views import view_around
from volref.scene.scene import Scene
from volref.scene.transfer import TransferFunction
from volref.scene.volume import Volume

DEMO = Path(__file__).parents[2] / "demo_data" / "scene.json"

# A picture of about this many pixels takes a few minutes for all methods and settings.
PIXELS = 96 * 72
WIDTH, HEIGHT = 96, 72


@dataclass(frozen=True)
class Suite:
    """A scene to measure on: what it is called, what it asks, and how it is made at its own size."""

    name: str
    meaning: str
    make: Callable[[], Scene]


@dataclass(frozen=True, eq=False)
class Subject:
    """A scene with the name and the meaning under which it is reported."""

    name: str
    meaning: str
    scene: Scene


def smooth() -> Scene:
    """Return Gaussian blobs under a smooth curve in 256 entries."""
    volume = _blobs()
    return _seen(volume, tables.smooth_curve_256(*volume.value_bounds, extinction=0.3))


def few_kinks() -> Scene:
    """Return Gaussian blobs under a table of eight knots."""
    volume = _blobs()
    return _seen(volume, tables.few_knots(*volume.value_bounds, extinction=0.3))


def spiky() -> Scene:
    """Return Gaussian blobs under three spikes, the strongest of 1e4 per voxel."""
    volume = _blobs()
    return _seen(volume, tables.spiky(*volume.value_bounds))


def head() -> Scene:
    """Return the head of the demo with its white matter."""
    return resized(load_scene(DEMO))


def mesh_inside() -> Scene:
    """Return thin shells around and through an opaque ring."""
    volume = shells(48, period=14.0)
    table = tables.few_knots(*volume.value_bounds, extinction=0.1)
    ring = torus_mesh(13.0, 4.5, colors=(0.1, 0.4, 0.7), segments=96, sides=48)
    return dataclasses.replace(_seen(volume, table), meshes=(ring,))


def wide_angle() -> Scene:
    """Return a made-up CT of vessels from inside, with an opacity per 2 mm linear between knots."""
    volume = vessel((64, 48, 64), spacing=(2.0, 2.0, 3.0))
    table = TransferFunction.from_opacity(
        [-200.0, 100.0, 180.0, 300.0, 600.0],
        [(0.0, 0.0, 0.0), (0.6, 0.1, 0.1), (0.9, 0.3, 0.2), (1.0, 0.9, 0.8), (1.0, 1.0, 1.0)],
        [0.0, 0.0, 0.15, 0.3, 0.85],
        unit_distance=2.0,
    )
    camera = view_around(volume, fov_y=110.0, distance=24.0)
    return Scene(volume, table, camera, WIDTH, HEIGHT)


def _blobs() -> Volume:
    return gaussian_blobs(48, count=40)


def _seen(volume: Volume, table: TransferFunction) -> Scene:
    """Return the scene from so near that the volume fills the image's height."""
    return Scene(volume, table, view_around(volume, distance=80.0), WIDTH, HEIGHT)


SUITES = (
    Suite("smooth", "Gaussian blobs; a table that looks smooth and bends at each of its 256 entries", smooth),
    Suite("few-kinks", "Gaussian blobs; a table of eight knots, as people draw them", few_kinks),
    Suite("spiky", "Gaussian blobs; three spikes one and two entries wide, up to 1e4 per voxel", spiky),
    Suite("head", "a head MRI with its white matter as a mesh; a table of seven knots", head),
    Suite("mesh-inside", "thin shells with an opaque ring in them; a table of eight knots", mesh_inside),
    Suite(
        "wide-angle",
        "inside a noisy CT of vessels, 110 degrees; opacity linear between five knots, voxels 2 x 2 x 3 mm",
        wide_angle,
    ),
)


def chosen_suites(names: Sequence[str] | None = None) -> tuple[Suite, ...]:
    """Return the suites of these names, in the order of `SUITES`; None: all.

    Raises
    ------
    SceneError
        If a name is none of them.

    Examples
    --------
    >>> [suite.name for suite in chosen_suites(["spiky", "smooth"])]
    ['smooth', 'spiky']
    """
    known = [suite.name for suite in SUITES]
    for name in names or ():
        if name not in known:
            message = f"suite must be one of {', '.join(known)}, got {name!r}; {nearest(name, known)}"
            raise SceneError(message)
    return tuple(suite for suite in SUITES if names is None or suite.name in names)


def subject_of(suite: Suite, size: tuple[int, int] | None = None) -> Subject:
    """Return the scene of a suite, at its own size or at `size` (width, height)."""
    return Subject(suite.name, suite.meaning, resized(suite.make(), size))


def resized(scene: Scene, size: tuple[int, int] | None = None) -> Scene:
    """Return `scene` at `size` (width, height), or at the size of its aspect with at most `PIXELS` pixels.

    A scene whose aspect has no smaller whole numbers stays as it is.

    Examples
    --------
    >>> scene = dataclasses.replace(spiky(), width=1920, height=1080)
    >>> small = resized(scene)
    >>> small.width, small.height
    (96, 54)
    """
    if size is None:
        common = gcd(scene.width, scene.height)
        across, down = scene.width // common, scene.height // common
        times = min(int((PIXELS / (across * down)) ** 0.5), common)
        size = (times * across, times * down) if times else (scene.width, scene.height)
    return dataclasses.replace(scene, width=size[0], height=size[1])
