"""Rays of made-up samples: what a scalar loop makes of any of them lies in the interval of all."""

from types import SimpleNamespace

import numpy as np
import pytest

import volref as vr
from volref.oracle.intervals import compositing, sums
from volref.oracle.intervals.compositing import Behind, composited
from volref.oracle.intervals.iterations import Iteration
from volref.oracle.intervals.opacities import Share
from volref.oracle.intervals.sums import summed
from volref.oracle.intervals.walking import Pair
from volref.oracle.intervals.walking import Test as Answer

RAYS, LOOPS, MEMBERS = 12, 7, 60
BASE = vr.pipelines()["texture3d"].with_switches(stepping={"opaque_at": None})

# The rounding of the sums that this file itself makes.
FLOAT64 = 1e-12


def course_of(pipeline, *, at_most_one=True):
    """What the loops ask of a course, without a volume behind it: exact arithmetic, colours up to 1."""
    textures = SimpleNamespace(table=SimpleNamespace(texels=np.ones((1, 2, 4))))
    finder = SimpleNamespace(slack=SimpleNamespace(values=0.0), textures=textures)
    rule = SimpleNamespace(at_most_one=at_most_one)
    drawing = SimpleNamespace(pipeline=pipeline, scene=SimpleNamespace(lights=()), rule=rule)
    paths = SimpleNamespace(step=np.full(RAYS, 0.25), length=np.full(RAYS, 1.5))
    walks = SimpleNamespace(paths=paths, length_off=np.full(RAYS, 0.01), step_off=np.full(RAYS, 0.002))
    rays = SimpleNamespace(pixel=np.arange(RAYS))
    return SimpleNamespace(drawing=drawing, finder=finder, rays=rays, walks=walks)


def made_up(rng, *, most=1.0, wide=0.3, hits=False):
    """Iterations of all rays with samples up to an opacity, chords up to a width; some may end or must."""
    found = []
    for number in range(LOOPS):
        middle, way = rng.uniform(0, most, RAYS), rng.uniform(0, wide, RAYS) * rng.choice([-1, 1], RAYS)
        opacity = np.clip([middle - way / 2, middle + way / 2], 0, most)
        color = np.clip(rng.random((3, RAYS)) + np.array([-0.5, 0.5])[:, None, None] * wide, 0, 1)
        color = np.where(rng.random((3, RAYS)) < 0.5, color, color[::-1])
        offs = rng.choice([0.0, 0.01], RAYS), rng.choice([0.0, 0.02], (3, RAYS))
        # Transparent samples are left out of what is looked up, at times.
        some = np.flatnonzero(rng.random(RAYS) < 0.9)
        share = Share(opacity[:, some], color[:, :, some], offs[0][some], offs[1][:, some])
        every = np.arange(RAYS)
        tests = [end(rng, number) for _ in range(3)]
        found.append(Iteration(every, tests[0], tests[1] if hits else None, tests[2], some, share))
    return found


def end(rng, number):
    maybe = rng.random(RAYS) < 0.15
    sure = maybe & (rng.random(RAYS) < 0.4)
    if number == LOOPS - 1:
        sure = maybe = np.ones(RAYS, np.bool_)
    return Answer(sure, maybe)


def member(rng, share, k, most):
    """A sample that the k-th of a share's rays may find: straight colour, opacity from 0 to `most`."""
    t = rng.choice([0.0, 1.0, rng.random()])
    (a0, a1), (c0, c1) = share.opacity[:, k], share.color[:, :, k]
    ways = rng.choice([-1.0, 0.0, 1.0, rng.uniform(-1, 1)], 4)
    opacity = a0 + t * (a1 - a0) + ways[0] * share.opacity_off[k]
    color = c0 + t * (c1 - c0) + ways[1:] * share.color_off[:, k]
    return color, min(max(float(opacity), 0.0), most)


def ends_here(rng, test, ray):
    return bool(test.sure[ray]) or bool(test.maybe[ray] and rng.random() < 0.5)


