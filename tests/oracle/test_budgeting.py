"""Budgets: the source that was made coarse is named first, and figures are those of images drawn by hand."""

import dataclasses

import numpy as np
import pytest

import volref as vr
from tests.emulation.scenes import example, scene_for
from volref.oracle.budgeting import Source, Spread, message_of
from volref.oracle.ideals import CAUSES, Drawn, machine_of, without

WIDTH, HEIGHT = 12, 9

# All sources fine: what is coarse is said in each test.
FINE = vr.pipelines()["texture3d"].with_switches(
    table={"size": 2048, "format": "float"},
    volume={"format": "float"},
    stepping={"length": 0.2, "opaque_at": None},
    output={"format": "float"},
)


def shown(**more):
    return dataclasses.replace(example(**more), width=WIDTH, height=HEIGHT)


COARSE = {
    "step length": ({"stepping": {"length": 2.0}}, {}),
    "table size": ({"table": {"size": 8}}, {}),
    "volume format": ({"volume": {"format": "unorm8"}}, {}),
    "canvas format": ({"output": {"format": "unorm8"}}, {}),
    "early end": ({"stepping": {"opaque_at": 0.5}}, {}),
    "arithmetic": ({}, {"values": "float16"}),
}


@pytest.mark.parametrize("name", COARSE)
def test_what_was_made_coarse_is_what_to_change_first(name):
    switches, device = COARSE[name]
    found = vr.budget(shown(), FINE.with_switches(None, **switches), vr.Device("one", **device))
    assert found.sources[0].name == name
    assert found.sources[0].floor.p99 > 4 * max((one.floor.p99 for one in found.sources[1:]), default=0)


def test_a_table_of_bytes_comes_first_where_all_else_is_finer():
    found = vr.budget(shown(), FINE.with_switches(table={"format": "unorm8"}))
    assert found.sources[0].name == "table format"


def test_a_coarse_filter_counts_though_floats_would_not_be_filtered_so():
    bytes_ = {"table": {"format": "unorm8"}, "volume": {"format": "unorm8"}}
    found = vr.budget(shown(), FINE.with_switches(None, **bytes_), vr.Device("one", weight_bits=1))
    sources = {one.name: one for one in found.sources}
    assert sources["filter"].now == "weights of 1 bit"
    assert sources["filter"].floor.p99 > 1


def test_coordinates_and_depths_in_bytes_are_named_where_they_are_coarse():
    scene = dataclasses.replace(scene_for("arbelaz2016"), width=WIDTH, height=HEIGHT)
    fine = {"volume": {"format": "float"}, "table": {"format": "float"}, "output": {"format": "float"}}
    pipeline = vr.pipelines()["arbelaz2016"].with_switches(stepping={"steps": 60}, **fine)
    names = [one.name for one in vr.budget(scene, pipeline, "swiftshader").sources]
    assert {"coordinate format", "mesh format", "window grid"} < set(names)
    assert names.index("coordinate format") < names.index("arithmetic")


def test_the_distance_is_that_of_the_emulation_from_the_certified_truth():
    scene = shown(background=(0.1, 0.2, 0.3, 1.0))
    found = vr.budget(scene, "texture3d", "swiftshader")
    machine = machine_of(vr.Device.named("swiftshader"))
    truth = vr.render(scene, tolerance=0.1 / 255).rgba
    image = vr.emulate(scene, "texture3d", machine).rgba
    apart = 255 * np.abs(image - truth).max(axis=-1)
    drawn = (np.abs(truth - scene.background).max(axis=-1) > 0) | (
        np.abs(image - scene.background).max(axis=-1) > 0
    )
    assert found.distance == Spread(*np.percentile(apart[drawn], [50, 99]), apart.max())
    # Steps an eighth as long leave 1/64 of an error of order 2; the truth is one to 0.1.
    assert found.itself.largest < 0.3


def test_a_gain_is_the_change_by_one_source_and_a_floor_what_it_leaves_alone():
    scene, device = shown(), vr.Device("one", values="float32")
    pipeline = FINE.with_switches(table={"size": 16})
    found = {one.name: one for one in vr.budget(scene, pipeline, device).sources}["table size"]
    finer = pipeline.with_switches(table={"size": 4096})
    gain = 255 * np.abs(vr.emulate(scene, finer, device).rgba - vr.emulate(scene, pipeline, device).rgba)
    assert found.gain.largest == pytest.approx(gain.max(), abs=1e-9)
    exact = {"stepping": {"length": 0.025}, "output": {"format": "exact"}}
    ideal = [
        vr.emulate(scene, FINE.with_switches(None, table={"size": size}, **exact), "exact").rgba
        for size in (16, 4096)
    ]
    # Tables of floats against exact ones: a rounding of float32 in the table, a step that float32 divides.
    assert found.floor.largest == pytest.approx(255 * np.abs(ideal[0] - ideal[1]).max(), abs=1e-3)


def test_where_nothing_is_coarse_nothing_is_to_be_changed():
    found = vr.budget(shown(), FINE, "exact")
    assert found.message.endswith("there is nothing to change.")
    assert {one.name for one in found.sources} == {"step length", "table size"}


def test_a_program_of_other_formulas_is_said_to_be_the_matter():
    scene = dataclasses.replace(scene_for("x3dom"), width=WIDTH, height=HEIGHT)
    found = vr.budget(scene, "x3dom")
    assert found.itself.p99 > found.sources[0].floor.p99
    assert "that is the program's own" in found.message


def test_a_source_that_cannot_be_ideal_is_left_out_with_its_reason():
    pipeline = FINE.with_switches(opacity={"rule": "as-is", "factor": 0.3})
    found = vr.budget(shown(), pipeline)
    assert "pipeline.opacity.factor must be 1" in found.left_out["step length"]
    assert "step length" not in {one.name for one in found.sources}


def test_bytes_cut_off_what_no_canvas_could_show():
    scene = dataclasses.replace(scene_for("barbagallo-article"), width=6, height=5)
    pipeline = vr.pipelines()["barbagallo-article"].with_switches(stepping={"steps": 30})
    found = vr.budget(scene, pipeline)
    assert all(one.floor.largest <= 255 and one.gain.largest <= 255 for one in found.sources)
    # Of a sum that is no *over*, the alpha that ends a ray is part of the formula.
    assert "early end" not in {one.name for one in found.sources}


@pytest.mark.parametrize("name", sorted(vr.pipelines()))
def test_a_program_without_its_sources_has_none(name):
    scene = scene_for(name)
    drawn = Drawn(scene, vr.pipelines()[name], machine_of(vr.Device.named("webgl-highp")))
    able = []
    for cause in CAUSES:
        if cause.now(drawn):
            without(drawn, (cause,))
            able.append(cause)
    left = [cause.name for cause in CAUSES if cause.now(without(drawn, tuple(able)))]
    assert set(left) <= {"step length", "table size"}


def test_messages_name_the_first_source_or_the_program():
    little, some, much = Spread(0.1, 0.2, 0.3), Spread(1.0, 3.1, 4.0), Spread(5.0, 40.0, 60.0)
    table = Source("table size", "32 entries", some, some)
    assert "Of the rest the table size (32 entries) makes most, 3.1/255." in message_of(much, much, (table,))
    assert message_of(much, much, ()).endswith("no bits or steps will help.")
    assert "nothing to change" in message_of(little, little, ())
