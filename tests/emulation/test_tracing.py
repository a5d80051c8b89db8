"""`trace` of a program: every iteration of one ray, from the loop that draws the image."""

import json

import numpy as np
import pytest

import volref as vr
from tests.emulation.scenes import JITTERED, example, jitter_of, scene_for
from volref.emulation.catalogue import pipelines
from volref.emulation.device import Device
from volref.emulation.passes import emulate
from volref.emulation.textures.uploads import decoded_or, uploads_of

PIXELS = ((0, 0), (8, 5), (11, 7))


@pytest.mark.parametrize("device", ["ideal", "llvmpipe"])
@pytest.mark.parametrize("name", pipelines())
def test_a_trace_ends_with_the_pixel_of_the_canvas_and_its_count_of_samples(name, device):
    scene, jitter = scene_for(name), jitter_of(name)
    drawn = emulate(scene, name, device, jitter)
    for x, y in PIXELS:
        found = vr.trace(scene, (x, y), name, jitter, device=device)
        assert found.head["rgba"] == drawn.rgba[y, x].tolist()
        assert found.head["rgba8"] == drawn.rgba8[y, x].tolist()
        assert len(found.table.get("iteration", ())) == drawn.samples[y, x]
        for target, values in found.head["targets"].items():
            assert values == drawn.passes[target][y, x].tolist()


def test_a_ray_whose_neighbours_choose_its_mip_level_is_walked_with_them():
    pipeline = pipelines()["barbagallo"].with_switches(table={"filter": "linear-mipmap"})
    scene = example()
    drawn, plain = (emulate(scene, one, "swiftshader") for one in (pipeline, "barbagallo"))
    for x, y in ((8, 5), (9, 5), (8, 6), (6, 4)):
        found = vr.trace(scene, (x, y), pipeline, device="swiftshader")
        assert found.head["rgba"] == drawn.rgba[y, x].tolist()
        assert len(found.table["iteration"]) == drawn.samples[y, x] == found.head["samples"]
        assert found.head["ended"].endswith(f"after {drawn.samples[y, x]} samples")
    assert not np.array_equal(drawn.rgba, plain.rgba)


@pytest.mark.parametrize("name", JITTERED)
def test_all_frames_of_a_mean_are_traced_one_after_the_other(name):
    if pipelines()[name].output.mean_format is None:
        return
    scene, jitter = scene_for(name), np.random.default_rng(5).random((3, 12, 16))
    drawn = emulate(scene, name, None, jitter, 3)
    found = vr.trace(scene, (6, 5), name, jitter, 3)
    assert found.head["rgba"] == drawn.rgba[5, 6].tolist()
    assert found.head["targets"]["running_mean"] == drawn.passes["running_mean"][5, 6].tolist()
    assert sorted(set(found.table["frame"].tolist())) == [1, 2, 3]


@pytest.mark.parametrize("name", pipelines())
def test_a_row_can_be_followed_by_hand_from_the_texels_to_the_sum(name):
    """Weights times texels are the value, the table's entry there is the colour, and both go into the sum."""
    scene, pipeline = scene_for(name), pipelines()[name]
    table = vr.trace(scene, (6, 5), name, jitter_of(name)).table
    assert len(table["iteration"]) > 3
    weights, values = table["texel_weights"], table["texel_values"][..., 0]
    # Weights come from places in float32: 2^-23 of up to 64 texels.
    np.testing.assert_allclose(weights.sum(axis=-1), 1.0, rtol=0, atol=1e-12)
    mixed = (weights * values).sum(axis=-1)
    if "slices" in table:
        share = table["slice_share"] * (pipeline.volume.between != "none")
        mixed = mixed[:, 0] + share * (mixed[:, 1] - mixed[:, 0])
    mixed = mixed * table.get("seen", 1)
    # The same sum in another order, of numbers below 1 (between = x has shares of up to 20).
    np.testing.assert_allclose(mixed, table["value"], rtol=0, atol=1e-13)
    if pipeline.table.order == "post" and pipeline.table.rows == 1 and not pipeline.table.srgb:
        entries = decoded_or(uploads_of(scene, pipeline).table[0], np.float64)
        place = np.clip(table["table_uv"][:, 0].astype(float) * len(entries) - 0.5, 0, len(entries) - 1)
        by_hand = [np.interp(place, np.arange(len(entries)), channel) for channel in entries.T]
        # Between entries 1 / 255 apart or more the place counts, which is rounded to float64.
        np.testing.assert_allclose(np.transpose(by_hand), table["color"], rtol=0, atol=1e-12)
    _follow_the_sum(pipeline, table)


def _follow_the_sum(pipeline, table):
    light = pipeline.lighting.factor
    color, alpha = np.zeros(3), 0.0
    shone = table.get("lit", table["color"][:, :3])
    for one, opacity, expected in zip(shone, table["opacity"], table["accumulated"], strict=True):
        if pipeline.accumulation.rule == "reversed-over":
            color = opacity * one * light + (1 - opacity) * alpha * color
            alpha = opacity + (1 - opacity) * alpha
        else:
            color = color + (1 - alpha) * opacity * one * light
            alpha += opacity if pipeline.accumulation.rule == "add-alpha" else (1 - alpha) * opacity
        # Sums of a hundred float64; m-pilia's alpha is summed in float32.
        within = 2e-6 if pipeline.accumulation.rule == "reversed-over" else 1e-13
        np.testing.assert_allclose([*color, alpha], expected, rtol=0, atol=within)