def walked(rng, pipeline, steps, behind, ray, most):
    """What one machine makes of one ray (4,), and whether a mesh was met: a loop as a shader has it."""
    rule, stepping = pipeline.accumulation.rule, pipeline.stepping
    color, alpha = np.zeros(3), 0.0
    share_of_ray = (0.25 + rng.uniform(-0.002, 0.002)) / (1.5 + rng.uniform(-0.01, 0.01))
    other, full = "end", False
    for _, before, hit, after, some, share in steps:
        if ends_here(rng, before, ray):
            break
        if hit is not None and ends_here(rng, hit, ray):
            other = "mesh"
            break
        at = np.flatnonzero(some == ray)
        if len(at):
            c, a = member(rng, share, at[0], most)
            shown = 1.0 if pipeline.accumulation.color == "premultiplied" else a
            if rule == "reversed-over":
                color, alpha = c * a + color * (1 - a) * alpha, a + (1 - a) * alpha
            elif rule == "mean":
                color, alpha = color + c * a * share_of_ray, alpha + a * share_of_ray
            elif rule == "greatest":
                color, alpha = (c * a, a) if a > alpha else (color, alpha)
            else:
                color = color + (1 - alpha) * shown * c
                alpha = alpha + ((1 - alpha) * a if rule == "over" else a)
                alpha = min(alpha, 1.0) if rule == "add-clamped" else alpha
        full = stepping.opaque_at is not None and alpha >= stepping.opaque_at
        if full or ends_here(rng, after, ray):
            break
    if full and stepping.stopped == "opaque":
        alpha = 1.0
    if behind is not None:
        below = getattr(behind, other)
        t = rng.choice([0.0, 1.0])
        under = below.low[:, ray] + t * (below.high[:, ray] - below.low[:, ray])
        color, alpha = color + (1 - alpha) * under[:3], 1 - (1 - alpha) * (1 - under[3])
    return np.append(color, alpha)


def behind_of(rng):
    """Black, half the time something up to a canvas; an opaque mesh."""
    under = rng.random((4, RAYS)) * rng.choice([0.0, 1.0], RAYS)
    mesh = np.concatenate([rng.random((3, RAYS)), np.ones((1, RAYS))])
    return Behind(Pair(under, under + 0.01 * (under > 0) * (1 - under)), Pair(mesh, mesh))


def assert_members_inside(pipeline, outcome, steps, behind, rng, most=1.0):
    for ray in range(RAYS):
        for _ in range(MEMBERS):
            found = walked(rng, pipeline, steps, behind, ray, most)
            assert (found >= outcome.low[:, ray] - FLOAT64).all(), (found, outcome.low[:, ray])
            assert (found <= outcome.high[:, ray] + FLOAT64).all(), (found, outcome.high[:, ray])


@pytest.mark.parametrize("hits", [False, True])
@pytest.mark.parametrize(
    "switches",
    [
        {},
        {"stepping": {"opaque_at": 0.8}},
        {"stepping": {"opaque_at": 0.8, "stopped": "opaque"}},
        {"accumulation": {"color": "premultiplied"}},
    ],
    ids=str,
)
def test_rays_that_are_composited_lie_inside(monkeypatch, switches, hits):
    pipeline, rng = BASE.with_switches(**switches), np.random.default_rng(7)
    for _ in range(2):
        steps, behind = made_up(rng, hits=hits), behind_of(rng)
        monkeypatch.setattr(compositing, "iterations", lambda *_, steps=steps: iter(steps))
        outcome = composited(course_of(pipeline), None, behind)
        assert_members_inside(pipeline, outcome, steps, behind, rng)


@pytest.mark.parametrize("most", [1.0, 1.6])
def test_rays_with_opacities_above_one_lie_inside(monkeypatch, most):
    rng = np.random.default_rng(8)
    steps, behind = made_up(rng, most=most), behind_of(rng)
    monkeypatch.setattr(compositing, "iterations", lambda *_: iter(steps))
    outcome = composited(course_of(BASE, at_most_one=False), None, behind)
    assert_members_inside(BASE, outcome, steps, behind, rng, most=np.inf)


@pytest.mark.parametrize("opaque_at", [None, 0.8])
@pytest.mark.parametrize("rule", ["add-alpha", "add-clamped", "reversed-over", "mean", "greatest"])
def test_rays_of_other_sums_lie_inside(monkeypatch, rule, opaque_at):
    pipeline = BASE.with_switches(accumulation={"rule": rule}, stepping={"opaque_at": opaque_at})
    rng = np.random.default_rng(9)
    steps = made_up(rng)
    if rule == "reversed-over":
        # Every sample counts, transparent or not.
        steps = [one for one in steps if len(one.some) == RAYS] or made_up_whole(rng)
    monkeypatch.setattr(sums, "iterations", lambda *_: iter(steps))
    outcome = summed(course_of(pipeline), None, 3, None)
    assert_members_inside(pipeline, outcome, steps, None, rng)


