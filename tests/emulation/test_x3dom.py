"""x3dom's VolumeData held to a scalar program and to closed forms; what its decisions cost, by number."""

import dataclasses
import math

import numpy as np
import pytest

from tests.oracles import x3dom_program as oracle
from volref import Camera, Scene, TransferFunction, Volume, emulate
from volref.emulation.catalogue import named
from volref.emulation.device import Device
from volref.emulation.drawing import prepare
from volref.emulation.loop.opacity import factor_of
from volref.emulation.textures.uploads import uploads_of

WIDTH, HEIGHT = 24, 18
OUTSIDE = ((26.0, -17.0, 22.0), (5.0, 6.0, 6.0), (0.1, 0.2, 1.0), 40.0)
WITHIN = ((6.0, 7.0, 5.0), (2.0, 3.0, 9.0), (0.1, 0.2, 1.0), 75.0)
X3DOM = named("x3dom")
FLOATS = X3DOM.with_switches(output={"format": "float"})
OLDER = {"tile_row": "rows"}


def waves(size=(11, 13, 9)):
    nx, ny, nz = size
    z, y, x = np.meshgrid(*(np.arange(n) / n for n in (nz, ny, nx)), indexing="ij")
    return np.rint(255 * (0.5 + 0.3 * np.sin(9 * x + 4 * z) * np.cos(5 * y) + 0.2 * np.cos(8 * z * y)))


def scene_of(look=OUTSIDE, opacity=0.6, slices=11, **more):
    """Three different sides, values up to the faces; 11 slices lie in 4 x 3 tiles, of which one is empty."""
    volume = Volume(waves((11, 13, slices)).astype(np.uint8), spacing=(1.0, 0.8, 1.4), origin=(0.5, 1.0, 1.5))
    colors = [(0.1, 0.2, 0.9), (0.1, 0.9, 1.0), (1.0, 0.3, 0.1)]
    transfer = TransferFunction.from_opacity([0, 120, 255], colors, [0.0, opacity / 4, opacity], 3.0)
    camera = Camera.look_at(*look, near=0.1, far=80.0)
    return Scene(volume, transfer, camera, WIDTH, HEIGHT, **more)


def slab(value=255, opacity=0.5, eye=(0.5, 0.5, 3.0), target=(0.5, 0.5, 0.5), **more):
    """One pixel of the unit cube, its volume of one value, its colour white."""
    volume = Volume(np.full((4, 4, 4), value, np.uint8), spacing=(1 / 4,) * 3, origin=(1 / 8,) * 3)
    transfer = TransferFunction.from_opacity([0, 255], [(1.0, 1.0, 1.0)] * 2, [opacity] * 2)
    camera = Camera.look_at(eye, target, (0, 1, 0.01), 10.0, 0.1, 10.0)
    return Scene(volume, transfer, camera, 1, 1, **more)


@pytest.mark.parametrize(
    ("look", "opacity", "older"),
    [(OUTSIDE, 0.6, False), (OUTSIDE, 1.0, True), (WITHIN, 0.3, False), (WITHIN, 0.9, True)],
)
def test_pixels_are_those_of_a_scalar_program(look, opacity, older):
    scene = scene_of(look, opacity, background=(0.1, 0.2, 0.3, 0.2))
    pipeline = FLOATS.with_switches(volume=OLDER) if older else FLOATS
    found = emulate(scene, pipeline)
    uploads, box = uploads_of(scene, pipeline), prepare(scene, pipeline, Device()).box
    atlas, table = uploads.volume[..., 0], uploads.table
    walk = {"factor": factor_of(scene, pipeline, box), "older": older}
    drawn = 0
    for y in range(0, HEIGHT, 2):
        for x in range(1, WIDTH, 3):
            ends = oracle.place_and_eye(scene.volume, look, x, y, WIDTH, HEIGHT)
            expected, count = scene.background, 0
            if ends is not None:
                taken = oracle.positions(*ends)
                color, alpha, count = oracle.walked(atlas, table, taken, uploads.tiles, 11, **walk)
                expected = oracle.blended(color, alpha, scene.background)
            # Positions are summed up in float32 on both sides, from entries that are a digit apart: 1e-6 of a
            # box, in which an older version's tiles jump by a whole colour over half a texel.
            np.testing.assert_allclose(found.rgba[y, x], expected, rtol=0, atol=2e-5)
            assert found.samples[y, x] == count
            drawn += count > 0
    assert drawn > 15


def test_a_slab_ends_after_as_many_steps_as_fit_and_one():
    # 1 / (1.4142 / 85) is 60.1: the sample at 60 steps is still inside, the next is not.
    assert emulate(slab(), FLOATS).samples.item() == 61


def test_rays_longer_than_a_faces_diagonal_are_cut_short():
    # Along the body's diagonal, 1.7321: the loop ends after 85 steps, 1.4142.
    eye = tuple(0.5 + 2.5 * c for c in (0.58, 0.57, 0.575))
    found = emulate(slab(eye=eye), FLOATS)
    assert found.samples.item() == 85
    whole = emulate(slab(eye=eye), FLOATS.with_switches(stepping={"cap": 200}))
    assert whole.samples.item() == 104
    assert pytest.approx(1 - 1.4142 / math.sqrt(3), abs=0.01) == 1 - 85 / 105


