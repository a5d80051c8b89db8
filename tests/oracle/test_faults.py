"""Every fault of the table changes an image, as what it is called would."""

import dataclasses
import re
from functools import cache

import numpy as np
import pytest

import volref as vr
from tests.oracle import subjects
from tests.oracle.subjects import BASELINE, CEJ, CLAMPED, CONGOTE, LIT, subject
from volref.emulation.passes import emulate
from volref.errors import SceneError
from volref.golden.charts import CHARTS
from volref.oracle.explaining.drawing import canvas_at
from volref.oracle.faults.making import strengths_for
from volref.oracle.faults.separating import SEPARATING
from volref.oracle.faults.table import FAULTS, GROUPS

# Those of the table of real renderers' faults: atlas, geometry, opacity, ends of rays, jitter, table, filter,
# depth, colour, blending, normals, modes.
ROWS = [
    *("A1", "A2", "A3", "G1", "G2", "G3", "G4", "G5", "G6", "O1", "O2", "O3", "O4", "O5", "T1", "T2", "T3"),
    *("T4", "J1", "L1", "L2", "L3", "F1", "F2", "F3", "F4", "D1", "D2", "C1", "B1", "N1", "M1"),
]
COLORS = [(0.2, 0.4, 0.8), (0.8, 0.4, 0.2)]


@cache
def shown():
    return subjects.subjects()


@cache
def clean(name):
    return raw(shown()[name])


def raw(one):
    """Return what a subject draws before its canvas rounds."""
    return canvas_at(one, np.ones((one.scene.height, one.scene.width), np.bool_))


def with_fault(key, one, strength=1.0):
    """Return what a subject with a fault draws before its canvas rounds."""
    fault = FAULTS[key]
    assert fault.suits(one)
    return fault.after(raw(fault.changed(one, strength)), one, strength)


def test_every_row_of_the_table_has_faults():
    assert sorted({key.partition("-")[0] for key in FAULTS}) == sorted(ROWS)


def test_keys_are_a_row_and_words_and_come_once():
    keys = [fault.key for group in GROUPS for fault in group]
    assert len(keys) == len(set(keys)) == len(FAULTS)
    assert all(re.fullmatch(r"[A-Z]\d(-[a-z]+)+", key) for key in keys)


def test_every_row_names_a_chart_that_there_is_one_made_for_it_where_there_is_any():
    assert sorted(SEPARATING) == sorted(ROWS)
    made_for = {row for chart in CHARTS.values() for row in chart.separates}
    wrong = [row for row, name in SEPARATING.items() if row not in CHARTS[name].separates]
    assert made_for.isdisjoint(wrong)


@pytest.mark.parametrize("key", FAULTS)
def test_a_fault_changes_the_image_of_a_program_that_it_suits(key):
    for name, one in shown().items():
        for strength in strengths_for(FAULTS[key], one):
            if not np.allclose(with_fault(key, one, strength), clean(name), rtol=0, atol=1e-6):
                return
    pytest.fail(f"no subject shows {key}")


@pytest.mark.parametrize("key", FAULTS)
def test_a_fault_leaves_what_it_is_had_in_as_it_was(key):
    one = shown()["arbelaz" if FAULTS[key].suits(shown()["arbelaz"]) else "baseline"]
    before = one.scene.volume.values.copy(), one.pipeline
    for strength in strengths_for(FAULTS[key], one):
        FAULTS[key].changed(one, strength)
    assert np.array_equal(one.scene.volume.values, before[0])
    assert one.pipeline == before[1]


@pytest.mark.parametrize(
    ("name", "keys"),
    [
        ("congote2012-printed", ("O2-add-alpha", "A3-mix-by-x", "A1-printed-row", "A1-second-column")),
        ("barbagallo-article", ("O1-uncorrected", "O2-add-alpha", "L3-per-slice")),
        ("burkalo2022", ("O1-uncorrected", "O1-stale")),
        ("arbelaz2016-printed", ("D1-window-over-w", "D1-packing", "D2-squared-alpha", "B1-blended-twice")),
    ],
)
def test_a_fault_that_a_program_has_already_does_not_suit_it(name, keys):
    one = subject(vr.pipelines()[name], subjects.scene(mesh=name.startswith("arbelaz")))
    assert [key for key in keys if FAULTS[key].suits(one)] == []


def test_faults_of_atlases_meshes_and_lights_suit_programs_that_have_those():
    one = subject(BASELINE)
    found = {key[0] for key, fault in FAULTS.items() if fault.suits(one)}
    assert found == set("GOTJLFCBM")


