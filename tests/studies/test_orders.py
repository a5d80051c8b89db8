import functools

import numpy as np
import pytest

import volref as vr
from tests.oracles.ray_integral import ray_integral
from tests.oracles.rivals import Ray
from volref.phantoms.separable import pixel_ray, ray_box
from volref.studies.orders import MAKERS, Observation, observe_order, observe_orders, orders_markdown, rms
from volref.studies.rivals import RIVALS, integrate

LOSSES = [(name, loss.case) for name, rival in RIVALS.items() for loss in rival.losses]


@functools.cache
def case(name):
    return MAKERS[name]()


def slow_tables(names):
    """Tables of 1024^2 entries take seconds to build at the steps where their order shows."""
    return [pytest.param(name, marks=[pytest.mark.slow] * name.endswith("1024")) for name in names]


@pytest.mark.parametrize("name", slow_tables(RIVALS))
def test_the_error_falls_with_the_expected_order_where_everything_is_smooth(name):
    seen = observe_order(RIVALS[name], case("smooth"))
    assert seen.order == pytest.approx(RIVALS[name].order, abs=0.1)
    assert len(seen.errors) >= 3
    assert seen.errors[-1] > 1e-14  # above the floor of rounding, some 1e-16 for 24 nodes


@pytest.mark.parametrize("name", slow_tables(RIVALS))
def test_bends_of_the_field_cost_only_what_theory_says(name):
    # Second order survives: of n segments only a few are bent, each off by the square of the step.
    seen = observe_order(RIVALS[name], case("faces"))
    # 0.1, but where in a segment the bends lie is chance, and for the parabola they are all of the error
    assert seen.order == pytest.approx(
        RIVALS[name].order_on("faces"), abs=0.15 if "parabola" in name else 0.1
    )


@pytest.mark.parametrize(("name", "where"), [pair for pair in LOSSES if pair[1] != "faces"])
def test_what_costs_orders_costs_as_many_as_expected(name, where):
    seen = observe_order(RIVALS[name], case(where))
    # Where a knot lies within a step is chance: 432 rays and up to 7 rungs leave 0.15.
    assert seen.order == pytest.approx(seen.expected, abs=0.15)
    assert seen.expected < RIVALS[name].order


@pytest.mark.parametrize("name", [n for n in RIVALS if not n.startswith(("pre", "halving"))])
@pytest.mark.parametrize("where", ["kinks", "jumps"])
def test_what_is_said_to_cost_nothing_costs_nothing(name, where):
    if (name, where) not in LOSSES:
        assert observe_order(RIVALS[name], case(where)).order == pytest.approx(RIVALS[name].order, abs=0.15)


@pytest.mark.parametrize(("where", "ratio"), [("kinks", 16), ("jumps", 4)])
def test_a_table_four_times_as_fine_errs_less_by_its_order(where, ratio):
    # Between entries a kink is off by the square of their distance and a jump by the distance; where it lies
    # between two entries differs from table to table, which is worth a factor of 2.
    coarse, fine = (
        observe_order(RIVALS[f"preintegrated-{size}"], case(where)).errors[-1] for size in (256, 1024)
    )
    assert ratio / 2 < coarse / fine < ratio * 2


def test_a_stalled_halving_is_wrong_on_few_rays_and_right_on_most():
    scene, truth = case("kinks").scene, case("kinks").truth
    seen = truth[..., 3] > 1e-3
    errors = [
        np.abs(integrate(scene, RIVALS["halving-gauss-4"], tolerance).rgba - truth).max(axis=-1)[seen]
        for tolerance in (1e-7, 1e-10)
    ]
    assert rms(errors[1]) > 0.5 * rms(errors[0])
    assert np.median(errors[1]) < 1e-2 * np.median(errors[0])


def test_a_clamped_opacity_converges_once_steps_are_thin():
    thick = case("thick")
    errors = [
        rms(integrate(thick.scene, RIVALS["midpoint-riemann"], 2.0**-j).rgba - thick.truth) for j in (7, 8)
    ]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(1, abs=0.1)


def test_the_image_of_the_smooth_case_is_true_to_rounding():
    smooth = case("smooth")
    scene = smooth.scene
    for x, y in ((12, 9), (7, 5), (15, 12)):
        origin, direction = pixel_ray(scene.camera, scene.width, scene.height, x, y)
        near, far = ray_box(origin, direction, scene.volume)
        ray = Ray(scene.volume.values, scene.transfer, list(origin), list(direction), near, far)
        expected = _integral(ray)
        # 24 weights and exponentials of one ulp each, on numbers up to 1
        np.testing.assert_allclose(smooth.truth[y, x], expected, rtol=0, atol=1e-14)


@pytest.mark.parametrize("name", MAKERS)
def test_the_certified_integrator_agrees_with_the_images_of_the_cases(name):
    out = vr.render(case(name).scene, method="exact", tolerance=1e-11)
    # The closed forms are rounded too: some 20 pieces of a ray, a few ulp each.
    assert (np.abs(out.rgba - case(name).truth).max(axis=-1) <= out.bound + 1e-14).all()
    assert out.met_tolerance


def _integral(ray):
    """The pixel in 30 digits: the value along the ray is the cubic through four of its points."""
    length = ray.t_far - ray.t_near
    u = np.array([0.0, 1 / 3, 2 / 3, 1.0])
    cubic = np.polynomial.Polynomial.fit(u, [ray.value(ray.t_near + length * s) for s in u], 3).convert().coef
    colors, extinction = ray.transfer.colors, ray.transfer.extinction

    def line(ends):
        def at(t):
            s = t / length
            value = sum(float(c) * s**k for k, c in enumerate(cubic))
            return float(ends[0]) + (float(ends[1]) - float(ends[0])) * value

        return at

    result = ray_integral([line(colors[:, k]) for k in range(3)], line(extinction), length)
    return [float(channel) for channel in result]


def test_orders_are_shown_in_a_table():
    seen = observe_orders(("left-exponential", "cell-gauss-2"), ("smooth", "thick"))
    assert [(o.rival, o.case) for o in seen] == [("left-exponential", "smooth"), ("cell-gauss-2", "smooth")]
    odd = Observation("left-riemann", "thick", (1.0,), (0.1,), -0.001, 0)
    assert orders_markdown([*seen, odd]).splitlines() == [
        "| rival | in powers of | smooth | thick |",
        "| --- | --- | --- | --- |",
        "| Riemann, front sample | step | - | 0: 0.00 |",
        "| opacity-corrected, front sample | step | 1: 1.00 | - |",
        "| Gauss, 2 nodes a cell | 1 / parts | 4: 4.00 | - |",
    ]
