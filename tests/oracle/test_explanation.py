"""`explain` names faults, alone and in pairs, says when it cannot, and says "none" of correct images."""

import dataclasses
import json

import numpy as np
import pytest

import volref as vr
from tests.oracle.subjects import (
    ARBELAZ,
    BACKGROUND,
    BASELINE,
    BURKALO,
    CEJ,
    CLAMPED,
    CONGOTE,
    HEIGHT,
    PAGE,
    WIDTH,
    scene,
    subject,
)
from volref.emulation.passes import emulate
from volref.errors import SceneError
from volref.oracle.explaining.drawing import canvas_at
from volref.oracle.explaining.findings import Finding, Part, ranked
from volref.oracle.faults.table import FAULTS

MACHINE = "llvmpipe"

# Fault, its strength, the program, more of the scene; each is named first among all.
CASES = [
    ("A1-row-divisor", 1.0, CONGOTE, {}),
    ("A3-half-slice", 1.0, CLAMPED, {}),
    ("G1-half-voxel", 0.5, BASELINE, {}),
    ("G4-flip-y", 1.0, BASELINE, {}),
    ("G6-brick-seams", 4.0, BASELINE, {}),
    ("O1-uncorrected", 1.0, BASELINE, {}),
    ("T1-early-stop", 0.8, BASELINE, {}),
    ("T3-loop-cap", 0.5, BASELINE, {}),
    ("L2-short-table", 16.0, BASELINE, {}),
    ("F1-nearest", 1.0, BASELINE, {}),
    ("D1-range", 0.9, BASELINE, {"mesh": True}),
    ("C1-wrong-space", 1.0, BURKALO, {"background": (0.3, 0.3, 0.2, 1.0)}),
    ("B1-blended-twice", 1.0, BASELINE, {"background": BACKGROUND}),
]

# The seeds' own bugs: program, the switches as printed, and what they are called.
SEEDS = [
    (CONGOTE, {"accumulation": {"rule": "add-alpha"}}, "O2-add-alpha"),
    (CONGOTE, {"volume": {"between": "x"}}, "A3-mix-by-x"),
    (PAGE, {"accumulation": {"rule": "add-alpha"}}, "O2-add-alpha"),
    (ARBELAZ, {"output": {"blend": "straight"}}, "B1-blended-twice"),
    (ARBELAZ, {"meshes": {"composition": "printed"}}, "D2-squared-alpha"),
    (ARBELAZ, {"meshes": {"packing": "printed"}}, "D1-packing"),
    (CEJ, {"lighting": {"gradient": "sobel-bytes-printed"}}, "N1-kernel"),
]

# Their programs are slow to draw; all faults are tried on the charts.
LIKELY = [
    key for key in FAULTS if key[:2] in ("A1", "A3", "G4", "O2", "O5", "L3", "D1", "D2", "B1", "N1", "C1")
]


def image_of(one):
    """Return what a subject leaves on its canvas, in bytes."""
    return emulate(one.scene, one.pipeline, one.device, one.jitter, one.frames).rgba8


def explained(image, one, **more):
    return vr.explain(image, one.scene, one.pipeline, one.device, one.jitter, one.frames, **more)


def with_faults(one, *parts):
    """Return a subject with faults, (key, strength) each."""
    for key, strength in parts:
        assert FAULTS[key].suits(one)
        one = FAULTS[key].changed(one, strength)
    return one


@pytest.mark.parametrize(("key", "strength", "pipeline", "more"), CASES)
def test_a_fault_is_named_first_among_all(key, strength, pipeline, more):
    one = subject(pipeline, scene(**more), MACHINE)
    image = image_of(with_faults(one, (key, strength)))
    why = explained(image, one, pairs=False)
    assert why.ranking[0].fault == key, why.message
    assert why.ranking[0].strength == pytest.approx(strength, rel=0.02)
    assert why.ranking[0].explained > 0.98
    assert why.status == "explained"
    assert FAULTS[key].title in why.message
    assert np.array_equal(np.rint(255 * why.counterfactual), image)


@pytest.mark.parametrize(("pipeline", "switches", "key"), SEEDS)
def test_the_seeds_own_bugs_are_named_from_their_images(pipeline, switches, key):
    more = {"mesh": pipeline is ARBELAZ, "lit": pipeline is CEJ}
    if pipeline is ARBELAZ:
        more["background"] = BACKGROUND
    one = subject(pipeline, scene(**more), MACHINE)
    printed = dataclasses.replace(one, pipeline=pipeline.with_switches(**switches))
    why = explained(image_of(printed), one, pairs=False, faults=LIKELY)
    assert why.ranking[0].fault == key, why.message
    assert why.ranking[0].explained > 0.98