def test_the_table_for_people_has_a_line_for_each_head_and_each_iteration():
    found = vr.trace(scene_for("congote2012"), (6, 5), "congote2012")
    lines = str(found).splitlines()
    assert len(lines) == len(found.head) + 1 + len(found.table["iteration"])
    assert lines[0] == "pixel: 6 5"
    assert "texel_weights" not in str(found)
    document = json.loads(found.to_json())
    assert set(document["iterations"]) == set(document["columns"]) == set(found.table)
    assert np.shape(document["iterations"]["texels"])[1:] == (2, 4, 2)


# --- why rays end


# Looking towards +x, +y and +z: rays leave through the faces at 1.
BEHIND = (-18.0, -12.0, -15.0)


def ended(pixel=(8, 6), name="texture3d", scene=None, **switches):
    pipeline = pipelines()[name].with_switches(**switches)
    return vr.trace(scene or example(eye=BEHIND), pixel, pipeline, jitter_of(name)).head["ended"]


def test_a_ray_that_is_opaque_says_at_which_alpha_and_after_how_many_samples():
    dense = example(opacity=1.0, unit_distance=1.0)
    found = vr.trace(dense, (8, 6), "texture3d")
    alpha, count = found.table["accumulated"][-1, 3], len(found.table["iteration"])
    assert alpha >= 0.999 > found.table["accumulated"][-2, 3]
    assert found.head["ended"] == f"alpha {alpha:.9g} >= 0.999 after {count} samples"
    above = ended(scene=dense, stepping={"opaque_test": "above"})
    assert " > 0.999 after " in above


@pytest.mark.parametrize(
    ("stepping", "sentence"),
    [
        ({"rule": "count", "steps": 17, "end": "count"}, "all 17 steps are done, after 17 samples"),
        (
            {"rule": "count", "steps": 16, "advance": "parameter", "end": "parameter"},
            "t >= 1, after 16 samples",
        ),
        ({"cap": 5}, "the loop has run 5 times, its cap"),
        ({"rule": "texture-length", "advance": "add", "end": "outside"}, "the position is outside the box"),
        (
            {"rule": "texture-length", "advance": "add", "end": "outside-above", "cap": 999},
            "a coordinate is above 1",
        ),
        ({"rule": "texture-length", "advance": "add", "end": "length-left"}, "no length is left of "),
        ({"end": "length-after"}, "is walked in steps of "),
        ({"last_step": "dropped"}, "another whole step of "),
    ],
)
def test_a_ray_says_which_rule_of_the_program_ended_it(stepping, sentence):
    assert sentence in ended(stepping={"opaque_at": None, **stepping})


def test_a_cap_that_a_ray_just_reaches_is_not_what_ended_it():
    count = len(vr.trace(example(eye=BEHIND), (8, 6), "texture3d").table["iteration"])
    assert "cap" not in ended(stepping={"cap": count})
    assert ended(stepping={"cap": count - 1}) == f"the loop has run {count - 1} times, its cap"


@pytest.mark.parametrize("name", ["arbelaz2016", "arbelaz2016-printed"])
def test_a_ray_that_meets_a_mesh_says_at_which_depths(name):
    sentence = ended(name=name, scene=example(mesh=True))
    assert sentence.startswith("mesh met after ")
    assert (" > -" if name.endswith("printed") else " >= surface ") in sentence


def test_a_pixel_without_a_ray_says_so():
    found = vr.trace(example(), (0, 0), "texture3d")
    assert found.head["ended"] == "no ray: the box is missed"
    assert found.table == {}
    assert found.head["rgba"] == list(example().background)


# --- refusals


def test_arguments_of_the_other_kind_of_trace_are_refused():
    scene = example()
    with pytest.raises(vr.SceneError, match=r"step must be None with a pipeline"):
        vr.trace(scene, (1, 1), "texture3d", step=0.5)
    with pytest.raises(vr.SceneError, match=r"jitter must be None without a pipeline"):
        vr.trace(scene, (1, 1), jitter=np.zeros((1, 12, 16)))
    with pytest.raises(vr.SceneError, match=r"device must be None without a pipeline"):
        vr.trace(scene, (1, 1), device=Device())
    with pytest.raises(vr.SceneError, match=r"frames must be 1 without a pipeline, got 2"):
        vr.trace(scene, (1, 1), frames=2)
    with pytest.raises(vr.SceneError, match=r"pixel x must be"):
        vr.trace(scene, (16, 1), "texture3d")
    with pytest.raises(vr.SceneError, match=r"pipeline must be one of the catalogue, got 'mine'"):
        vr.trace(scene, (1, 1), "mine")
