"""The way along a ray: a loop in float32 whose ends and operations are off stays where it is said to."""

import dataclasses

import numpy as np
import pytest

import volref as vr
from tests.emulation.scenes import example
from volref.emulation.drawing import prepare
from volref.oracle.intervals import walking
from volref.oracle.intervals.casting import cast
from volref.oracle.intervals.finding import Finder
from volref.oracle.intervals.slack import slack_of
from volref.oracle.intervals.walking import Course, Pair, around, opaque
from volref.oracle.intervals.walks import walks_of

STEPS, MEMBERS = 16, 8
F = np.float32
UNIT = 2.0**-24

# How a machine may round: correctly, or (khronos) a division and a root with 2.5 units in the last place.
FREEDOMS = ("rounded", "khronos")

RULES = {
    "add, a count": {"rule": "count", "steps": STEPS, "advance": "add", "end": "count"},
    "add, until outside": {"rule": "texture-length", "steps": STEPS, "advance": "add", "end": "outside"},
    "add, a length left": {"rule": "texture-length", "steps": STEPS, "advance": "add", "end": "length-left"},
    "a parameter": {"rule": "count", "steps": STEPS, "advance": "parameter", "end": "parameter"},
    "multiplied, a count": {"rule": "count", "steps": STEPS, "advance": "multiply", "end": "count"},
    "multiplied, a length": {"rule": "world-length", "length": 0.7, "end": "length-before"},
    "multiplied, whole steps": {
        "rule": "world-length",
        "length": 0.7,
        "end": "length-before",
        "last_step": "dropped",
    },
    "samples per voxel": {"rule": "voxel-count", "length": 0.8, "advance": "multiply", "end": "count"},
    "a length, after": {"rule": "texture-length", "steps": STEPS, "advance": "add", "end": "length-after"},
}


def along_z(scene):
    """The scene seen along z: its rays are a whole number of steps long, which roundings decide on."""
    middle = scene.volume.corners.mean(axis=0)
    camera = vr.Camera.orthographic(middle + np.array((0, 0, 30.0)), middle, (0, 1, 0), 9.0, 1.0, 60.0)
    return dataclasses.replace(scene, camera=camera)


def course_of(rule, freedom, *, aligned=False):
    """The course of a small scene's rays by a rule of stepping."""
    scene = dataclasses.replace(example(), width=5, height=4)
    scene = along_z(scene) if aligned else scene
    changes = {"offset": 0.5, "opaque_at": None, "last_step": "whole"} | RULES[rule]
    if aligned and "length" in changes:
        # 11 voxels of .9: so many steps, of a length that float32 does not have.
        changes["length"] = 0.5 if changes["rule"] == "voxel-count" else 0.45
    if aligned and "texture" in changes["rule"]:
        changes["steps"] = 11
    pipeline = vr.pipelines()["texture3d"].with_switches(stepping=changes, meshes={"kind": "none"})
    drawing = prepare(scene, pipeline, vr.Device("one", freedom=freedom))
    slack = slack_of(drawing.device)
    found = cast(drawing, slack).rays
    walks = walks_of(found, drawing, slack)
    drawing = dataclasses.replace(drawing, ends=found.ends, paths=walks.paths)
    start = np.full(len(found.pixel), 0.5, F)
    return Course(drawing, Finder(drawing.textures, slack), found, walks, Pair(start, start))


def off(rng, number, units):
    """A float32 that is up to so many units beside the number; 0 and 1 units: as it is rounded."""
    if units <= 1:
        return number
    return number * (1 + rng.choice([-1.0, 0.0, 1.0]) * units * UNIT)


def rounded(number):
    return np.asarray(number, F).astype(np.float64)


def moved_ends(rng, course, ray):
    """Entry and exit in float32 of a machine: moved along their line and beside it as far as they may be."""
    ends, rays = course.rays.ends, course.rays
    entry, leave = (one[:, ray].astype(np.float64) for one in (ends.entry, ends.exit))
    way = (leave - entry) / max(np.linalg.norm(leave - entry), 1e-12)
    beside = rng.choice([-1.0, 0.0, 1.0], 3)
    # 0.7: the offs are those of each coordinate, of the larger of both ends.
    entry = entry + 0.7 * rays.entry_off[ray] * beside * 0.5
    leave = leave + 0.7 * rays.exit_off[ray] * (beside * 0.5 + way * rng.choice([-0.5, 0.0, 0.5]))
    return rounded(entry), rounded(leave)