def test_colour_is_brighter_than_its_alpha_and_counted_twice_by_the_blend():
    scene = slab(opacity=0.5)
    pipeline = FLOATS.with_switches(opacity={"factor": 1.0})
    rgba = emulate(scene, pipeline).rgba[0, 0]
    alpha = 1 - (1 - 128 / 255 / 85) ** 61
    np.testing.assert_allclose(rgba, [1.2 * alpha * alpha] * 3 + [alpha], rtol=1e-6)


def test_alphas_of_an_opaque_canvas_add_up_to_one_for_bytes_and_to_more_for_floats():
    scene = slab(opacity=0.5, background=(0.0, 0.0, 0.0, 1.0))
    assert emulate(scene, X3DOM).rgba[0, 0, 3] == 1
    assert emulate(scene, FLOATS).rgba[0, 0, 3] > 1.3


def test_the_last_slice_fades_to_the_empty_tile_behind_it():
    # 11 slices in 12 tiles: at z = 1 - 1 / 22 half of what is there is missing; 12 slices: the last again.
    scene = scene_of()
    at = np.array([0.4, 0.6, 1 - 1 / 22], np.float32)
    atlas = uploads_of(scene, FLOATS).volume[..., 0]
    found = oracle.value(atlas, at, (4, 3), 11)
    last = oracle.value(atlas, np.array([0.4, 0.6, 10 / 11 + 1e-6], np.float32), (4, 3), 11)
    assert found / last == pytest.approx(0.5, abs=1e-3)
    clamped = FLOATS.with_switches(volume={"second_slice": "clamped"})
    from_above = dataclasses.replace(
        scene, camera=Camera.look_at((5, 5, 40), (5, 5, 5), (0, 1, 0), 20.0, 1.0, 80.0)
    )
    change = emulate(from_above, clamped).rgba - emulate(from_above, FLOATS).rgba
    assert np.abs(change).max() > 0.01


def test_older_versions_find_other_slices_in_an_atlas_that_is_not_square():
    # 4 across, 3 down: slice 3 is looked for in the second row, in tile 7.
    row = [math.floor(s / 3) for s in range(11)]
    column = [s % 4 for s in range(11)]
    found = [4 * r + c for r, c in zip(row, column, strict=True)]
    assert found == [0, 1, 2, 7, 4, 5, 10, 11, 8, 13, 14]
    assert sum(a != b for a, b in enumerate(found)) == 5
    numbered = Volume(np.repeat(np.arange(11, dtype=np.uint8) * 20, 16).reshape(11, 4, 4))
    scene = dataclasses.replace(scene_of(), volume=numbered)
    scene = dataclasses.replace(
        scene, transfer=TransferFunction.from_opacity([0, 255], [(1, 1, 1)] * 2, [1, 1])
    )
    atlas = uploads_of(scene, FLOATS).volume[..., 0]
    middle = [np.array([0.5, 0.5, s / 11 + 1e-6], np.float32) for s in range(11)]
    right = [round(255 * oracle.value(atlas, at, (4, 3), 11)) for at in middle]
    older = [round(255 * oracle.value(atlas, at, (4, 3), 11, older=True)) for at in middle]
    assert right == [20 * s for s in range(11)]
    # Tile 11 is empty, and what lies below the last row is the last row's edge.
    assert older == [0, 20, 40, 140, 80, 100, 200, 0, 160, 180, 200]


def test_a_square_atlas_is_the_same_to_older_versions():
    scene = scene_of(slices=9)
    np.testing.assert_array_equal(
        emulate(scene, FLOATS).rgba, emulate(scene, FLOATS.with_switches(volume=OLDER)).rgba
    )


def test_an_atlas_that_is_not_square_is_another_volume_to_older_versions():
    scene = scene_of()
    one, other = emulate(scene, FLOATS).rgba, emulate(scene, FLOATS.with_switches(volume=OLDER)).rgba
    drawn = one[..., 3] > 0
    changed = (np.abs(one - other)[drawn] > 1 / 255).any(axis=-1)
    assert changed.mean() == pytest.approx(0.80, abs=0.01)


def test_from_within_rays_start_at_the_eye_and_from_a_face_at_the_face():
    inside = emulate(slab(eye=(0.5, 0.5, 0.75), target=(0.5, 0.5, 0.0)), FLOATS)
    # 0.75 / (1.4142 / 85) is 45.08.
    assert inside.samples.item() == 46
    behind = emulate(slab(eye=(0.5, 0.5, 0.75), target=(0.5, 0.5, 2.0)), FLOATS)
    assert behind.samples.item() == 16


def test_steps_are_equal_in_texture_space_and_so_opacity_depends_on_the_side_that_is_crossed():
    long = Volume(np.full((4, 4, 4), 255, np.uint8), spacing=(1.0, 1.0, 4.0), origin=(0, 0, 0))
    transfer = TransferFunction.from_opacity([0, 255], [(1, 1, 1)] * 2, [0.05] * 2, 4.0)
    alphas = []
    for eye in ((1.5, 1.5, 60.0), (40.0, 1.5, 6.0)):
        camera = Camera.look_at(eye, (1.5, 1.5, 6.0), (0, 1, 0), 4.0, 0.1, 100.0)
        alphas.append(emulate(Scene(long, transfer, camera, 1, 1), FLOATS).rgba[0, 0, 3])
    # 16 or 4 long: the same 61 steps, the same alpha.
    assert alphas[0] == pytest.approx(alphas[1], rel=1e-6)
