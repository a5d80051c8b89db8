"""Small images of demanding scenes, on which certified integrators are held against 30 digits.

The images are 24 x 24, so that a few random rays of each cost little; the volumes are of full size where
that matters.  `KINDS` names the groups; `certified_scenes` yields (name, scene) of all or some of them.
"""

from pathlib import Path

import numpy as np

import volref
from volref import Camera, Mesh, Scene, TransferFunction, Volume, load_scene, load_volume
from volref.phantoms import fields
from volref.phantoms import transfer as tables
from volref.phantoms.views import view_around

SIDE = 24
COLORS = [(0.2, 0.0, 1.0), (0.2, 0.4, 1.0), (1.0, 0.6, 0.1), (0.9, 0.9, 0.3), (0.1, 0.9, 0.3)]


def certified_scenes(*kinds):
    """Yield (name, scene) of the given `KINDS`, all by default; each scene is built when it is reached."""
    for kind in kinds or KINDS:
        for name, scene in KINDS[kind]():
            yield f"{kind}, {name}", scene


def smooth():
    volume = fields.gaussian_blobs(128)
    yield from _both("blobs", volume, tables.smooth())
    yield from _both("signal", fields.marschner_lobb(64), tables.two_colors(0.0, 1.0, 0.05))


def rough():
    """Independent voxels: cubics with two turning points in most cells."""
    yield from _both("float64", _noise((64, 64, 64)), tables.few_knots())
    yield from _both("uint8", _noise((24, 40, 32), np.uint8), tables.few_knots(0.0, 255.0, 0.5))
    spaced = _noise((20, 22, 24), spacing=(0.5, 1.0, 2.0), direction=_turn(0.4), centering="node")
    yield from _both("turned and uneven", spaced, tables.smooth(extinction=1.0, knots=9))


def few_kinks():
    volume = fields.gaussian_blobs(128, seed=2)
    yield from _both("blobs", volume, tables.few_knots())
    yield "blobs before a background", _scene(volume, tables.few_knots(), background=(0.2, 0.3, 0.1, 0.5))
    yield "blobs about a mesh", _scene(volume, tables.few_knots(), meshes=[_tetrahedron(volume)])


def every_knot():
    """A slope change at each of 256 entries."""
    yield from _both("blobs", fields.gaussian_blobs(128, seed=3), tables.smooth_curve_256())
    yield from _both("noise", _noise((12, 12, 12)), tables.smooth_curve_256(extinction=0.5))


def spiky():
    """Extinctions up to 1e4 per voxel, and opacities that reach 1 at a knot."""
    volume = fields.gaussian_blobs(128, seed=4)
    yield from _both("blobs", volume, tables.spiky())
    thin = _in_opacity(tables.spiky(), unit_distance=1e-4)
    yield "opacity of a ten-thousandth of a voxel", _scene(volume, thin)
    yield "one spike of 1e6", _scene(volume, tables.grey_ramp(0.3, 0.300001, 1e6))
    yield "noise", _scene(_noise((16, 16, 16)), tables.spiky())


def real_ct():
    with np.load("tests/data/ct_chest_lung1_256x256x48.npz") as archive:
        spacing = archive["spacing_zyx"][::-1]
        chest = Volume(archive["volume"][:, 64:192, 64:192].copy(), spacing=spacing)
    bones = TransferFunction(
        [-1000, -600, -400, 100, 300, 1500], [*COLORS, COLORS[0]], [0, 0, 0.01, 0, 0.05, 2.0]
    )
    yield from _both("chest", chest, bones)
    stent = load_volume("tests/data/ct_stent_128x128x256_u8.npz")
    # Whole numbers at the samples, and knots at whole numbers: cells that are constant on a knot.
    yield from _both("stent", stent, TransferFunction([2, 8, 12, 20, 32], COLORS, [0, 0.02, 0.0, 0.3, 1.0]))
    head = load_scene(Path(volref.__file__).parent / "demo_data" / "scene.json")
    yield (
        "head",
        Scene(head.volume, head.transfer, head.camera, SIDE, SIDE, head.meshes, background=head.background),
    )


def degenerate():
    """Rays along planes, edges and diagonals of the lattice, jumps on samples, extremes of every number."""
    noise = _noise((5, 6, 7))
    ramp = TransferFunction([0.0, 0.3, 0.6, 1.0], COLORS[:4], [0.0, 0.4, 0.1, 2.0])
    yield from _lattice_views(noise, ramp)
    yield from _inside(noise, ramp)
    yield from _jumps()
    yield from _opaque()
    yield from _extremes(ramp)


