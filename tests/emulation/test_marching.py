"""The loop: laws that hold for all programs, and each way to end a ray against a loop over scalars."""

import dataclasses

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.emulation.scenes import HEIGHT, WIDTH, example, jitter_of, scene_for
from volref import Camera, Pipeline, Scene, TransferFunction, Volume, emulate
from volref.emulation.catalogue import pipelines
from volref.emulation.device import Device
from volref.emulation.drawing import prepare
from volref.emulation.loop import marching
from volref.emulation.loop.marching import march
from volref.emulation.loop.offsets import start_offsets

f32, f64 = np.float32, np.float64
IDEAL = Device()
NAMES = [
    "arbelaz2016-printed",
    "barbagallo",
    "burkalo2022",
    "cej2020",
    "congote2012",
    "mpilia2018",
    "texture3d",
    "vpt-eam",
    "x3dom",
]


def program_of(name, scene=None):
    shown = scene or scene_for(name)
    pipeline = pipelines()[name]
    offsets = start_offsets(shown, pipeline, jitter_of(name), 1)
    return prepare(shown, pipeline, IDEAL).program(offsets[0])


@pytest.mark.parametrize("name", NAMES)
def test_neither_the_order_of_rays_nor_their_chunks_nor_onlookers_change_a_bit(name, monkeypatch):
    program = program_of(name)
    alone = march(program)
    assert alone.samples.max() > 5
    order = np.random.default_rng(1).permutation(len(program.offset))[:30]
    seen = []
    monkeypatch.setattr(marching, "CHUNK", 11)
    watched = march(program, seen.append, order)
    monkeypatch.setattr(marching, "MOST_OVER", 2.0)
    undropped = march(program, rays=order)
    for other in (watched, undropped):
        for found, expected in zip(other, alone, strict=True):
            np.testing.assert_array_equal(found[..., order], expected[..., order])
    counted = np.zeros_like(alone.samples)
    for sample in seen:
        counted[sample.ray] = np.maximum(counted[sample.ray], sample.number + 1)
    # Rays that are over are looked at until they are dropped, never a sample less than they take.
    assert (counted >= alone.samples)[order].all()


@pytest.mark.parametrize("name", NAMES)
def test_some_of_the_rays_leave_the_others_0(name):
    program = program_of(name)
    alone, chosen = march(program), np.array([3, 1, 30])
    some = march(program, rays=chosen)
    for found, whole in zip(some, alone, strict=True):
        np.testing.assert_array_equal(found[..., chosen], whole[..., chosen])
        assert not np.delete(found, chosen, axis=-1).any()


def test_no_rays_are_no_work():
    program = program_of("texture3d")
    seen = []
    nothing = march(program, seen.append, np.zeros(0, int))
    assert not seen
    assert not nothing.samples.any()


@pytest.mark.parametrize("name", NAMES)
def test_a_transparent_table_leaves_the_background_exactly(name):
    background = (0.25, 0.5, 0.125, 0.75)
    shown = dataclasses.replace(example(opacity=0.0), background=background)
    program = pipelines()[name].with_switches(
        opacity={"source": "table"},
        output={"format": "float", "mean_format": None, "tone_map": "none", "gamma": 1.0},
    )
    out = emulate(shown, program, jitter=jitter_of(name))
    assert out.samples.max() > 5
    blend, over = program.output.blend, np.array(background)
    expected = {"none": 0 * over, "shader": np.r_[over[:3], 1], "shader-straight": np.r_[over[:3], 1]}.get(
        blend, over
    )
    drawn = out.samples > 0
    if program.accumulation.alpha == "one":
        expected = np.r_[expected[:3], 1]
    np.testing.assert_array_equal(out.rgba[drawn], np.broadcast_to(expected, out.rgba[drawn].shape))
    if program.output.missed == "clear":
        np.testing.assert_array_equal(out.rgba[~drawn], np.broadcast_to(over, out.rgba[~drawn].shape))


AXIS = Camera.orthographic((0.5, 0.5, 3), (0.5, 0.5, 0.5), (0, 1, 0), 0.1, 1, 9)
CORNER = Camera.look_at((1.9, 1.4, 2.7), (0.5, 0.5, 0.5), (0, 1, 0), 32, 0.1, 9)


