"""`accept` as a whole: what machines of a set draw lies inside, and intervals close where nothing is free."""

import dataclasses

import numpy as np
import pytest

import volref as vr
from tests.emulation.scenes import JITTERED, example, scene_for
from volref.emulation.limit import limit_scene, refined, widened
from volref.emulation.pipeline import GROUPS
from volref.emulation.switches import Flag, Word, switches_of

WIDTH, HEIGHT = 12, 9
NAMES = sorted(vr.pipelines())
SLABS = [name for name in NAMES if vr.pipelines()[name].rays.kind == "slab"]

# Ways in which one machine of the set "webgl-highp" may differ from another.
MEMBERS = {
    "float32": {"values": "float32"},
    "weights of 8 bits": {"weight_bits": 8},
    "a grid of 1/256 of a pixel": {"subpixel_bits": 8},
    "planes through corners beside it": {"subpixel_bits": 8, "planes": "unsnapped"},
    "mix as a sum, products with reciprocals": {
        "values": "float32",
        "mix": "sum",
        "constant_divisor": "multiplied",
    },
    "blending in whole numbers": {"blend": "integer"},
    "all of it": {
        "values": "float32",
        "weight_bits": 8,
        "subpixel_bits": 8,
        "mix": "sum",
        "constant_divisor": "multiplied",
        "blend": "integer",
    },
}


def shown(name, **more):
    """The example that suits a pipeline, small, over a background that is not black."""
    return dataclasses.replace(
        scene_for(name), width=WIDTH, height=HEIGHT, background=(0.1, 0.2, 0.1, 0.4), **more
    )


def jitter_of(name, frames=1):
    if name not in JITTERED:
        return None
    return np.random.default_rng(3).random((frames, HEIGHT, WIDTH))


def how_far_outside(emulation, acceptance):
    """The largest excess over the intervals, in 1/255."""
    image = emulation.rgba
    if acceptance.pipeline.output.format == "unorm8":
        # Bytes, not what float32 or float16 makes of them.
        image = emulation.rgba8 / 255
    return 255 * float(np.maximum(acceptance.lo - image, image - acceptance.hi).max())


@pytest.mark.parametrize("name", NAMES)
def test_machines_of_a_set_draw_inside_its_intervals(name):
    scene, jitter = shown(name), jitter_of(name)
    acceptance = vr.accept(scene, name, "webgl-highp", jitter)
    assert how_far_outside(vr.emulate(scene, name, "webgl-highp", jitter), acceptance) <= 0
    for what, switches in MEMBERS.items():
        image = vr.emulate(scene, name, vr.Device(what, **switches), jitter)
        assert how_far_outside(image, acceptance) <= 0, what


@pytest.mark.parametrize("name", [name for name in SLABS if name not in JITTERED])
def test_swiftshader_is_of_the_set_where_nothing_is_rasterised(name):
    scene = dataclasses.replace(shown(name), meshes=())
    acceptance = vr.accept(scene, name, "webgl-highp")
    assert how_far_outside(vr.emulate(scene, name, "swiftshader"), acceptance) <= 0


def in_floats(name):
    """A pipeline of the catalogue on a canvas of floats, where no byte hides what differs."""
    return vr.pipelines()[name].with_switches(output={"format": "float"})


def test_swiftshader_s_grid_of_a_sixteenth_of_a_pixel_is_not_of_the_set():
    scene, pipeline = shown("x3dom"), in_floats("x3dom")
    image = vr.emulate(scene, pipeline, "swiftshader")
    assert how_far_outside(image, vr.accept(scene, pipeline, "webgl-highp")) > 0
    assert how_far_outside(image, vr.accept(scene, pipeline, "swiftshader")) <= 0


@pytest.mark.parametrize("device", ["llvmpipe", "lavapipe"])
def test_filters_that_round_their_results_to_bytes_are_not_of_the_set_by_design(device):
    # A byte more or less of a value is a step of the table: no interval that allows it is of use.
    scene, pipeline = shown("texture3d"), in_floats("texture3d")
    image = vr.emulate(scene, pipeline, device)
    assert how_far_outside(image, vr.accept(scene, pipeline, "webgl-highp")) > 0
    assert how_far_outside(image, vr.accept(scene, pipeline, device)) <= 0


