"""Every switch of a pipeline and of a device does something: each of its values changes some target."""

from functools import cache

import numpy as np
import pytest

import volref as vr
from tests.emulation.scenes import HEIGHT, WIDTH, example, radar_example, scene_for
from volref.emulation.device import Device
from volref.emulation.passes import emulate
from volref.emulation.pipeline import GROUPS
from volref.emulation.switches import Flag, Word, switches_of

# Values of switches that are numbers, where their least one does not do.
NUMBERS = {
    "stepping.length": 0.04,
    "stepping.offset": 0.3,
    "stepping.cap": 7,
    "stepping.opaque_at": 0.3,
    "volume.tiles_across": 3,
    "stepping.skipped": 1,
    "volume.shift": 0.5,
    "volume.brick": 4,
    "volume.padding": 1,
    "table.shift": 0.5,
    "opacity.times": 0.5,
    "meshes.scale": 1.2,
    "table.rows": 8,
    "table.steepest": 30.0,
    "opacity.factor": 0.3,
    "opacity.by_gradient": 2.0,
    "lighting.factor": 0.5,
    "output.low": 0.2,
    "output.mid": 0.3,
    "output.high": 0.8,
    "output.saturation": 0.5,
    "output.gamma": 1.7,
    "output.encodings": 2.0,
    "output.discard_below": 0.4,
    "device.weight_bits": 5,
    "device.result_bits": 5,
    "device.nearest_bits": 5,
    "device.subpixel_bits": 2,
}