def fog(value=255, opacity=0.3, width=5, height=4, camera=CORNER):
    """A cube of one value and white; rays through it from the corner are of many lengths."""
    volume = Volume(np.full((4, 4, 4), value, np.uint8), spacing=(0.25,) * 3, origin=(0.125,) * 3)
    transfer = TransferFunction.from_opacity([0, 255], [(1, 1, 1)] * 2, [opacity] * 2)
    return Scene(volume, transfer, camera, width, height)


def walked(stepping, paths, offset, ray, opacity):
    """How many samples one ray takes, in float32 scalars as the words of the switches say."""
    entry, leave, delta = (getattr(paths, name)[:, ray] for name in ("entry", "exit", "delta"))
    step, length, offset = paths.step[ray], paths.length[ray], offset[ray]
    end, advance, cap = stepping.end, stepping.advance, stepping.cap or 10_000
    position = [e + d * offset for e, d in zip(entry, delta, strict=True)]
    t, gone, left, alpha = step * offset, f32(0), length, 0.0
    if advance == "parameter":
        gone = t
    for number in range(cap):
        begin = f32(number) * step
        whole = stepping.last_step != "dropped"
        if (
            (end == "count" and number >= paths.count[ray])
            or (end == "parameter" and t >= 1)
            or (end == "length-left" and left <= 0)
            or (end == "length-before" and (begin >= length if whole else begin + step > length))
        ):
            return number
        if advance == "multiply":
            sampled = [e + d * (f32(number) + offset) for e, d in zip(entry, delta, strict=True)]
        elif advance == "parameter":
            sampled = [a + (b - a) * t for a, b in zip(entry, leave, strict=True)]
        else:
            sampled = position
        alpha += (1 - alpha) * opacity
        position = [p + d for p, d in zip(position, delta, strict=True)]
        t, gone, left = t + step, gone + step, left - step
        over = {
            "length-after": gone >= length,
            "outside": any(p > 1 or p < 0 for p in position),
            "outside-above": any(p > 1 for p in sampled),
        }
        if over.get(end, False):
            return number + 1
        threshold = stepping.opaque_at
        if threshold is not None and (
            alpha > threshold if stepping.opaque_test == "above" else alpha >= threshold
        ):
            return number + 1
    return cap


ENDS = [
    {"rule": "count", "steps": 13, "end": "count"},
    {"rule": "voxel-count", "length": 0.21, "end": "count"},
    {"rule": "count", "steps": 8, "advance": "parameter", "end": "parameter"},
    {"rule": "count", "steps": 10, "advance": "parameter", "end": "parameter"},
    {"rule": "count", "steps": 200, "advance": "parameter", "end": "parameter"},
    {"rule": "texture-length", "length": 0.043, "end": "length-before", "last_step": "whole"},
    {"rule": "world-length", "length": 0.043, "end": "length-before"},
    {"rule": "world-length", "length": 0.043, "end": "length-before", "last_step": "dropped"},
    {"rule": "texture-length", "length": 0.043, "advance": "add", "end": "length-after"},
    {"rule": "texture-length", "length": 0.043, "advance": "add", "end": "length-left"},
    {"rule": "texture-length", "length": 0.043, "advance": "add", "end": "outside", "cap": 500},
    {"rule": "texture-length", "length": 0.043, "advance": "add", "end": "outside-above", "cap": 21},
    {"rule": "world-length", "length": 0.01, "end": "length-before", "cap": 17},
]