def made_up_whole(rng):
    return [
        one._replace(some=np.arange(RAYS), share=Share(*(full(part) for part in one.share)))
        for one in made_up(rng)
    ]


def full(part):
    """A share's numbers for all rays: those of the first for those without one."""
    return np.concatenate([part, np.repeat(part[..., :1], RAYS - part.shape[-1], axis=-1)], axis=-1)


def one_sample(rng):
    """One iteration of rays that do not end before it, its numbers on their chord."""
    step = next(one for one in made_up(rng) if len(one.some) > RAYS // 2)
    nobody = Answer(np.zeros(RAYS, np.bool_), np.zeros(RAYS, np.bool_))
    none = Share(step.share.opacity, step.share.color, 0 * step.share.opacity_off, 0 * step.share.color_off)
    return step._replace(before=nobody, after=nobody, share=none)


def test_sums_that_grow_beyond_all_numbers_may_be_anything(monkeypatch):
    def grow(*given):
        low, high, _ = given[3]
        low[:], high[:] = [[-np.inf, np.nan, -1e300]], [[np.inf, np.nan, np.nan]]

    monkeypatch.setattr(sums, "_run", grow)
    outcome = summed(SimpleNamespace(rays=SimpleNamespace(pixel=np.arange(3))), None, 3, None)
    assert (outcome.low <= -1e100).all()
    assert (outcome.high >= 1e100).all()


def test_the_interval_of_one_sample_is_the_hull_of_its_chord_and_not_its_box(monkeypatch):
    rng = np.random.default_rng(10)
    step = one_sample(rng)
    behind = behind_of(rng)
    monkeypatch.setattr(compositing, "iterations", lambda *_: iter([step]))
    outcome = composited(course_of(BASE), None, behind)
    t = np.linspace(0, 1, 1001)[:, None, None]
    (a0, a1), (c0, c1) = step.share.opacity, step.share.color
    a, c = a0 + t * (a1 - a0), c0 + t * (c1 - c0)
    hull = [
        reach(a * c + (1 - a) * bound[:3, step.some], axis=0)
        for reach, bound in ((np.min, behind.end.low), (np.max, behind.end.high))
    ]
    found = outcome.low[:3, step.some], outcome.high[:3, step.some]
    sag = np.abs((a1 - a0) * (c1 - c0)) / 4
    assert (found[0] <= hull[0] + FLOAT64).all()
    assert (found[1] >= hull[1] - FLOAT64).all()
    # A quarter of the chord's sag is all that is given away, and nothing where it has none.
    assert (found[0] >= hull[0] - sag - FLOAT64).all()
    assert (found[1] <= hull[1] + sag + FLOAT64).all()
    box = np.array([x * y + (1 - x) * behind.end.low[:3, step.some] for x in (a0, a1) for y in (c0, c1)])
    against = (a1 - a0) * (c1 - c0) < 0
    assert np.median(((hull[1] - hull[0]) / (box.max(axis=0) - box.min(axis=0)))[against]) < 0.9


def test_alpha_of_one_sample_is_that_of_its_ends(monkeypatch):
    rng = np.random.default_rng(11)
    step, behind = one_sample(rng), behind_of(rng)
    monkeypatch.setattr(compositing, "iterations", lambda *_: iter([step]))
    outcome = composited(course_of(BASE), None, behind)
    least, most = step.share.opacity.min(axis=0), step.share.opacity.max(axis=0)
    expected = [
        1 - (1 - a) * (1 - bound[3, step.some])
        for a, bound in ((least, behind.end.low), (most, behind.end.high))
    ]
    np.testing.assert_allclose(
        [outcome.low[3, step.some], outcome.high[3, step.some]], expected, rtol=0, atol=FLOAT64
    )


def test_a_ray_that_surely_ends_has_what_is_behind_it_and_no_more(monkeypatch):
    rng = np.random.default_rng(12)
    every = Answer(np.ones(RAYS, np.bool_), np.ones(RAYS, np.bool_))
    steps, behind = [one_sample(rng)._replace(before=every)], behind_of(rng)
    monkeypatch.setattr(compositing, "iterations", lambda *_: iter(steps))
    outcome = composited(course_of(BASE), None, behind)
    assert np.array_equal(outcome.low, behind.end.low)
    assert np.array_equal(outcome.high, behind.end.high)
    assert not outcome.branch.any()