# What shows a switch where the page of seed 002 does not: a pipeline of the catalogue, other switches of it,
# a scene, and a device.
FLOAT = {"output": {"format": "exact"}}
SHOWN = {
    "rays.direction": ("texture3d", FLOAT, "plain"),
    "rays.front": ("congote2012", {}, "plain"),
    "rays.no_exit": ("congote2012", {}, "plain"),
    "rays.filter": ("barbagallo", FLOAT, "plain"),
    "stepping.advance": ("barbagallo", FLOAT, "plain"),
    "stepping.end": ("congote2012", FLOAT, "plain"),
    "stepping.end=count": ("barbagallo", FLOAT, "plain"),
    "stepping.rule=voxel-count": ("barbagallo", {"stepping": {"end": "count"}}, "plain"),
    "stepping.advance=parameter": ("congote2012", FLOAT, "plain"),
    "stepping.end=parameter": ("congote2012", {"stepping": {"advance": "parameter"}} | FLOAT, "plain"),
    "stepping.end=outside-above": ("congote2012", {"stepping": {"cap": 300}} | FLOAT, "plain"),
    "stepping.jitter": ("cej2020", {}, "plain"),
    "stepping.last_step": ("texture3d", {}, "plain"),
    "stepping.opaque_test": ("mpilia2018", {}, "plain"),
    "stepping.stopped": ("texture3d", {"stepping": {"opaque_at": 0.3}}, "plain"),
    "volume.first_tile": ("congote2012", {}, "plain"),
    "volume.geometry": ("congote2012-radar", {}, "radar"),
    "volume.rows": ("congote2012", {}, "plain"),
    "volume.seam": ("congote2012-radar", {}, "radar"),
    "volume.second_column": ("congote2012", {}, "plain"),
    "volume.second_slice": ("congote2012", {}, "plain"),
    "volume.tile_column": ("congote2012", {"volume": {"tiles_across": 3}} | FLOAT, "plain"),
    "volume.tile_row": ("congote2012", {}, "plain"),
    "table.last_column": ("texture3d", {"table": {"size": 8}}, "plain"),
    "table.opacity_format": ("texture3d", FLOAT, "plain"),
    "table.opacity_format=unorm8": ("texture3d", {"table": {"format": "exact"}}, "plain"),
    "table.rows": ("cej2020", {}, "edges"),
    "table.steepest": ("cej2020", {}, "edges"),
    "opacity.by_gradient": ("cej2020", {}, "plain"),
    "lighting.flat": ("cej2020", {}, "plain"),
    "lighting.gradient": ("texture3d", {"lighting": {"model": "lit"}}, "lit"),
    "meshes.kind=depth": ("congote2012", {}, "plain"),
    "lighting.model": ("cej2020", {}, "plain"),
    "lighting.space": ("cej2020", {}, "plain"),
    "lighting.normals": ("cej2020", {}, "plain"),
    "lighting.zero": ("cej2020", {}, "plain"),
    "accumulation.normalize": (
        "congote2012",
        {
            "accumulation": {"rule": "add-alpha"},
            "stepping": {"opaque_at": None},
            "opacity": {"rule": "as-is"},
        },
        "plain",
    ),
    "meshes.kind": ("texture3d", {}, "mesh"),
    "meshes.measure": ("texture3d", {}, "mesh"),
    "meshes.scale": ("texture3d", {}, "mesh"),
    **{
        f"meshes.{name}": ("arbelaz2016", {}, "mesh")
        for name in ("depth", "packing", "comparison", "composition", "format")
    },
    "output.tone_map": ("vpt-eam", {"output": {"low": 0.2}}, "plain"),
    **{f"output.{name}": ("vpt-eam", {}, "plain") for name in ("low", "mid", "high", "saturation")},
    "output.encodings": ("vpt-eam", {}, "plain"),
    "output.blend": ("barbagallo", {}, "background"),
    "output.missed": ("barbagallo", {}, "background"),
    "output.precision": ("barbagallo", {}, "plain", "llvmpipe"),
    "rays.format=exact": ("barbagallo", {}, "plain", "exact"),
    "device.angles": ("congote2012-radar", FLOAT, "radar"),
    "device.blend": ("congote2012", {}, "background"),
    "device.constant_divisor": ("congote2012", {"rays": {"format": "float"}} | FLOAT, "plain"),
    "device.control": ("barbagallo", FLOAT, "plain"),
    "device.depth_bits": ("arbelaz2016", {}, "tied"),
    "device.detail": ("barbagallo", {"table": {"filter": "linear-mipmap"}}, "plain"),
    "device.fragment_color": ("barbagallo", FLOAT, "plain"),
    "device.mix": ("vpt-eam", {"output": {"format": "float", "mean_format": "float"}}, "plain"),
    # Light beyond what 16 bits hold, times a weight of 0.
    "device.nan_stored": (
        "congote2012",
        {"lighting": {"factor": 1e9}},
        "plain",
        "mediump",
    ),
    "device.nearest_bits": ("texture3d", {"volume": {"filter": "nearest"}}, "plain"),
    "device.planes": ("congote2012", {"rays": {"format": "float"}}, "plain", "llvmpipe"),
    "device.srgb": ("vpt-eam", {}, "plain"),
    "device.subpixel_bits": ("congote2012", {}, "plain"),
}

# What says where a value lies in an uploaded image, and changes nothing that is drawn from it.
WITHOUT_EFFECT = {"volume.channel=alpha"}

# What a device leaves open to others of its set is for `accept`, which tests/oracle/test_accepting.py holds.
LEFT_OPEN = ("freedom", "weight_slack", "snap_slack", "store_slack", "blend_slack")

# Values of which the default, or they themselves, are refused with what shows them.
REFUSING = {
    "table.rows=8",
    "lighting.model=lit",
    "lighting.model=cej",
    "lighting.gradient=central",
    "lighting.gradient=forward",
    "lighting.gradient=sobel-bytes",
    "lighting.gradient=sobel-bytes-printed",
    "volume.geometry=spherical",
    "volume.geometry=spherical-printed",
    "meshes.kind=none",
}


def values_of(name, switch):
    """Return the values of a switch beside its default; of a number, one."""
    if isinstance(switch.rule, Word):
        every = [*switch.rule.choices, *([None] if switch.optional else [])]
        return [value for value in every if value != switch.default]
    if isinstance(switch.rule, Flag):
        return [not switch.default]
    return [NUMBERS.get(name, switch.rule.low)]


