"""Certified images against 30 digits, on every kind of scene.

python -m pytest tests/truth/test_certified.py            all rays, some minutes
python -m pytest tests/truth/test_certified.py -m "not slow"     24 of them
python -m tests.truth.test_certified                      the same as a table, scene by scene
"""

import sys
from functools import cache

import numpy as np
import pytest

import volref as vr
from tests.truth.certified_scenes import KINDS, certified_scenes

TOLERANCE = 1e-12
RAYS = {"degenerate": 3}  # per scene, of which this kind has forty
FAST_RAYS = 24

# An extinction that rises by 1e6 over 1e-6 of the value: an ulp of the value, 0.3, is 3e-17 and changes the
# extinction by 6e-5, or the depth of the first of its layers, 1e-6 thick, by 1e-10.
STEEPER_THAN_FLOAT64 = {"spiky, one spike of 1e6": 1e-10}


def checked_scenes(*kinds, rays=None):
    """Yield (name, brightest colour, verification) of the scenes of some kinds, rendered to 1e-12."""
    for i, (name, scene) in enumerate(certified_scenes(*kinds)):
        out = vr.render(scene, method="exact", tolerance=TOLERANCE)
        count = RAYS.get(name.split(",")[0], 10) if rays is None else rays
        yield name, _brightest(scene), vr.verify(scene, out, count, seed=i)


def _brightest(scene):
    """What errors are relative to: 1, or the brightest colour in sight if it is brighter."""
    return max(1.0, scene.transfer.colors.max(), *(mesh.colors.max() for mesh in scene.meshes))


def assert_certified(name, brightest, checked):
    assert checked.bound_kind == "certified"
    assert checked.share_within == 1, f"{name}\n{checked}"
    assert checked.largest_error <= TOLERANCE * brightest, f"{name}\n{checked}"


@cache
def checked_kind(kind):
    return list(checked_scenes(kind))


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_random_rays_are_within_1e_minus_12_and_their_certificates(kind):
    for name, brightest, checked in checked_kind(kind):
        if name in STEEPER_THAN_FLOAT64:
            assert checked.share_within == 1, f"{name}\n{checked}"
            assert checked.largest_error <= STEEPER_THAN_FLOAT64[name]
        else:
            assert_certified(name, brightest, checked)


@pytest.mark.slow
def test_certificates_are_of_use():
    """Over all rays the median bound is at most 100 times the median error, or 1e-13."""
    checks = [(checked, brightest) for kind in KINDS for _, brightest, checked in checked_kind(kind)]
    errors = np.concatenate([checked.error / brightest for checked, brightest in checks])
    bounds = np.concatenate([checked.bound / brightest for checked, brightest in checks])
    seen = bounds > 0
    assert np.median(bounds[seen]) <= max(100 * np.median(errors[seen]), 1e-13)


def test_the_rays_are_200_and_more():
    counts = [RAYS.get(kind, 10) * sum(1 for _ in scenes()) for kind, scenes in KINDS.items()]
    assert sum(counts) >= 200


def test_24_rays_of_all_kinds_are_within_1e_minus_12_and_their_certificates():
    scenes = [next(certified_scenes(kind)) for kind in KINDS]
    total = 0
    for i, (name, scene) in enumerate(scenes):
        out = vr.render(scene, method="exact", tolerance=TOLERANCE)
        rays = FAST_RAYS // len(scenes) + (i < FAST_RAYS % len(scenes))
        checked = vr.verify(scene, out, rays, seed=i)
        assert_certified(name, _brightest(scene), checked)
        total += len(checked.error)
    assert total == FAST_RAYS


def print_table(kinds):
    """Print a line for each scene, and the figures over all rays."""
    errors, bounds, within = [], [], []
    print(f"{'scene':48}{'rays':>5}{'error':>10}{'bound':>10}{'ratio':>10}{'s / ray':>9}")
    for name, brightest, checked in checked_scenes(*kinds):
        errors.append(checked.error / brightest)
        bounds.append(checked.bound / brightest)
        within.append(checked.within)
        count = len(checked.error)
        print(
            f"{name:48}{count:5}{errors[-1].max(initial=0):10.1e}{np.median(bounds[-1]):10.1e}"
            f"{checked.ratio.max(initial=0):10.1e}{checked.seconds / max(count, 1):9.2f}"
            f"{'' if checked.ok else '  OUTSIDE'}",
            flush=True,
        )
    error, bound, inside = map(np.concatenate, (errors, bounds, within))
    print(
        f"{len(error)} rays: error {error.max():.2g} at most, {np.median(error):.2g} in the median; "
        f"bound {np.median(bound):.2g} in the median; {inside.mean():.6g} within"
    )


if __name__ == "__main__":
    print_table(sys.argv[1:])