def machine_walk(rng, course, ray):
    """Yield position, end before and end after of each iteration: a shader's loop, operation by operation."""
    stepping, scene = course.drawing.pipeline.stepping, course.drawing.scene
    bad = 5 if course.drawing.device.freedom == "khronos" else 1
    entry, leave = moved_ends(rng, course, ray)
    way = rounded(leave - entry)
    box = course.drawing.box.world_from_texture[:3, :3]
    world = stepping.rule == "world-length"
    measured = box @ way if world else way
    length = rounded(off(rng, np.sqrt(rounded(np.sum(rounded(measured * measured)))), bad))
    count = stepping.steps
    if stepping.rule == "count":
        delta = rounded(off(rng, way / count, bad))
        step, length = rounded(1 / count), 1.0
    elif stepping.rule == "voxel-count":
        voxels = np.linalg.norm(way * np.array(scene.volume.size))
        count = int(rounded(off(rng, rounded(voxels), bad) / stepping.length) + 0.5)
        delta = rounded(off(rng, way / max(count, 1), bad))
        step = 1.0
    else:
        step = rounded(stepping.length or 1.0 / stepping.steps)
        delta = rounded(rounded(off(rng, way / length, bad)) * step)
    after = stepping.end == "length-after"
    walked = length if stepping.end == "length-left" else 0.0
    if stepping.advance == "parameter":
        walked = rounded(step * 0.5)
    if after:
        step = rounded(np.sqrt(rounded(np.sum(rounded(delta * delta)))))
    position = rounded(entry + rounded(delta * 0.5)) if stepping.advance == "add" else entry
    for number in range(2 * STEPS):
        before = {
            "count": number >= count,
            "parameter": not walked < 1,
            "length-left": not walked > 0,
            "length-before": not rounded(number * step) < length
            if stepping.last_step != "dropped"
            else rounded(rounded(number * step) + step) > length,
        }.get(stepping.end, False)
        if stepping.advance == "parameter":
            position = rounded(entry + rounded(way * walked))
        elif stepping.advance == "multiply":
            position = rounded(entry + rounded(delta * rounded(number + 0.5)))
        here = position
        if stepping.advance == "add":
            position = rounded(position + delta)
        if stepping.end == "length-left":
            walked = rounded(walked - step)
        elif after or stepping.advance == "parameter":
            walked = rounded(walked + step)
        outside = bool(np.any((position > 1) | (position < 0)))
        yield here, before, {"outside": outside, "length-after": walked >= length}.get(stepping.end, False)


def predicted(course):
    """Positions, radii and three-valued ends of each iteration of all rays, as the intervals have them."""
    ray = np.arange(len(course.rays.pixel))
    walk = walking.begun(course, ray)
    found = []
    with np.errstate(all="ignore"):
        for number in range(2 * STEPS):
            before = walking.ended_before(course, walk, number)
            position, radius, _ = walking.place_of(course, walk, number)
            sampled = walk.position
            walking.advanced(course, walk)
            found.append((position, radius, before, walking.own_end_after(course, walk, sampled)))
    return found


@pytest.mark.parametrize("aligned", [False, True])
@pytest.mark.parametrize("freedom", FREEDOMS)
@pytest.mark.parametrize("rule", RULES)
def test_a_loop_stays_in_its_radius_and_no_end_is_missed(rule, freedom, aligned):
    course, rng = course_of(rule, freedom, aligned=aligned), np.random.default_rng(2)
    expected = predicted(course)
    long_enough = np.flatnonzero(course.walks.relative < 0.01)
    assert len(long_enough) > 5
    for ray in long_enough:
        for _ in range(MEMBERS):
            loop = zip(machine_walk(rng, course, ray), expected, strict=True)
            for (here, ends, ends_after), (position, radius, before, after) in loop:
                for said, test in ((ends, before), (ends_after, after)):
                    assert not said or test.maybe[ray]
                    assert said or not test.sure[ray]
                if ends:
                    break
                assert np.abs(here - position[:, ray]).max() <= radius[ray]
                if ends_after:
                    break


@pytest.mark.parametrize("rule", [rule for rule in RULES if rule != "samples per voxel"])
def test_radii_are_millionths_and_most_ends_are_known(rule):
    course = course_of(rule, "rounded")
    found, inside = predicted(course), course.walks.relative < 1e-4
    # A byte is 4e-3, a voxel of 11 a tenth: of the steepest ramp, a quarter of a byte.
    assert max(radius[inside].max() for _, radius, _, _ in found[: STEPS // 2]) < 1e-4
    unsure = [(test.maybe & ~test.sure)[inside].mean() for _, _, *tests in found for test in tests]
    assert np.mean(unsure) < 0.05


def test_pairs_hold_the_number_and_nothing_else_where_nothing_is_off():
    numbers = np.array([0.0, 0.1, 0.7, -3.0], F)
    exact = around(numbers, np.zeros(4))
    assert np.array_equal(exact.low, numbers)
    assert np.array_equal(exact.high, numbers)
    wide = around(numbers, np.full(4, 1e-6))
    assert (wide.low < numbers - 0.9e-6).all()
    assert (wide.high > numbers + 0.9e-6).all()
    assert wide.low.dtype == F


def test_sums_of_pairs_keep_the_order_that_rounding_keeps():
    rng = np.random.default_rng(3)
    low = rng.random(200).astype(F)
    pair, step = Pair(low, np.nextafter(low, F(2))), F(0.0123)
    inside = np.where(rng.random(200) < 0.5, pair.low, pair.high)
    for _ in range(500):
        pair, inside = pair.plus(Pair(step, step)), inside + step
    assert (pair.low <= inside).all()
    assert (inside <= pair.high).all()
    # One unit in the last place of what has grown to 7: pairs stay pairs.
    assert (pair.high - pair.low).max() <= 2.0**-21


def test_an_alpha_near_its_threshold_may_end_a_ray_or_not():
    course = course_of("a parameter", "rounded")
    u = 2.0**-24
    alpha = np.array([0.5, 0.95 - 100 * u, 0.95 - 10 * u, 0.95, 0.95 + 10 * u, 0.95 + 100 * u])
    test = opaque(course, Pair(alpha, alpha), 0.95)
    assert test.sure.tolist() == [False, False, False, False, False, True]
    assert test.maybe.tolist() == [False, False, True, True, True, True]