def cases(kinds):
    return [
        (f"{group}.{switch.name}", switch.default, value)
        for group, kind in kinds.items()
        for switch in switches_of(kind)
        for value in values_of(f"{group}.{switch.name}", switch)
    ]


@cache
def scene_named(name):
    if name == "radar":
        return radar_example()
    if name == "tied":
        # Two sheets through each other: near the line where they meet a depth of 16 bits is one.
        middle = np.array([5.5, 5.4, 4.5])
        sheet = np.array([(-9.0, -9.0, 0.0), (9.0, -9.0, 0.0), (9.0, 9.0, 0.0), (-9.0, 9.0, 0.0)])
        tilted = sheet + (0.0, 0.0, 1e-3) * np.sign(sheet)[:, :1]
        pair = [((0.9, 0.1, 0.1), sheet), ((0.1, 0.9, 0.1), tilted)]
        return example(meshes=[vr.Mesh(c + middle, [(0, 1, 2), (0, 2, 3)], color) for color, c in pair])
    if name != "edges":
        light = {"background": (0.2, 0.1, 0.3, 0.5)} if name == "background" else {}
        return example(mesh=name == "mesh", lit=name == "lit", **light)
    # Opacity and colour of value and gradient magnitude.
    value, magnitude = np.meshgrid(np.arange(16) / 15, np.arange(8) / 7)
    colors = np.stack([value, magnitude, 1 - value, 0.6 * value * np.sqrt(magnitude)], axis=-1)
    look, scene = vr.TransferFunction2D(colors, (0, 255), (0, 80), 2.0), example(lit=True)
    more = {"lights": scene.lights, "material": scene.material}
    return vr.Scene(scene.volume, look, scene.camera, WIDTH, HEIGHT, **more)


def drawn(scene, pipeline, device):
    jitter = np.random.default_rng(3).random((1, HEIGHT, WIDTH)) if pipeline.stepping.jitter else None
    try:
        out = emulate(scene, pipeline, device, jitter)
    except vr.SceneError:
        return None
    return {**out.passes, "samples": out.samples}


def differ(one, other):
    if one is None or other is None:
        return (one is None) != (other is None)
    same = one.keys() == other.keys()
    return not same or any(not np.array_equal(one[key], other[key], equal_nan=True) for key in one)


def setting(name, value):
    """Return the pipeline, the scene and the device that show a value of a switch."""
    usual = SHOWN.get(name, ("barbagallo", {}, "plain"))
    base, others, scene, *device = SHOWN.get(f"{name}={value}", usual)
    pipeline = vr.pipelines()[base].with_switches(**others)
    made = scene_for(base) if scene == "plain" else scene_named(scene)
    return pipeline, made, Device.named(device[0] if device else "ideal")


@pytest.mark.parametrize(("name", "default", "value"), cases(GROUPS))
def test_every_value_of_a_switch_changes_what_is_drawn(name, default, value):
    pipeline, scene, device = setting(name, value)
    group, _, word = name.partition(".")
    pair = [drawn(scene, pipeline.with_switches(**{group: {word: one}}), device) for one in (default, value)]
    if f"{name}={value}" not in REFUSING:
        assert None not in pair
    assert differ(*pair) == (f"{name}={value}" not in WITHOUT_EFFECT)


DEVICE_CASES = [case for case in cases({"device": Device}) if case[0].split(".")[1] not in LEFT_OPEN]


@pytest.mark.parametrize(("name", "default", "value"), DEVICE_CASES)
def test_every_value_of_a_device_changes_what_is_drawn(name, default, value):
    pipeline, scene, device = setting(name, value)
    word = name.partition(".")[2]
    switches = device.as_dict()
    pair = [drawn(scene, pipeline, Device(**switches | {word: one})) for one in (default, value)]
    assert None not in pair
    assert differ(*pair) == (f"{name}={value}" not in WITHOUT_EFFECT)


def test_the_two_spherical_geometries_differ():
    pipeline, scene, device = setting("volume.geometry", "spherical")
    kinds = ("spherical", "spherical-printed")
    assert differ(*(drawn(scene, pipeline.with_switches(volume={"geometry": one}), device) for one in kinds))
