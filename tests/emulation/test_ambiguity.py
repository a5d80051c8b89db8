"""Pixels that hang on a comparison are found in advance, and those that do not are left."""

import numpy as np
import pytest

from tests.emulation.scenes import example
from volref import Camera, Pipeline, Scene, TransferFunction, Volume
from volref.emulation.ambiguity import NUDGE, ambiguous

COUNT = {"rule": "count", "steps": 10, "end": "count"}


def cube(opacity=0.4, values=None, camera=None, size=(1, 1), unit_distance=1.0):
    """The unit cube; one pixel that looks along z through its middle."""
    volume = np.full((4, 4, 4), 255, np.uint8) if values is None else values
    counts = np.array(volume.shape[::-1])
    spacing = 1 / counts
    looked = camera or Camera.orthographic((0.5, 0.5, 3), (0.5, 0.5, 0.5), (0, 1, 0), 0.2, 1, 9)
    transfer = TransferFunction.from_opacity([0, 255], [(1, 1, 1)] * 2, [opacity] * 2, unit_distance)
    return Scene(Volume(volume, spacing=spacing, origin=spacing / 2), transfer, looked, *size)


def program(stepping=COUNT, **groups):
    return Pipeline("p").with_switches(stepping=stepping, **groups)


def test_a_smooth_pixel_does_not_hang_on_anything():
    assert not ambiguous(cube(), program()).any()


@pytest.mark.parametrize(("off", "hangs"), [(0.0, True), (NUDGE / 2, True), (1e-4, False), (-1e-4, False)])
def test_an_alpha_at_its_threshold_is_found(off, hangs):
    # Halves add up to 3/4 exactly after two samples; the third, were it taken, adds an eighth.
    halves = {"opacity": {"rule": "as-is"}, "table": {"format": "exact"}}
    at = program({**COUNT, "opaque_at": 0.75 + off}, **halves)
    assert ambiguous(cube(0.5), at).all() == hangs


OBLIQUE = Camera.orthographic((0.7, 0.9, 3.0), (0.5, 0.5, 0.5), (0, 1, 0), 0.3, 1, 9)
CHORD = float(np.linalg.norm((0.2, 0.4, 2.5)) / 2.5)
AT_THE_EXIT = [
    {"rule": "world-length", "length": CHORD / 7, "last_step": "whole"},
    {"rule": "world-length", "length": CHORD / 7, "last_step": "dropped"},
    {"rule": "texture-length", "length": CHORD / 7, "end": "length-after", "advance": "add"},
    {"rule": "texture-length", "length": CHORD / 7, "end": "length-left", "advance": "add"},
    {"rule": "texture-length", "length": CHORD / 7, "end": "outside", "advance": "add"},
    {"rule": "voxel-count", "length": 4 * CHORD / 6.5, "end": "count"},
]


@pytest.mark.parametrize("stepping", AT_THE_EXIT, ids=lambda s: "-".join(map(str, s.values())))
def test_an_exit_at_the_end_of_a_step_is_found_between_parallel_faces_too(stepping):
    # All rays are as long as 7 steps: it is float32's rounding whether there is one more.  (As many voxels as
    # 6.5 samples of the last program.)
    shown = cube(0.5, camera=OBLIQUE, size=(4, 3))
    as_is = {"opacity": {"rule": "as-is"}}
    assert ambiguous(shown, program(stepping, **as_is)).all()
    shorter = stepping | {"length": stepping["length"] * 1.01}
    assert not ambiguous(shown, program(shorter, **as_is)).any()


def test_a_last_step_that_is_as_short_as_what_is_left_does_not_hang_on_the_exit():
    stepping = {"rule": "world-length", "length": CHORD / 7, "last_step": "partial"}
    assert not ambiguous(cube(0.5, camera=OBLIQUE, size=(4, 3)), program(stepping)).any()


@pytest.mark.parametrize("threshold", [0.0, 2.0])
def test_thresholds_at_the_ends_of_what_they_may_be_are_nudged_as_far_as_they_may(threshold):
    assert not ambiguous(cube(), program({**COUNT, "opaque_at": threshold})).any()


