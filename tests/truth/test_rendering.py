"""`render`: which method answers, and what is known of its error when time runs out."""

import dataclasses
import time
from itertools import pairwise

import numpy as np
import pytest

import volref as vr
from tests.scenes import rough_scene, sparse_scene
from volref.phantoms import fields, transfer
from volref.phantoms.meshes import sphere_mesh
from volref.truth import crew, integration, rendering
from volref.truth.choosing import Choice
from volref.truth.exact import integrate_pixels


def scene_with_a_ball(width=40, height=40):
    """More than one tile, a surface in the volume, and a background."""
    scene = rough_scene(width, height, background=(0.1, 0.2, 0.3, 0.5))
    ball = sphere_mesh(1.5, scene.volume.corners.mean(axis=0), colors=(0.9, 0.4, 0.1))
    return dataclasses.replace(scene, meshes=[ball])


@pytest.fixture(scope="module")
def scene():
    return scene_with_a_ball()


@pytest.fixture(scope="module")
def truth(scene):
    return vr.render(scene, method="exact", tolerance=1e-10)


def assert_covered(out, truth):
    """No pixel is further from the truth than its bound says."""
    error = np.abs(out.rgba - truth.rgba).max(axis=-1)
    assert (error <= out.bound + truth.bound).all()


def test_auto_is_certified_by_default_and_says_that_exact_answered(scene, truth):
    for more in ({}, {"method": "auto"}, {"method": "exact"}):
        out = vr.render(scene, **more)
        assert (out.plan.method, out.bound_kind, out.met_tolerance) == ("exact", "certified", True)
        assert_covered(out, truth)


@pytest.mark.parametrize("cheaper", ["exact", "march"])
def test_auto_says_which_method_answered_where_an_estimate_may_do(scene, truth, monkeypatch, cheaper):
    # Which one is cheaper is measured, so a test has to say it.
    marching = Choice(vr.plan(scene, method="march", step=0.05), 1.0)
    chosen = marching if cheaper == "march" else None
    monkeypatch.setattr(rendering, "choose", lambda *_: chosen)
    out = vr.render(scene, certified=False)
    assert out.plan.method == cheaper
    assert out.bound_kind == {"march": "estimate", "exact": "certified"}[cheaper]
    assert out.met_tolerance
    assert_covered(out, truth)
    told = [stage.reason for stage in out.plan.stages if stage.name == "method"]
    assert len(told) == (cheaper == "march")
    assert all("marched, its estimates scaled by 1 " in reason for reason in told)


def test_a_march_says_that_its_error_is_an_estimate(scene):
    out = vr.render(scene, method="march")
    assert (out.plan.method, out.bound_kind) == ("march", "estimate")
    # A proven bound may be wanted all the same: who names a method has chosen.
    assert vr.render(scene, method="march", certified=True).bound_kind == "estimate"


@pytest.mark.parametrize("tolerance", [1e-2, 1 / 510, 1e-4, 1e-7])
def test_any_tolerance_is_met_with_a_certificate_that_covers_the_error(scene, truth, tolerance):
    out = vr.render(scene, tolerance=tolerance)
    assert (out.bound_kind, out.met_tolerance) == ("certified", True)
    assert out.bound.max() <= tolerance
    assert_covered(out, truth)


def test_a_stricter_tolerance_costs_no_fewer_pieces(scene):
    pieces = [vr.render(scene, method="exact", tolerance=tolerance).samples for tolerance in (1e-2, 1e-5)]
    assert 0 < pieces[0] <= pieces[1]


def test_without_time_each_pixel_is_midway_between_all_that_it_could_be(scene, truth):
    out = vr.render(scene, max_seconds=1e-9)
    assert (out.bound_kind, out.met_tolerance, out.samples) == ("certified", False, 0)
    assert_covered(out, truth)
    # Half of the widest range there is: an alpha from 0 to 1, and no colour is brighter.
    assert out.bound.max() <= 0.5
    np.testing.assert_array_equal(out.distance, truth.distance)


class Clock:
    """A clock by which a tile takes a second, and nothing else any time."""

    now = 0.0

    def perf_counter(self):
        return self.now

    def timed(self, *words):
        done = integrate_pixels(*words)
        self.now += 1.0
        return done