@pytest.mark.parametrize("pipeline", [BASELINE, CONGOTE])
def test_clean_images_are_explained_by_none(pipeline):
    one = subject(pipeline, scene(), MACHINE)
    acceptance = vr.accept(one.scene, one.pipeline, one.device)
    chance = np.random.default_rng(6).random(acceptance.lo.shape)
    for image in (
        image_of(one),
        np.rint(255 * acceptance.lo + np.floor(255 * (acceptance.hi - acceptance.lo) * chance)).astype(
            np.uint8
        ),
    ):
        why = explained(image, one, acceptance=acceptance)
        assert (why.status, why.ranking, why.counterfactual, why.runner_up) == ("none", (), None, "")
        assert why.message == why.verdict.message


@pytest.mark.parametrize(("key", "strength"), [("O1-stale", 1.3), ("T4-step", 1.1), ("G1-half-voxel", 0.2)])
def test_strengths_between_the_listed_ones_are_fitted(key, strength):
    one = subject(BASELINE, scene(), MACHINE)
    why = explained(image_of(with_faults(one, (key, strength))), one, pairs=False)
    assert why.ranking[0].fault == key, why.message
    # Half a level of some 50 in 255 is one percent, at one pixel; there are a hundred.
    assert why.ranking[0].strength == pytest.approx(strength, rel=0.01)


def test_two_faults_are_named_together():
    one = subject(BASELINE, scene(), MACHINE)
    image = image_of(with_faults(one, ("G4-flip-x", 1.0), ("O2-add-alpha", 1.0)))
    few = ["G4-flip-x", "G4-flip-y", "G1-half-voxel", "O1-uncorrected", "O2-add-alpha", "F1-nearest"]
    why = explained(image, one, faults=few)
    assert why.ranking[0].fault == "G4-flip-x + O2-add-alpha"
    assert why.ranking[0].strength == (1.0, 1.0)
    assert why.ranking[0].explained > 0.98
    assert why.status == "explained"
    assert why.message.startswith("two faults: the volume is turned round along x (G4-flip-x); and alpha is")
    assert np.array_equal(np.rint(255 * why.counterfactual), image)
    assert explained(image, one, faults=few, pairs=False).status == "none of these"


def test_an_image_of_another_scene_is_none_of_these():
    one = subject(BASELINE, scene(), MACHINE)
    z, y, x = np.indices(one.scene.volume.values.shape)
    other = vr.Volume((20 * x + 35 * y * (z % 3)).astype(np.uint8), one.scene.volume.spacing)
    strange = dataclasses.replace(one, scene=dataclasses.replace(one.scene, volume=other))
    why = explained(image_of(strange), one, pairs=False)
    assert why.status == "none of these"
    assert why.message.startswith("none of the known faults explains the image; the nearest: ")


def test_faults_that_are_one_in_a_scene_are_not_told_apart_but_sent_to_charts():
    faint = vr.TransferFunction.from_opacity(
        [20, 255], [(0.1, 0.2, 0.9), (1, 0.9, 0.7)], [0, 0.03], unit_distance=3
    )
    one = subject(BASELINE, dataclasses.replace(scene(), transfer=faint), MACHINE)
    keys = ["O1-stale", "O3-factor-per-sample", "G4-flip-x"]
    why = explained(image_of(with_faults(one, ("O3-factor-per-sample", 1.4))), one, faults=keys)
    assert (why.status, why.identifiable) == ("not identifiable here", False)
    assert {found.fault for found in why.ranking[:2]} == {"O1-stale", "O3-factor-per-sample"}
    assert set(why.charts) == {"grey-slab", "long-voxels-x"}
    assert why.message.startswith("not identifiable in this scene: ")
    assert "render the chart" in why.message


def test_a_set_of_pipelines_is_explained_by_its_switches():
    one = subject(CONGOTE, scene(), MACHINE)
    drawn = CONGOTE.with_switches(volume={"slices": "last"}, table={"size": 32})
    image = image_of(dataclasses.replace(one, pipeline=drawn))
    unknown = {"volume.slices": ("count", "last", "centers"), "table.size": (32, 256)}
    why = explained(image, dataclasses.replace(one, pipeline=vr.Candidates(CONGOTE, unknown)))
    assert why.status == "explained"
    assert why.ranking[0][::2] == ("volume.slices=last, table.size=32", 1.0)
    assert len(why.ranking) == 6
    assert np.array_equal(np.rint(255 * why.counterfactual), image)


def test_values_of_an_open_switch_that_change_nothing_are_not_told_apart():
    one = subject(CONGOTE, scene(), MACHINE)
    drawn = vr.Candidates(CONGOTE, {"volume.channel": ("red", "alpha")})
    why = explained(image_of(one), dataclasses.replace(one, pipeline=drawn))
    assert why.status == "not identifiable here"