KINDS = {kind.__name__: kind for kind in (smooth, rough, few_kinks, every_knot, spiky, real_ct, degenerate)}


def _lattice_views(volume, table):
    """Parallel rays whose pixels fall on lattice planes; every other one lies on them, or in a face."""
    for name, centering in (("cell", "cell"), ("node", "node")):
        box = _noise((7, 7, 7), centering=centering)
        middle, high = np.full(3, 3.0), 12.0  # 24 pixels of half a voxel: centres at multiples of 1/4
        shifted = middle + np.array([0.25, 0.25, 0.0])  # ... and now on lattice planes
        for axis, eye in (("along z", (0, 0, 20)), ("along -z", (0, 0, -20))):
            camera = Camera.orthographic(shifted + eye, shifted, (0, 1, 0), high, 0.0, 40.0)
            yield f"{axis}, {name}", _scene(box, table, camera=camera)
        tilted = Camera.orthographic(shifted + np.array([0, 7, 20]), shifted, (1, 0, 0), high, 0.0, 60.0)
        yield f"in planes of x, {name}", _scene(box, table, camera=tilted)
    diagonal = Camera.orthographic((-7.0, -7.0, -7.0), (3.0, 3.0, 3.0), (0, 0, 1), 6.0, 0.0, 40.0)
    yield "along the diagonal", Scene(volume, table, diagonal, 1, 1)
    nearly = Camera.orthographic((3.0, 2.5, 20.0), (3.0 + 1e-12, 2.5, 2.0), (0, 1, 0), 6.0, 0.0, 40.0)
    yield "slope 1e-13", _scene(volume, table, camera=nearly)


def _inside(volume, table):
    for name, eye in (
        ("in a cell", (2.2, 2.7, 1.9)),
        ("on a voxel", (2.0, 3.0, 2.0)),
        ("on a face", (-0.5, 2.0, 2.0)),
    ):
        camera = Camera.look_at(eye, (4.0, 3.1, 2.2), (0, 0, 1), 80.0, 1e-3, 40.0)
        yield f"camera {name}", _scene(volume, table, camera=camera)
    wide = Camera.look_at((3.0, 2.5, 2.0), (6.0, 2.5, 2.0), (0, 0, 1), 170.0, 1e-3, 40.0)
    yield "camera inside, wide", _scene(volume, table, camera=wide)


def _jumps():
    shells = tables.steps([0.2, 0.5, 0.8], COLORS[:3], [0.3, 2.0, 0.0])
    yield "jumps in noise", _scene(_noise((9, 8, 7)), shells)
    yield (
        "jumps in a ball",
        _scene(fields.squared_distance(16), tables.steps([9.0, 36.0, 49.0], COLORS[:3], [2.0, 0.1, 0.6])),
    )
    levels = np.random.default_rng(5).integers(0, 4, (8, 9, 10)).astype(np.uint8)
    at_levels = tables.steps([1, 2, 3], COLORS[:3], [0.5, 0.0, 1.5])
    yield "jumps at the samples' levels", _scene(Volume(levels), at_levels)
    flat = Volume(np.full((4, 4, 4), 0.5))
    yield "a constant field on a jump", _scene(flat, tables.steps([0.5, 0.7], COLORS[:2], [0.1, 0.4]))
    yield "a constant field on a knot", _scene(flat, TransferFunction([0, 0.5, 1], COLORS[:3], [0, 0.7, 0]))
    jumpy = TransferFunction([0, 0.4, 0.4, 0.9], COLORS[:4], opacity=[0.0, 0.9, 0.1, 0.6])
    yield "jumps in opacity", _scene(_noise((9, 8, 7)), jumpy)


def _opaque():
    noise = _noise((9, 8, 7))
    behind = {"background": (0.1, 0.2, 0.3, 0.4)}
    at_a_knot = TransferFunction([0, 0.7, 0.8, 1], COLORS[:4], opacity=[0.0, 0.2, 1.0, 0.1])
    yield "opacity 1 at a knot", _scene(noise, at_a_knot, **behind)
    interval = TransferFunction([0, 0.7, 0.8, 0.9, 1], COLORS, opacity=[0.0, 0.1, 1.0, 1.0, 0.1])
    yield "opacity 1 over an interval", _scene(noise, interval, **behind)
    wall = TransferFunction([0.85, 0.85], COLORS[:2], opacity=[0.1, 1.0])
    yield "opacity 1 behind a jump", _scene(noise, wall, **behind)
    yield (
        "opacity 1 everywhere",
        _scene(noise, TransferFunction([0, 1], COLORS[:2], opacity=[1, 1]), **behind),
    )


