"""Rasterised faces in float32: window positions, varyings and bytes lie where they are said to."""

import dataclasses

import numpy as np
import pytest

import volref as vr
from tests.emulation.scenes import example
from volref.emulation.drawing import prepare
from volref.emulation.rays.box import CORNERS
from volref.emulation.rays.entering import faces
from volref.oracle.intervals.casting import cast
from volref.oracle.intervals.faces import shifted, varying_error, window_error
from volref.oracle.intervals.slack import slack_of

F = np.float32
PROGRAM = vr.pipelines()["congote2012"]
FLOATS = PROGRAM.with_switches(rays={"format": "float"})


def drawing_of(pipeline=PROGRAM, width=14, height=11, **switches):
    scene = dataclasses.replace(example(), width=width, height=height)
    return prepare(scene, pipeline, vr.Device("one", **switches))


def window_in_float32(scene, box, rng):
    """Window positions (8, 2) of the box's corners, each product and sum rounded, in any order."""
    matrix = scene.camera.clip_from_view(scene.width, scene.height) @ scene.camera.view_from_world
    world = (np.c_[CORNERS, np.ones(8)] @ box.world_from_texture.T).astype(F)
    clip = np.empty((8, 4), F)
    for k, row in enumerate(matrix.astype(F)):
        total = np.zeros(8, F)
        for axis in rng.permutation(4):
            total = np.asarray(row[axis] * world[:, axis] + total, F)
        clip[:, k] = total
    ndc = np.asarray(clip[:, :2] / clip[:, 3:], F)
    return np.asarray((ndc * F(0.5) + F(0.5)) * np.array([scene.width, scene.height], F), np.float64)


def test_window_positions_in_float32_are_off_by_no_more_than_is_said():
    drawing = drawing_of()
    said = window_error(drawing, slack_of(drawing.device))
    clip = drawing.box.clip_corners
    exact = (clip[:, :2] / clip[:, 3:] + 1) / 2 * np.array([14, 11])
    worst = 0.0
    for seed in range(100):
        worst = max(
            worst,
            np.abs(window_in_float32(drawing.scene, drawing.box, np.random.default_rng(seed)) - exact).max(),
        )
    assert 0.02 * said < worst <= said


@pytest.mark.parametrize("cull", ["back", "front"])
def test_varyings_in_float32_are_off_by_no_more_than_is_said(cull):
    # A GPU's way: plane equations of 1 / w and of the attributes over w through three corners, in float32.
    drawing = drawing_of(FLOATS)
    scene, box = drawing.scene, drawing.box
    found = faces(scene, box, drawing.device, cull)
    said = varying_error(drawing, found.pixel, slack_of(drawing.device))
    clip = box.clip_corners
    w = clip[:, 3]
    window = np.asarray((clip[:, :2] / w[:, None] + 1) / 2 * np.array([scene.width, scene.height]), F)
    inverse = np.asarray(1 / w, F)
    column, row = found.pixel % scene.width + F(0.5), scene.height - found.pixel // scene.width - F(0.5)
    worst = np.zeros(len(found.pixel))
    for start in range(3):
        which = np.roll(box.triangles[found.triangle], start, axis=1)
        x, y = (window[which, axis] for axis in (0, 1))
        dx1, dx2 = (np.asarray(x[:, k] - x[:, 0], F) for k in (1, 2))
        dy1, dy2 = (np.asarray(y[:, k] - y[:, 0], F) for k in (1, 2))
        area = np.asarray(dx1 * dy2 - dx2 * dy1, F)
        away = np.asarray(column - x[:, 0], F), np.asarray(row - y[:, 0], F)

        def plane(values, dx1=dx1, dx2=dx2, dy1=dy1, dy2=dy2, area=area, away=away):
            one, two = (np.asarray(values[:, k] - values[:, 0], F) for k in (1, 2))
            across = np.asarray((one * dy2 - two * dy1) / area, F)
            up = np.asarray((two * dx1 - one * dx2) / area, F)
            return np.asarray(values[:, 0] + across * away[0] + up * away[1], F)

        over = plane(inverse[which])
        for axis in range(3):
            attribute = np.asarray(CORNERS[which, axis] * inverse[which], F)
            varying = np.asarray(plane(attribute) / over, F)
            worst = np.maximum(worst, np.abs(varying - found.varyings[axis]))
    # A pixel at the very edge of a face may be taken for one of the next face: those have other planes.
    assert (worst <= said).mean() > 0.97, np.sort(worst / said)[-5:]
    assert worst.max() > 0.05 * np.median(said)


@pytest.mark.parametrize("move", [(1.0, 1.0), (-1.0, 0.4), (0.3, -1.0), (-1.0, -1.0), (0.0, 0.8)])
def test_a_window_that_is_off_casts_rays_that_are_known(move):
    drawing = drawing_of(FLOATS, width=28, height=22, snap_slack=2.0**-9, freedom="khronos")
    slack = slack_of(drawing.device)
    found = cast(drawing, slack)
    reach = window_error(drawing, slack) + drawing.device.snap_slack
    moved = shifted(drawing.scene, move[0] * reach, move[1] * reach)
    other = prepare(moved, FLOATS, vr.Device())
    one_of_them = np.zeros(28 * 22, np.bool_)
    one_of_them[found.rays.pixel] = True
    assert one_of_them[other.ends.pixel].all(), "a pixel that is covered has a ray"
    uncovered = np.ones(28 * 22, np.bool_)
    uncovered[other.ends.pixel] = False
    assert found.missing[uncovered & one_of_them].all(), "one that is not may go without"
    for at, pixel in enumerate(other.ends.pixel):
        candidates = np.flatnonzero(found.rays.pixel == pixel)
        apart = [
            np.maximum(
                np.abs(found.rays.ends.entry[:, k] - other.ends.entry[:, at]).max() - found.rays.entry_off[k],
                np.abs(found.rays.ends.exit[:, k] - other.ends.exit[:, at]).max() - found.rays.exit_off[k],
            )
            for k in candidates
        ]
        assert min(apart) <= 0


def test_bytes_of_coordinates_near_the_middle_of_two_are_both_tried():
    drawing = drawing_of(width=40, height=30)
    found = cast(drawing, slack_of(drawing.device))
    varyings = faces(drawing.scene, drawing.box, drawing.device, "back").varyings
    exact = 255 * varyings
    near = np.abs(exact - np.floor(exact) - 0.5) < 1e-9
    counts = np.bincount(found.rays.pixel, minlength=1200)
    several = counts[faces(drawing.scene, drawing.box, drawing.device, "back").pixel] > 1
    assert several[near.any(axis=0)].all()
    # Codes are whole numbers of 255ths, on every ray.
    codes = 255 * found.rays.ends.entry.astype(np.float64)
    assert np.abs(codes - np.rint(codes)).max() < 1e-4


def test_a_device_that_leaves_nothing_free_casts_one_ray_for_each_pixel():
    scene = dataclasses.replace(example(), width=20, height=15)
    drawing = prepare(scene, PROGRAM, vr.Device.named("exact"))
    found = cast(drawing, slack_of(drawing.device))
    assert np.array_equal(np.sort(found.rays.pixel), np.sort(drawing.ends.pixel))
    assert not found.missing.any()
    assert not found.shaky.any()
    assert found.rays.entry_off.max() == 0