def test_the_edge_of_a_box_through_a_pixels_centre_is_found_and_its_neighbours_are_not():
    # Pixels 0.1 wide, from x = 0.05 to 0.95: the cube's edge x = 0 goes through the first one's centre.
    camera = Camera.orthographic((0.45, 0.5, 3), (0.45, 0.5, 0.5), (0, 1, 0), 0.1, 1, 9)
    shown = cube(camera=camera, size=(10, 1))
    for rays in ({}, {"kind": "coordinates"}, {"kind": "front-face"}):
        found = ambiguous(shown, program(rays=rays))
        assert found.tolist() == [[True] + [False] * 9], rays


def test_a_ray_without_a_length_is_found_whatever_is_drawn_there():
    # Seen from the side: pixel centres on the face y = 0 of a cube that begins there.
    camera = Camera.orthographic((0.5, 0.0, 3), (0.5, 0.0, 0.5), (0, 1, 0), 0.2, 1, 9)
    assert ambiguous(cube(camera=camera), program()).all()


def test_a_coordinate_half_way_between_two_bytes_is_found():
    # A ray along z at x = y = 100.5 / 255: which byte that is, is rounding.  The volume has a slope there.
    values = np.zeros((1, 1, 256), np.uint8)
    values[..., 101:] = 255
    tie, beside = 100.5 / 255, 100.8 / 255

    def drawn(x):
        camera = Camera.orthographic((x, tie, 3), (x, tie, 0.5), (0, 1, 0), 1e-3, 1, 9)
        shown = cube(values=values, camera=camera)
        transfer = TransferFunction.from_opacity([0, 255], [(1, 1, 1)] * 2, [0, 0.9])
        shown = Scene(shown.volume, transfer, camera, 1, 1)
        return ambiguous(shown, program(rays={"kind": "coordinates", "format": "unorm8"}))

    assert drawn(tie).all()
    assert not drawn(beside).any()


def test_a_canvas_of_bytes_is_looked_at_before_it_is_rounded():
    # A colour half-way between two bytes is no comparison: both are right within half a step.
    half = {"opacity": {"rule": "as-is"}, "table": {"format": "exact"}, "output": {"format": "unorm8"}}
    shown = cube(100.5 / 255)
    assert not ambiguous(shown, program({**COUNT, "steps": 1}, **half)).any()


def test_a_mean_of_bytes_is_looked_at_as_bytes_too():
    output = {"format": "unorm8", "mean_format": "unorm8"}
    shown = example()
    found = ambiguous(shown, program({**COUNT, "jitter": True}, output=output), frames=2)
    assert found.shape == (shown.height, shown.width)
    assert found.mean() < 0.2


def slope(opacity):
    """One pixel that looks through x = 1/2 of a ramp of opacity from 0 to `opacity`, white."""
    values = np.zeros((2, 2, 2), np.uint8)
    values[..., 1] = 255
    shown = cube(values=values)
    transfer = TransferFunction.from_opacity([0, 255], [(1, 1, 1)] * 2, [0, opacity])
    return Scene(shown.volume, transfer, shown.camera, 1, 1)


ONE_SAMPLE = {
    "stepping": {**COUNT, "steps": 1},
    "opacity": {"rule": "as-is"},
    "table": {"format": "exact", "coordinate": "centered", "baked": "ends"},
}


def test_a_byte_of_the_canvas_that_may_be_either_of_two_hangs_on_nothing():
    # 127.5 of 255: a nudge makes it 127 or 128, both half a step beside the colour.
    assert not ambiguous(slope(1.0), program(**ONE_SAMPLE, output={"format": "unorm8"})).any()


@pytest.mark.parametrize(("share", "hangs"), [(1.0, True), (0.8, False)])
def test_a_byte_of_a_mean_that_may_be_black_or_not_is_found_where_a_gamma_makes_it_visible(share, hangs):
    # 0.5 of 255: byte 0 or 1, which a gamma of 2.2 makes 0 or 21.
    output = {"format": "unorm8", "mean_format": "unorm8", "gamma": 2.2}
    assert ambiguous(slope(share / 255), program(**ONE_SAMPLE, output=output)).all() == hangs


@pytest.mark.parametrize(("before", "hangs"), [(2.0**-21, True), (2.0**-12, False)])
def test_a_ray_that_is_next_to_nothing_is_found_though_nothing_is_seen_of_it(before, hangs):
    camera = Camera.look_at((0.5, 0.5, before), (0.5, 0.5, -1), (0, 1, 0), 10, 0.1, 9)
    assert ambiguous(cube(0.0, camera=camera), program()).all() == hangs