@pytest.mark.parametrize("key", FAULTS)
def test_what_a_fault_suits_can_be_drawn_at_every_strength_that_it_suits_at(key):
    for one in shown().values():
        for strength in strengths_for(FAULTS[key], one):
            changed = FAULTS[key].changed(one, strength)
            try:
                canvas_at(changed, np.zeros((one.scene.height, one.scene.width), np.bool_))
            except SceneError as error:
                pytest.fail(str(error))


# What a fault draws, from somewhere else.


def test_voxels_read_a_whole_voxel_further_are_voxels_moved_by_one():
    # Nothing lies within two voxels of a face, where the texture repeats its border.
    values = np.pad(np.random.default_rng(5).integers(0, 255, (7, 6, 8)).astype(np.uint8), 2)
    one, other = (
        subject(BASELINE, dataclasses.replace(subjects.scene(), volume=vr.Volume(voxels)))
        for voxels in (values, np.roll(values, -1, axis=(0, 1, 2)))
    )
    assert np.allclose(with_fault("G1-half-voxel", one, 1.0), raw(other), rtol=0, atol=1e-5)


def test_bricks_that_are_of_one_value_each_have_sharp_borders():
    one = subject(BASELINE)
    blocks = np.kron(np.random.default_rng(4).integers(0, 255, (3, 3, 3)), np.ones((4, 4, 4)))
    scene = dataclasses.replace(one.scene, volume=vr.Volume(blocks.astype(np.uint8)))
    one = dataclasses.replace(one, scene=scene)
    expected = raw(
        dataclasses.replace(one, pipeline=one.pipeline.with_switches(volume={"filter": "nearest"}))
    )
    assert np.allclose(with_fault("G6-brick-seams", one, 4.0), expected, rtol=0, atol=1e-6)


def test_opacity_for_a_step_twice_as_long_is_that_of_half_the_unit_distance():
    one = subject(BASELINE)
    transfer = one.scene.transfer
    halved = vr.TransferFunction.from_opacity(
        transfer.values, transfer.colors, transfer.opacity, transfer.unit_distance / 2
    )
    expected = raw(dataclasses.replace(one, scene=dataclasses.replace(one.scene, transfer=halved)))
    assert np.allclose(with_fault("O1-stale", one, 2.0), expected, rtol=0, atol=1e-12)


def slab(opacity, pipeline=BASELINE, **switches):
    """Return a subject of one value, seen along z by parallel rays, three and a half steps deep."""
    volume = vr.Volume(np.full((7, 4, 4), 200, np.uint8), spacing=(1.0, 1.0, 0.75))
    transfer = vr.TransferFunction.from_opacity([0, 255], COLORS, [opacity] * 2, unit_distance=1.5)
    camera = vr.Camera.orthographic((1.4, 1.6, 9.0), (1.4, 1.6, 2.0), (0, 1, 0), 1.0, 1.0, 20.0)
    floats = pipeline.with_switches(table={"format": "exact"}, **switches)
    return subject(floats, vr.Scene(volume, transfer, camera, 2, 2))


@pytest.mark.parametrize(
    ("key", "steps"),
    [
        ("T2-first-step-dropped", 2.5),
        ("T2-last-step-dropped", 3.0),
        ("T2-last-step-whole", 4.0),
        ("T2-last-step-doubled", 4.0),
    ],
)
def test_ends_of_rays_count_as_many_steps_as_they_say(key, steps):
    found = with_fault(key, slab(0.3))[..., 3]
    assert np.allclose(found, 1 - 0.7**steps, rtol=0, atol=1e-6)


@pytest.mark.parametrize("key", ["M1-average", "M1-maximum"])
def test_the_mean_and_the_most_of_equal_samples_is_one_of_them(key):
    found = with_fault(key, slab(0.3, stepping={"last_step": "whole", "length": 5.25 / 3}))
    color = np.array(COLORS[0]) + (200 / 255) * (np.array(COLORS[1]) - COLORS[0])
    assert np.allclose(found[0, 0], [*(0.3 * color), 0.3], rtol=0, atol=5e-3)


def test_rays_that_are_stopped_and_filled_are_opaque_and_lack_colour():
    one = slab(0.6)
    early, filled = with_fault("T1-early-stop", one, 0.8), with_fault("T1-not-renormalised", one, 0.8)
    assert (early[..., 3] < 1).all()
    assert (filled[..., 3] == 1).all()
    assert np.array_equal(early[..., :3], filled[..., :3])