def test_pixels_of_a_mask_and_straight_colours_are_as_for_check():
    one = subject(BASELINE, scene(background=BACKGROUND), MACHINE)
    image = image_of(with_faults(one, ("G4-flip-z", 1.0)))
    alpha = image[..., 3:].astype(np.float64)
    colors = np.rint(255.0 * image[..., :3] / np.where(alpha > 0, alpha, 1))
    straight = np.concatenate([np.minimum(colors, 255), alpha], axis=-1).astype(np.uint8)
    straight[:4, :4] = 255
    mask = np.zeros((HEIGHT, WIDTH), np.bool_)
    mask[:4, :4] = True
    keys = ["G4-flip-x", "G4-flip-y", "G4-flip-z", "O1-stale"]
    why = explained(straight, one, faults=keys, alpha="straight", mask=mask)
    assert why.ranking[0].fault == "G4-flip-z"
    assert why.ranking[0].explained > 0.98


def test_faults_with_a_name_that_there_is_not_are_refused():
    one = subject(BASELINE)
    with pytest.raises(SceneError, match=r"^faults must be keys of the table of faults, got 'O9-none'; use "):
        explained(image_of(one), one, faults=["O9-none"])


def test_intervals_of_another_size_are_refused():
    one = subject(BASELINE)
    small = vr.Acceptance.unjustified(np.zeros((2, 3, 4), np.uint8), 0.1)
    with pytest.raises(SceneError, match=f"must be of {WIDTH} x {HEIGHT} pixels .* got 3 x 2"):
        explained(np.full((2, 3, 4), 200, np.uint8), one, acceptance=small)


def test_faults_that_the_program_cannot_have_explain_nothing():
    one = subject(BASELINE, scene(), MACHINE)
    image = image_of(with_faults(one, ("G4-flip-x", 1.0)))
    why = explained(image, one, faults=["A3-mix-by-x"])
    assert (why.status, why.ranking) == ("none of these", ())


def test_progress_goes_up_to_its_end():
    one, told = subject(BASELINE, scene(), MACHINE), []
    image = image_of(with_faults(one, ("G4-flip-x", 1.0)))
    keys = ["G4-flip-x", "G4-flip-y", "O1-stale"]
    explained(image, one, faults=keys, progress=lambda done, total: told.append((done, total)))
    assert [done for done, _ in told[:-1]] == list(range(1, len(told)))
    assert all(done <= total for done, total in told)
    assert told[-1][0] == told[-1][1]


def test_plain_data_of_an_explanation_is_json():
    one = subject(BASELINE, scene(), MACHINE)
    image = image_of(with_faults(one, ("G4-flip-x", 1.0)))
    why = explained(image, one, faults=["G4-flip-x", "G4-flip-y"])
    document = json.loads(json.dumps(why.as_dict(1), allow_nan=False))
    assert document["status"] == "explained"
    assert document["ranking"] == [{"fault": "G4-flip-x", "strength": 1.0, "explained": 1.0}]
    assert document["verdict"]["status"] == "outside"
    assert str(why) == document["message"]


@pytest.mark.parametrize("pipeline", [BASELINE, CONGOTE, PAGE, ARBELAZ, CEJ, vr.pipelines()["vpt-eam"]])
def test_what_is_drawn_at_some_pixels_is_what_is_drawn_at_all(pipeline):
    one = subject(pipeline, scene(mesh=pipeline is ARBELAZ, lit=pipeline is CEJ), MACHINE)
    chosen = np.random.default_rng(7).random((HEIGHT, WIDTH)) < 0.3
    whole = emulate(one.scene, one.pipeline, one.device, one.jitter).rgba
    assert np.array_equal(canvas_at(one, chosen, rounds=True)[chosen], whole[chosen])
    # Half a level, and as much again where bytes are blended one by one.
    assert np.abs(canvas_at(one, chosen)[chosen] - whole[chosen]).max() <= 1 / 255


def test_of_equal_findings_the_simpler_one_is_believed():
    stale, flip = FAULTS["O1-stale"], FAULTS["G4-flip-x"]
    listed, fitted = Part(stale, 2.0), Part(stale, 1.9)
    pair = Finding((Part(flip, 1.0), listed), 0.99)
    order = ranked(
        [pair, Finding((fitted,), 0.991), Finding((Part(flip, 1.0),), 0.99), Finding((listed,), 0.99)]
    )
    assert [(one.key, one.parts[-1].strength) for one in order] == [
        ("G4-flip-x", 1.0),
        ("O1-stale", 2.0),
        ("G4-flip-x + O1-stale", 2.0),
    ]