@pytest.mark.parametrize("device", ["swiftshader", "llvmpipe", "lavapipe", "mediump"])
@pytest.mark.parametrize("name", ["texture3d", "arbelaz2016", "congote2012", "barbagallo", "cej2020"])
def test_a_machine_that_is_known_draws_inside_its_own_intervals(name, device):
    # Depths of 16 bits are another matter.
    scene = shown(name, meshes=()) if device == "mediump" else shown(name)
    pipeline, jitter = vr.pipelines()[name], jitter_of(name)
    if device == "mediump" and pipeline.meshes.kind == "depth":
        pipeline = pipeline.with_switches(meshes={"packing": "exact"})
    acceptance = vr.accept(scene, pipeline, device, jitter)
    assert how_far_outside(vr.emulate(scene, pipeline, device, jitter), acceptance) <= 0


@pytest.mark.parametrize("name", JITTERED)
def test_intervals_of_free_start_offsets_hold_those_of_all(name):
    scene, rng = shown(name), np.random.default_rng(5)
    pipeline = vr.pipelines()[name].with_switches(stepping={"steps": 24})
    acceptance = vr.accept(scene, pipeline, "webgl-highp")
    size = (1, HEIGHT, WIDTH)
    for jitter in (np.zeros(size), np.ones(size), rng.random(size), rng.integers(0, 2, size).astype(float)):
        image = vr.emulate(scene, pipeline, "webgl-highp", jitter)
        assert how_far_outside(image, acceptance) <= 0
    known = vr.accept(scene, pipeline, "webgl-highp", rng.random(size))
    assert known.width[known.drawn].mean() < acceptance.width[acceptance.drawn].mean()


@pytest.mark.parametrize("name", [name for name in JITTERED if vr.pipelines()[name].output.mean_format])
@pytest.mark.parametrize("free", [False, True])
def test_means_of_frames_lie_inside(name, free):
    scene, jitter = shown(name), jitter_of(name, 3)
    pipeline = vr.pipelines()[name].with_switches(stepping={"steps": 24})
    acceptance = vr.accept(scene, pipeline, "webgl-highp", None if free else jitter, 3)
    for switches in ({}, MEMBERS["all of it"]):
        image = vr.emulate(scene, pipeline, vr.Device("one", **switches), jitter, 3)
        assert how_far_outside(image, acceptance) <= 0


@pytest.mark.parametrize("name", NAMES)
def test_nothing_is_free_on_a_device_that_is_exact(name):
    scene, jitter = shown(name), jitter_of(name)
    acceptance = vr.accept(scene, name, "exact", jitter)
    assert how_far_outside(vr.emulate(scene, name, "exact", jitter), acceptance) <= 0
    if vr.pipelines()[name].accumulation.rule == "reversed-over":
        # The last sample lies in front, and an alpha that tends to 1 ends the ray: a rounding decides which.
        return
    assert np.array_equal(acceptance.lo, acceptance.hi)
    assert not acceptance.ambiguous.any()
    # Sums in another order: 1e-11 is some ten thousand roundings of numbers about 1.
    assert acceptance.width.max() <= 1e-11


def test_intervals_close_on_the_certified_truth_as_steps_are_halved():
    scene = dataclasses.replace(example(opacity=0.4), width=8, height=6)
    pipeline = widened(vr.pipelines()["texture3d"]).with_switches(stepping={"length": 1.0})
    truth = vr.render(limit_scene(scene, pipeline), tolerance=1e-5)
    away = []
    for times in (1, 2, 4, 8):
        program = refined(scene, pipeline, times)
        acceptance = vr.accept(scene, program, "exact")
        away.append(np.maximum(acceptance.raw_hi - truth.rgba, truth.rgba - acceptance.raw_lo).max())
    # The hull and the truth: each halving of the step halves what is between them at least, as kinks of field
    # and table lie anywhere in a step, and in the mean it is a quarter.
    assert away[-1] < 0.6 / 255
    assert away[0] / away[-1] > 16, away
    # A machine's own freedom is not a matter of steps: what is left is that, and it holds the truth's side.
    wide = vr.accept(scene, refined(scene, pipeline, 8), "webgl-highp")
    beyond = np.maximum(wide.raw_lo - truth.rgba, truth.rgba - wide.raw_hi).max()
    assert beyond <= away[-1]