def test_opacity_that_hangs_on_the_ray_is_the_same_on_all_rays_through_one_value():
    plain = slab(0.3)
    oblique = vr.Camera.look_at((4.0, 3.0, 11.0), (1.5, 1.5, 2.0), (0, 1, 0), 14.0, 1.0, 30.0)
    scene = dataclasses.replace(plain.scene, camera=oblique, width=8, height=8)
    found = with_fault("O4-ray-length", dataclasses.replace(plain, scene=scene))[..., 3]
    side = np.mean([4.0, 4.0, 5.25])
    drawn = found[found > 0]
    assert len(drawn) > 40
    assert np.allclose(drawn, 1 - 0.7 ** (side / 1.5), rtol=0, atol=1e-5)


def test_normals_of_the_wrong_sign_are_lit_as_right_ones_from_behind():
    lambert = vr.Material("lambert", ambient=0.1, diffuse=0.9)
    light = np.array((0.4, -0.3, -1.0))
    scenes = [
        dataclasses.replace(subjects.scene(), lights=(vr.Light.directional(way * light),), material=lambert)
        for way in (1, -1)
    ]
    assert np.allclose(
        with_fault("N1-sign", subject(LIT, scenes[0])), raw(subject(LIT, scenes[1])), rtol=0, atol=1e-9
    )


def test_a_distance_along_the_view_is_shorter_by_the_cosine():
    one = subject(BASELINE, subjects.scene(mesh=True))
    drawn = [
        emulate(scene.scene, scene.pipeline).passes["mesh_distance"][..., 0].astype(np.float64)
        for scene in (one, FAULTS["D1-view-depth"].changed(one, 1.0))
    ]
    hit = drawn[0] < 1e29
    camera = one.scene.camera
    half = np.tan(np.radians(32.0) / 2)
    y, x = (np.indices(hit.shape) + 0.5) / [[[hit.shape[0]]], [[hit.shape[1]]]] * 2 - 1
    cosine = 1 / np.sqrt(1 + (half * y) ** 2 + (half * hit.shape[1] / hit.shape[0] * x) ** 2)
    assert not camera.is_parallel
    assert np.allclose(drawn[1][hit] / drawn[0][hit], cosine[hit], rtol=1e-5)


def test_a_fault_of_slices_shows_the_neighbour_of_each():
    one = subject(CLAMPED)
    found = FAULTS["A2-slice-off-by-one"].changed(one, 1.0).scene.volume.values
    values = one.scene.volume.values
    assert np.array_equal(found[:-1], values[1:])
    assert np.array_equal(found[-1], values[-1])


def test_beyond_the_last_slice_of_an_atlas_without_a_clamp_lies_an_empty_tile():
    found = FAULTS["A2-slice-off-by-one"].changed(subject(CONGOTE), 1.0).scene.volume.values
    assert (found[-1] == 20).all()  # the least of the table's domain


def test_start_offsets_keep_their_pattern_about_another_mean():
    one = subject(CEJ, subjects.scene(lit=True))
    found = FAULTS["J1-biased-jitter"].changed(one, 0.25).jitter
    assert np.allclose(found, one.jitter / 2, rtol=0, atol=1e-15)
    assert FAULTS["J1-wood-grain"].changed(one, 1.0).jitter is None


@pytest.mark.parametrize(("letter", "place"), [("x", 0), ("y", 1), ("z", 2)])
def test_a_volume_turned_round_has_its_first_voxel_at_the_other_end_of_that_axis(letter, place):
    one = subject(BASELINE)
    turned = FAULTS[f"G4-flip-{letter}"].changed(one, 1.0).scene.volume
    index = np.array([2, 3, 4])
    mirrored = index.copy()
    mirrored[place] = turned.size[place] - 1 - index[place]
    assert turned.values[tuple(mirrored[::-1])] == one.scene.volume.values[tuple(index[::-1])]


@pytest.mark.parametrize(("pair", "axes"), [(1.0, (0, 1)), (2.0, (1, 2)), (3.0, (0, 2))])
@pytest.mark.parametrize("centering", ["cell", "node"])
def test_exchanged_axes_leave_the_box_where_it_is(pair, axes, centering):
    plain = subjects.turned()
    volume = plain.volume
    placed = vr.Volume(volume.values, volume.spacing, (1, 2, 3), volume.direction, centering)
    one = subject(BASELINE, dataclasses.replace(plain, volume=placed))
    swapped = FAULTS["G4-swapped-axes"].changed(one, pair).scene.volume
    assert np.allclose(swapped.corners, placed.corners, rtol=0, atol=1e-9)
    assert swapped.size[axes[0]] == placed.size[axes[1]]
    assert swapped.size[axes[1]] == placed.size[axes[0]]