def _extremes(table):
    random = np.random.default_rng(6).random((5, 6, 7))
    yield "one voxel", _scene(Volume(random[:1, :1, :1]), table)
    yield "one voxel thick", _scene(Volume(random[:, :1, :]), table)
    slanted = Camera.orthographic((0.0, 2.5, -1e5), (6.0, 2.5, 5e6), (0, 1, 0), 6.0, 0.0, 1e7)
    stretched = Volume(random, spacing=(1, 1, 1e6))
    yield "spacing 1 : 1 : 1e6", _scene(stretched, _scaled(table, 1e-6), camera=slanted)
    yield "far from the origin", _scene(Volume(random, origin=(1e7, -1e7, 1e7)), table)
    yield "a billionth wide", _scene(Volume(random, spacing=(1e-9,) * 3), _scaled(table, 1e9))
    yield "huge values", _scene(Volume(random * 1e300), _stretched(table, 1e300))
    yield "tiny values", _scene(Volume(random * 1e-300), _stretched(table, 1e-300))
    yield "extinctions of 1e-310", _scene(Volume(random), _scaled(table, 1e-310))
    yield "extinctions of 1e300", _scene(Volume(random), _scaled(table, 1e300))
    yield (
        "opacities of 1e-17",
        _scene(Volume(random), TransferFunction([0, 1], COLORS[:2], opacity=[0, 1e-17])),
    )
    bright = TransferFunction(table.values, table.colors * 1e6, table.extinction)
    yield "colours of 1e6", _scene(Volume(random), bright)
    close = TransferFunction([0.5, np.nextafter(0.5, 1), 1], COLORS[:3], [0.1, 3.0, 0.2])
    yield "knots one ulp apart", _scene(Volume(random), close)
    corner = (
        np.array(random, dtype=np.uint32)
        + np.array([0, 2**32 - 1], np.uint32)[np.indices((5, 6, 7)).sum(0) % 2]
    )
    yield "uint32, least beside greatest", _scene(Volume(corner), _stretched(table, 2.0**32))


def _scene(volume, table, camera=None, **more):
    return Scene(volume, table, camera or _view(volume), SIDE, SIDE, **more)


def _view(volume):
    """A view of the middle of the volume: half of the rays that just meet its corners would see nothing."""
    extent = volume.corners.max(axis=0) - volume.corners.min(axis=0)
    return view_around(volume, fov_y=18.0, distance=1.9 * float(np.linalg.norm(extent)))


def _both(name, volume, table):
    """The scene with the extinction linear between the knots, then with the opacity of a voxel."""
    yield f"{name}, extinction", _scene(volume, table)
    voxel = float(min(volume.spacing))
    yield f"{name}, opacity", _scene(volume, _in_opacity(table, voxel))


def _in_opacity(table, unit_distance):
    opacity = -np.expm1(-table.extinction * unit_distance)
    return TransferFunction(table.values, table.colors, opacity=opacity, unit_distance=unit_distance)


def _scaled(table, factor):
    return TransferFunction(table.values, table.colors, table.extinction * factor)


def _stretched(table, factor):
    return TransferFunction(table.values * factor, table.colors, table.extinction)


def _noise(shape, dtype=np.float64, **place):
    values = np.random.default_rng(sum(shape)).random(shape)
    if np.dtype(dtype).kind == "u":
        values *= np.iinfo(dtype).max
    return Volume(values.astype(dtype), **place)


def _turn(angle):
    """A rotation about an axis that is no axis of the grid."""
    axis = np.array([1.0, 2.0, 2.0]) / 3
    cross = np.cross(np.eye(3), axis)
    return np.cos(angle) * np.eye(3) - np.sin(angle) * cross + (1 - np.cos(angle)) * np.outer(axis, axis)


def _tetrahedron(volume):
    """A closed surface in the middle of the volume."""
    low, high = volume.corners.min(axis=0), volume.corners.max(axis=0)
    corners = (
        np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]) * (high - low) / 6 + (low + high) / 2
    )
    return Mesh(corners, [(0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2)], colors=COLORS[:4], coloring="vertex")