def test_the_width_falls_with_what_a_machine_leaves_open():
    scene = shown("texture3d")
    widths = [
        vr.accept(scene, "texture3d", device).width.max()
        for device in (
            "exact",
            vr.Device("rounded"),
            vr.Device("free", freedom="khronos"),
            vr.Device("9 bits", freedom="khronos", weight_slack=2.0**-10),
            "webgl-highp",
        )
    ]
    assert widths == sorted(widths)
    assert widths[0] < 1e-11
    assert widths[3] < 0.7 * widths[4]


@pytest.mark.parametrize("values", ["float32", "float16"])
def test_intervals_of_a_machine_of_narrow_numbers_are_read_back_from_their_file(values, tmp_path):
    made = vr.accept(shown("texture3d"), "texture3d", vr.Device("narrow", values=values))
    vr.save_acceptance(made, tmp_path / "a.npz")
    assert np.array_equal(vr.load_acceptance(tmp_path / "a.npz").nominal, made.nominal)


def test_levels_of_a_table_are_refused_as_nothing_bounds_them():
    pipeline = vr.pipelines()["barbagallo"].with_switches(table={"filter": "linear-mipmap"})
    with pytest.raises(
        vr.SceneError, match=r"pipeline.table.filter must be one whose image has bounds, got a"
    ):
        vr.accept(shown("barbagallo"), pipeline)


@pytest.mark.parametrize("name", NAMES)
def test_unknown_grids_with_coordinates_in_bytes_are_said_to_be_of_no_use(name):
    rays = vr.pipelines()[name].rays
    useless = rays.kind == "coordinates" and rays.format == "unorm8"
    scene = dataclasses.replace(shown(name), width=4, height=3)
    advice = vr.accept(scene, name, "webgl-highp").advice
    assert ("unknown grid" in advice) == useless
    assert not useless or "volref probe" in advice
    known = vr.Device("known", freedom="khronos", weight_slack=2.0**-9, subpixel_bits=8)
    assert "unknown grid" not in vr.accept(scene, name, known).advice


# Numbers to try for switches that are not words; those of the others change nothing that counts.
NUMBERS = {
    "shift": 0.3,
    "brick": 4,
    "skipped": 2,
    "times": 1.5,
    "encodings": 2.0,
    "scale": 1.05,
    "gamma": 2.2,
    "opaque_at": 0.5,
    "cap": 8,
    "offset": 0.5,
    "discard_below": 0.1,
    "padding": 1,
    "factor": 1.7,
}

# Where each group of switches is tried.
TRIED = {
    "texture3d": (*GROUPS,),
    "arbelaz2016": ("rays", "meshes"),
    "barbagallo": ("volume", "table", "accumulation", "output"),
    "cej2020": ("lighting", "output"),
}


def other_programs():
    """Pipelines of the catalogue with one switch changed, to each other word or to a number."""
    for name, tried in TRIED.items():
        few = {"steps": 12} | ({"length": 1.8} if name == "texture3d" else {})
        pipeline = vr.pipelines()[name].with_switches(stepping=few)
        for group in tried:
            for switch in switches_of(GROUPS[group]):
                now = getattr(getattr(pipeline, group), switch.name)
                values = (not now,) if isinstance(switch.rule, Flag) else ()
                if isinstance(switch.rule, Word):
                    values = [word for word in switch.rule.choices if word != now]
                elif switch.name in NUMBERS:
                    values = (NUMBERS[switch.name],)
                for value in values:
                    label = f"{name} {group}.{switch.name} {value}"
                    yield label, name, pipeline.with_switches(**{group: {switch.name: value}})


def test_every_switch_is_known_to_accept_or_refused():
    device = vr.Device("one of them", values="float32")
    outside, refused, held = [], [], 0
    for label, name, pipeline in other_programs():
        scene, jitter = dataclasses.replace(shown(name), width=8, height=6), None
        if pipeline.stepping.jitter:
            jitter = np.full((1, 6, 8), 0.4)
        try:
            image = vr.emulate(scene, pipeline, device, jitter)
        except vr.SceneError:
            continue
        try:
            acceptance = vr.accept(scene, pipeline, device, jitter)
        except vr.SceneError:
            refused.append(label)
            continue
        held += 1
        if how_far_outside(image, acceptance) > 0:
            outside.append((label, how_far_outside(image, acceptance)))
    assert not outside
    # 80 of 110 or so: emulations refuse the rest, and intervals some of what has none.
    assert held > 80, held
    assert len(refused) < 14, refused
