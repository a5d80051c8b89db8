"""The table of docs/guide/errors.md is what these scenes give."""

import re
from pathlib import Path

import numpy as np
import pytest

import volref as vr
from tests.scenes import rough_scene
from volref.phantoms.fields import gaussian_blobs, sphere
from volref.phantoms.transfer import few_knots, jump, smooth, spiky
from volref.phantoms.views import view_around

PAGE = Path(__file__).parents[2] / "docs" / "guide" / "errors.md"


def seen(volume, transfer):
    return vr.Scene(volume, transfer, view_around(volume), 32, 24)


def spike(knots):
    """Return a table that is clear but at its middle knot."""
    return vr.TransferFunction(
        np.linspace(0, 1, knots), np.full((knots, 3), 0.7), 50.0 * (np.arange(knots) == knots // 2)
    )


BLOBS = [gaussian_blobs(24, seed=seed) for seed in (1, 2, 3)]
SCENES = {
    "independent random voxels, table with four knots": [
        rough_scene(24, 16, seed=seed) for seed in (0, 1, 2)
    ],
    "Gaussian blobs, table with eight knots": [seen(blobs, few_knots()) for blobs in BLOBS],
    "Gaussian blobs, smooth table with 33 knots": [seen(blobs, smooth()) for blobs in BLOBS],
    "distance from a point, table with one jump": [seen(sphere(24), jump(r)) for r in (6.0, 8.0, 10.0)],
    "Gaussian blobs, table with one spike, one knot of 65 wide": [seen(blobs, spike(65)) for blobs in BLOBS],
    "Gaussian blobs, table with spikes one to two entries wide": [seen(blobs, spiky()) for blobs in BLOBS],
}


def rows_of_the_page():
    """Return {scene: (share in percent, largest error beyond)} of the table."""
    found = re.findall(
        r"^\| (.+?) \| (\d+) % \| ([\d.]+) \|$", PAGE.read_text(encoding="utf-8"), re.MULTILINE
    )
    return {name: (int(share), float(error)) for name, share, error in found}


def coverage(scenes):
    """Return the share in percent of the pixels within their bound, and the largest error of the others.

    Of each image, the largest bound is above the largest error: the page says that, too.
    """
    within, beyond = [], [0.0]
    for scene in scenes:
        out = vr.render(scene, method="march", step=0.5, tolerance=1e-12)
        truth = vr.render(scene, method="exact", tolerance=1e-9)
        error = np.abs(out.rgba - truth.rgba).max(axis=-1)
        assert error.max() <= out.bound.max()
        shows = (out.rgba[..., 3] > 0) | (truth.rgba[..., 3] > 0)
        within.append((error <= out.bound)[shows])
        beyond.extend(error[shows & (error > out.bound)])
    return 100 * np.concatenate(within).mean(), max(beyond)


def test_the_table_has_a_row_for_each_scene():
    assert list(rows_of_the_page()) == list(SCENES)


@pytest.mark.parametrize("name", SCENES)
def test_the_stated_coverage_is_the_measured_one(name):
    share, error = coverage(SCENES[name])
    stated_share, stated_error = rows_of_the_page()[name]
    # Stated to a whole percent, which is half of one away, and one pixel in a hundred may sit on its bound.
    assert share == pytest.approx(stated_share, abs=1.5)
    # Stated to one digit: half a unit of it is at most half of the number.
    assert error == pytest.approx(stated_error, rel=0.5)


if __name__ == "__main__":
    for label, group in SCENES.items():
        print(label, *coverage(group))
