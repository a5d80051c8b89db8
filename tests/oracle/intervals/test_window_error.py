"""How far window positions may be off where no corner is on the screen."""

import numpy as np

import volref as vr
from volref.emulation.catalogue import named
from volref.emulation.device import Device
from volref.emulation.drawing import prepare
from volref.oracle.intervals.faces import window_error
from volref.oracle.intervals.slack import slack_of


def error_from(eye, target, fov):
    volume = vr.Volume(np.full((6, 6, 6), 200, np.uint8))
    look = vr.TransferFunction.from_opacity([0, 255], [(1, 1, 1)] * 2, [0, 0.5])
    camera = vr.Camera.look_at(eye, target, (0, 1, 0), fov, 0.5, 60)
    scene, device = vr.Scene(volume, look, camera, 5, 5), Device.named("swiftshader")
    return window_error(prepare(scene, named("congote2012"), device), slack_of(device))


def test_an_edge_whose_corners_are_off_the_screen_may_be_off_too():
    near = error_from((5.5, 2.5, 9), (5.5, 2.5, 5.5), 8)
    # Five pixels, positions of some units, float32: not a hundredth of a pixel, and not nothing.
    assert 1e-7 < near < 1e-2


def test_what_is_seen_as_a_whole_is_off_by_some_roundings_of_a_pixel():
    assert 1e-8 < error_from((2.5, 2.5, 25), (2.5, 2.5, 2.5), 30) < 1e-4
