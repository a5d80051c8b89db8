"""The estimates of radar images against dense sampling: the storms of Den Helder, all sweeps, banded colours.

Their fields jump at the cone of silence, below the lowest sweep and where gates have no data, and their
colours at each band: nowhere is the error of a march of second order.
"""

import functools

import numpy as np
import pytest

import volref as vr
from tests.radars import knmi
from volref.phantoms.transfer import dbz_transfer

VIEWS = {
    "along the ground": ((-85e3, -300e3, 12e3), (-85e3, -210e3, 5e3), (0, 0, 1), 20.0),
    "from the south-east": ((150e3, -220e3, 60e3), (0, -60e3, 4e3), (0, 0, 1), 25.0),
    "down on the cone of silence": ((20e3, -70e3, 200e3), (20e3, -60e3, 0), (0, 1, 0), 35.0),
}

WIDTH, HEIGHT = 24, 16

# The step by default, and how many times finer the dense samples are: finer than the last of three rounds, at
# 1/64, and no power of two, or they would be among its samples.
STEP, FINER = 250.0, 75


@functools.cache
def storms(view):
    eye, target, up, fov_y = VIEWS[view]
    camera = vr.Camera.look_at(eye, target, up, fov_y=fov_y, near=1e3, far=1e6)
    return vr.Scene(knmi(), dbz_transfer(), camera, WIDTH, HEIGHT)


@functools.cache
def dense(view):
    return vr.render(storms(view), method="march", step=STEP / FINER, certified=False).rgba


@pytest.mark.parametrize("tolerance", [1 / 100, 1 / 510])
@pytest.mark.parametrize("view", VIEWS)
def test_the_estimate_holds_for_every_view_of_the_storms_and_either_tolerance(view, tolerance):
    out = vr.render(storms(view), tolerance=tolerance)
    error = np.abs(out.rgba - dense(view)).max(axis=-1)
    hit = dense(view)[..., 3] > 0
    assert hit.sum() > 50
    assert (error <= out.bound)[hit].mean() >= 0.999
    assert (error <= tolerance).all()
    assert (out.bound <= tolerance).mean() >= 0.97  # three rounds are not enough for every jump
