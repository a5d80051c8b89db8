"""Seed 000 held to a scalar loop, pixel by pixel; what its printed formulas cost, by number."""

import numpy as np
import pytest

from tests.oracles.arbelaz import Pixel, Setting
from volref import Camera, Mesh, Scene, TransferFunction, Volume, emulate
from volref.emulation.catalogue import named
from volref.emulation.device import Device
from volref.emulation.opacity import factor_of
from volref.emulation.passes import prepare
from volref.emulation.uploads import uploads_of

WIDTH, HEIGHT, STEPS = 20, 15, 25
EXACT = Device.named("exact")
SPACING = (1.0, 1.5, 2.0)

# (corner, one edge, other edge, colour) in front of the box, in it, through it and behind it.
PLATES = {
    "none": [],
    "in front": [((2, 2, 19), (7, 1, 0), (0, 6, 0.5), (1.0, 0.5, 0.0))],
    "inside": [((2, 4, 5), (8, 1, 3), (0, 9, 1), (0.2, 0.9, 0.3))],
    "behind": [((-2, -3, -4), (12, 0, 1), (0, 12, 0), (0.1, 0.4, 1.0))],
    "through": [((-6, 3, -3), (24, 1, 4), (1, 2, 19), (0.9, 0.9, 0.9))],
}
CAMERA = ((9.0, 11.0, 38.0), (5.0, 7.0, 6.0), (0.1, 1.0, 0.0), 33.0, 4.0, 90.0)


def slices(size=(11, 10, 7)):
    nx, ny, nz = size
    z, y, x = np.meshgrid(*(np.arange(n) / n for n in (nz, ny, nx)), indexing="ij")
    waves = 0.5 + 0.3 * np.sin(9 * x + 4 * z) * np.cos(5 * y) + 0.2 * np.cos(8 * z * y)
    return np.rint(255 * waves).astype(np.uint8)


def plate_mesh(corner, one, other, color):
    corner, one, other = (np.array(part, float) for part in (corner, one, other))
    return Mesh([corner, corner + one, corner + one + other, corner + other], [(0, 1, 2), (0, 2, 3)], color)


def scene_of(plates, camera=CAMERA, **more):
    volume = Volume(slices(), spacing=SPACING)
    transfer = TransferFunction.from_opacity(
        [0, 100, 255], [(0.1, 0.2, 0.9), (0.9, 0.7, 0.2), (1, 1, 1)], [0.0, 0.3, 0.8], unit_distance=5.0
    )
    meshes = [plate_mesh(*plate) for plate in plates]
    return Scene(volume, transfer, Camera.look_at(*camera), WIDTH, HEIGHT, meshes, **more)


def setting_of(scene, plates, pipeline, camera=CAMERA):
    uploads = uploads_of(scene, pipeline)
    drawing = prepare(scene, pipeline, EXACT)
    low, high = scene.volume.corners.min(axis=0), scene.volume.corners.max(axis=0)
    return Setting(
        (slices() / 255).tolist(),
        tuple(low.tolist()),
        tuple(high.tolist()),
        (uploads.table[0] / 255).tolist(),
        plates,
        camera,
        WIDTH,
        HEIGHT,
        uploads.tiles[0],
        pipeline.stepping.steps,
        factor_of(scene, pipeline, drawing.box),
    )


@pytest.mark.parametrize("name", ["arbelaz2016", "arbelaz2016-printed"])
@pytest.mark.parametrize("where", PLATES)
def test_every_pixel_is_that_of_a_scalar_loop(where, name):
    scene = scene_of(PLATES[where])
    pipeline = named(name).with_switches(output={"format": "exact"}, stepping={"steps": STEPS})
    if name.endswith("printed"):
        pipeline = pipeline.with_switches(stepping={"cap": STEPS})
    found = emulate(scene, pipeline, EXACT)
    setting = setting_of(scene, PLATES[where], pipeline)
    hits = 0
    for y in range(HEIGHT):
        for x in range(WIDTH):
            color, samples, hit = Pixel(setting, x, y, name.endswith("printed")).drawn()
            assert found.samples[y, x] == samples
            # Some hundred float64 operations, and the uploaded table's k / 255.
            np.testing.assert_allclose(found.rgba[y, x], color, rtol=0, atol=1e-11)
            hits += hit
    assert (hits > 8) == (where in ("inside", "through"))