@pytest.fixture
def until(scene, monkeypatch):
    """Render the six tiles, first roughly and then to 1e-8, for so many seconds of such a clock."""

    def render(seconds):
        clock = Clock()
        with monkeypatch.context() as patch:
            patch.setattr(rendering, "time", clock)
            patch.setattr(crew, "time", clock)
            patch.setattr(integration, "integrate_pixels", clock.timed)
            return vr.render(scene, tolerance=1e-8, max_seconds=seconds, threads=1)

    return render


@pytest.mark.parametrize("seconds", [1.5, 5.5, 7.5, 9.5])
def test_what_time_allows_is_certified_and_the_rest_is_known_roughly(until, truth, seconds):
    out = until(seconds)
    # What is begun is finished.
    assert (out.seconds, out.bound_kind, out.met_tolerance) == (seconds + 0.5, "certified", False)
    assert (out.samples > 0) & (out.bound.min() < 0.1)
    assert_covered(out, truth)


def test_more_time_leaves_fewer_pixels_above_the_tolerance(until):
    bounds = [until(seconds).bound for seconds in (0.5, 6.5, 9.5, 100.0)]
    missed = [int((bound > 1e-8).sum()) for bound in bounds]
    assert missed[0] > missed[1] > missed[2] > missed[3] == 0


def test_a_march_that_ran_out_of_time_does_not_meet_its_tolerance(scene, truth):
    out = vr.render(scene, method="march", max_seconds=1e-9)
    assert (out.bound_kind, out.met_tolerance) == ("estimate", False)
    assert_covered(out, truth)  # of what was not begun the range is known


def test_enough_time_changes_nothing(scene):
    hurried, calm = vr.render(scene, method="exact", max_seconds=1e6), vr.render(scene, method="exact")
    assert hurried.met_tolerance
    assert (np.abs(hurried.rgba - calm.rgba).max(axis=-1) <= hurried.bound + calm.bound).all()


@pytest.mark.parametrize("max_seconds", [0, -1, np.nan, np.inf, "a"])
def test_a_time_that_is_none_is_refused(max_seconds):
    with pytest.raises(vr.SceneError, match="max_seconds must be"):
        vr.render(rough_scene(4, 4), max_seconds=max_seconds)


def test_the_exact_image_does_not_depend_on_threads(scene):
    first, second = (vr.render(scene, method="exact", threads=threads) for threads in (1, 3))
    np.testing.assert_array_equal(first.rgba, second.rgba)
    np.testing.assert_array_equal(first.bound, second.bound)
    assert first.samples == second.samples


def test_an_exception_in_a_tile_ends_the_rendering(monkeypatch):
    def fail(*_):
        raise MemoryError

    monkeypatch.setattr(integration, "integrate_pixels", fail)
    for threads in (1, 2):
        with pytest.raises(MemoryError):
            vr.render(sparse_scene(size=64), method="exact", threads=threads)


def test_seconds_are_those_that_passed(scene):
    started = time.perf_counter()
    out = vr.render(scene, method="exact")
    assert 0 < out.seconds <= time.perf_counter() - started


def test_more_time_never_makes_a_bound_worse(scene, monkeypatch):
    bounds = []
    for ticks in (3, 40, 400):
        clock = iter(range(10**6))
        monkeypatch.setattr(
            "volref.truth.rendering.time.perf_counter", lambda clock=clock: float(next(clock))
        )
        out = vr.render(scene, method="exact", tolerance=1e-6, max_seconds=ticks, threads=1)
        bounds.append(out.bound)
    for less, more in pairwise(bounds):
        assert (more <= np.maximum(less, 1e-6)).all()


def test_an_estimate_is_one_of_what_is_seen_where_the_volume_covers_little_of_the_image():
    """Tiles that miss the volume say nothing of how far its estimates are off."""
    volume = fields.gaussian_blobs()
    low, high = volume.corners.min(axis=0), volume.corners.max(axis=0)
    camera = vr.Camera.look_at(low + (high - low) * (4, -3, 2.5), (low + high) / 2, (0, 0, 1), 40, 1, 1e4)
    scene = vr.Scene(volume, transfer.spiky(), camera, 160, 120)
    truth = vr.render(scene, tolerance=1e-6)
    seen = truth.rgba[..., 3] > 0
    assert 0.01 < seen.mean() < 0.3
    for tolerance in (0.02, 0.005):
        out = vr.render(scene, tolerance=tolerance, certified=False)
        off = np.abs(out.rgba - truth.rgba).max(axis=-1)
        assert (off <= out.bound + 1e-6)[seen].mean() >= 0.999