@pytest.mark.parametrize("offset", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("stepping", ENDS, ids=lambda s: "-".join(map(str, s.values())))
def test_rays_take_as_many_samples_as_a_loop_over_scalars(stepping, offset):
    shown = fog()
    pipeline = Pipeline("p").with_switches(stepping=stepping | {"offset": offset})
    drawing = prepare(shown, pipeline, IDEAL)
    program = drawing.program(start_offsets(shown, pipeline, None, 1)[0])
    samples = march(program).samples
    expected = [
        walked(pipeline.stepping, program.paths, program.offset, ray, 0.0) for ray in range(len(samples))
    ]
    np.testing.assert_array_equal(samples, expected)
    assert len(samples) > 8


@pytest.mark.parametrize(
    ("threshold", "test", "count"),
    [
        (None, "at-least", 40),
        (0.875, "at-least", 3),
        (0.875, "above", 4),
        (1.0, "at-least", 40),
        (0.0, "at-least", 1),
        (2.0, "at-least", 40),
    ],
)
def test_an_alpha_ends_a_ray_that_has_reached_it_or_is_above_it(threshold, test, count):
    # Each sample leaves a half: alpha is 1/2, 3/4, 7/8 ... exactly, and after 40 samples still below 1.
    pipeline = Pipeline("p").with_switches(
        stepping={"rule": "count", "steps": 40, "end": "count", "opaque_at": threshold, "opaque_test": test},
        opacity={"rule": "as-is"},
        table={"format": "exact"},
        output={"format": "exact"},
    )
    out = emulate(fog(opacity=0.5), pipeline)
    assert set(out.samples.reshape(-1).tolist()) - {0} == {count}
    assert set(out.rgba[..., 3].reshape(-1).tolist()) - {0.0} == {1 - 0.5**count}


def test_an_alpha_of_1_ends_a_ray_at_its_first_opaque_sample():
    opaque = {"opacity": {"rule": "as-is"}, "table": {"format": "exact"}}
    for threshold, expected in ((1.0, 1), (None, 7)):
        stepping = {"rule": "count", "steps": 7, "end": "count", "opaque_at": threshold}
        out = emulate(fog(opacity=1.0), Pipeline("p").with_switches(stepping=stepping, **opaque))
        assert out.samples.max() == expected
        assert set(out.rgba[out.samples > 0].reshape(-1).tolist()) == {1.0}


def by_hand(rule, alphas, colors):
    """Colour and alpha of one ray by the words of `Accumulation.rule`."""
    color, alpha = 0.0, 0.0
    for a, c in zip(alphas, colors, strict=True):
        if rule == "reversed-over":
            color = a * c + (1 - a) * alpha * color
            alpha = a + (1 - a) * alpha
            continue
        color += (1 - alpha) * a * c
        alpha += (1 - alpha) * a if rule == "over" else a
        alpha = min(alpha, 1.0) if rule == "add-clamped" else alpha
    return color, alpha


@pytest.mark.parametrize("light", [1.0, 0.75])
@pytest.mark.parametrize("rule", ["over", "add-alpha", "add-clamped", "reversed-over"])
def test_samples_are_put_together_as_the_rule_says(rule, light):
    # Four slices along z, looked at from z: four samples in their middles.
    values = np.repeat([51, 204, 102, 255], 16).astype(np.uint8).reshape(4, 4, 4)
    transfer = TransferFunction.from_opacity([0, 255], [(0.2, 0.0, 1.0), (0.8, 0.5, 1.0)], [0, 0.5])
    camera = Camera.orthographic((1.5, 1.5, 20), (1.5, 1.5, 1.5), (0, 1, 0), 0.5, 1, 60)
    shown = Scene(Volume(values), transfer, camera, 1, 1)
    exact = {"format": "exact"}
    pipeline = Pipeline("p").with_switches(
        stepping={"rule": "count", "steps": 4, "end": "count", "offset": 0.5},
        volume=exact,
        table=exact | {"size": 256, "coordinate": "centered", "baked": "ends"},
        opacity={"rule": "as-is"},
        accumulation={"rule": rule},
        lighting={"factor": light},
        output=exact | {"blend": "none"},
    )
    out = emulate(shown, pipeline, Device.named("exact")).rgba[0, 0]
    unit = np.array([255, 102, 204, 51]) / 255
    for channel, (low, high) in enumerate(((0.2, 0.8), (0.0, 0.5), (1.0, 1.0))):
        color, alpha = by_hand(rule, 0.5 * unit, low + (high - low) * unit)
        # For "reversed-over" the light is each sample's own: its sum is linear in it.
        np.testing.assert_allclose(out[[channel, 3]], [light * color, alpha], rtol=0, atol=1e-12)


@pytest.mark.parametrize(("source", "expected"), [("table", [0.5, 0.25]), ("value", [1.0, 0.0])])
def test_a_weighted_alpha_sums_what_samples_have_before_the_step_by_what_they_weigh(source, expected):
    # Two samples of value 1 and opacity 1/2, as they are: weights 1/2 and 1/4, or 1 and 0 of the value's own.
    stepping = {"rule": "count", "steps": 2, "end": "count"}
    exact = {"format": "exact"}
    pipeline = Pipeline("p").with_switches(
        stepping=stepping,
        table=exact,
        output=exact | {"blend": "none"},
        accumulation={"alpha": "weighted"},
        opacity={"rule": "as-is", "source": source},
    )
    alpha = emulate(fog(opacity=0.5, camera=AXIS, width=1, height=1), pipeline).rgba.reshape(-1)[3]
    assert alpha == sum(weight * (0.5 if source == "table" else 1.0) for weight in expected)


@pytest.mark.parametrize(
    "stepping",
    [
        {"end": "length-before", "last_step": "whole"},
        {"end": "length-before", "last_step": "partial"},
        {"end": "length-before", "last_step": "dropped"},
        {"end": "length-after", "advance": "add"},
        {"rule": "texture-length", "end": "length-left", "advance": "add"},
    ],
    ids=lambda s: "-".join(s.values()),
)
def test_a_ray_as_long_as_four_steps_takes_four(stepping):
    # 1 in steps of 1/4: all numbers are exact.
    shown = fog(camera=AXIS, width=1, height=1)
    pipeline = Pipeline("p").with_switches(stepping={"rule": "world-length", "length": 0.25} | stepping)
    assert emulate(shown, pipeline).samples.item() == 4


@pytest.mark.parametrize(("end", "count"), [("outside", 5), ("outside-above", 5)])
@pytest.mark.parametrize("eye", [-2.0, 3.0])
def test_a_ray_that_ends_outside_takes_the_sample_on_the_far_face(eye, end, count):
    # Samples at 0, 1/4 ... 1 are inside, where the program looks before it has stepped out at 5/4 or -1/4.
    camera = Camera.orthographic((0.5, 0.5, eye), (0.5, 0.5, 0.5), (0, 1, 0), 0.1, 1, 9)
    stepping = {"rule": "texture-length", "length": 0.25, "advance": "add", "end": end, "cap": 9}
    found = emulate(fog(camera=camera, width=1, height=1), Pipeline("p").with_switches(stepping=stepping))
    # Faces at 0 are missed by a test of what is above 1, which is of the sample that has just been taken.
    expected = count if end == "outside" else {3.0: 9, -2.0: count + 1}[eye]
    assert found.samples.item() == expected


def test_a_last_step_is_as_long_as_what_is_left_whole_or_left_out():
    # A depth of 1 in steps of 0.3: three whole ones and a third of one.
    shown = fog(opacity=0.4, width=1, height=1, camera=AXIS)
    exact = {"format": "exact"}
    seen = {}
    for word in ("partial", "whole", "dropped"):
        pipeline = Pipeline("p").with_switches(
            stepping={"rule": "world-length", "length": 0.3, "offset": 0.5, "last_step": word},
            table=exact,
            output=exact,
        )
        drawing = prepare(shown, pipeline, Device.named("exact"))
        samples = []
        marched = march(drawing.program(np.array([0.5])), samples.append)
        seen[word] = marched.alpha[0], [1 - s.position[2, 0] for s in samples], int(marched.samples[0])
    places = {
        "partial": [0.15, 0.45, 0.75, 0.95],
        "whole": [0.15, 0.45, 0.75, 1.05],
        "dropped": [0.15, 0.45, 0.75],
    }
    walked = {"partial": 1.0, "whole": 1.2, "dropped": 0.9}
    for word, (alpha, depths, count) in seen.items():
        np.testing.assert_allclose(depths, places[word], rtol=0, atol=1e-12)
        np.testing.assert_allclose(alpha, 1 - 0.6 ** walked[word], rtol=0, atol=1e-12)
        assert count == len(places[word])


@given(seed=st.integers(0, 1000), jitter=st.booleans(), name=st.sampled_from(NAMES))
@settings(max_examples=10, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_ray_is_the_same_alone_and_among_others(seed, jitter, name):
    shown = DRAWN.setdefault(name, scene_for(name))
    drawing = DRAWN.setdefault(name + "/", prepare(shown, pipelines()[name], IDEAL))
    rng = np.random.default_rng(seed)
    offset = rng.random(WIDTH * HEIGHT) if jitter else np.zeros(WIDTH * HEIGHT)
    program = drawing.program(offset)
    chosen = rng.choice(len(program.offset), 6, replace=False)
    together = march(program, rays=chosen)
    alone = march(program, rays=chosen[:1])
    for found, expected in zip(alone, together, strict=True):
        np.testing.assert_array_equal(found[..., chosen[0]], expected[..., chosen[0]])


DRAWN = {}
