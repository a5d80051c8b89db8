"""Pieces put together, and the bound of a ray against exact sums at 40 digits.

The true media and their models are constant on parts of a piece, so both radiances are finite sums.
"""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mp, mpf

from volref.stages.radiance import (
    Modelled,
    gathered,
    layout_of,
    running_sums,
    sums_in_front,
)

U = 2.0**-53


# --- sums along rays


def test_rays_begin_where_the_index_changes():
    layout = layout_of(np.array([0, 0, 3, 7, 7, 7]))
    assert layout.rays.tolist() == [0, 3, 7]
    assert layout.first.tolist() == [0, 2, 3]
    assert layout.last.tolist() == [1, 2, 5]
    assert layout.member.tolist() == [0, 0, 1, 2, 2, 2]


ray_values = st.lists(
    st.tuples(st.floats(-30.0, 30.0), st.lists(st.floats(0.0, 1.0), min_size=1, max_size=6)),
    min_size=1,
    max_size=6,
)


@given(ray_values)
def test_sums_of_huge_and_tiny_rays_are_those_of_each_by_itself(rays):
    values = np.concatenate([10.0**exponent * np.array(numbers) for exponent, numbers in rays])
    layout = layout_of(np.repeat(np.arange(len(rays)), [len(numbers) for _, numbers in rays]))
    in_front = sums_in_front(values, layout)
    _, _, totals = running_sums(values, layout)
    for ray, (first, last) in enumerate(zip(layout.first, layout.last, strict=True)):
        mine = values[first : last + 1]
        # One rounding a term, of sums that are no larger than the ray's own.
        most = len(mine) * U * math.fsum(mine)
        assert abs(totals[ray] - math.fsum(mine)) <= most
        for k in range(len(mine)):
            assert abs(in_front[first + k] - math.fsum(mine[:k])) <= 2 * most + 2 * U * _before(
                values, layout, ray
            )


def _before(values, layout, ray):
    """What the rounding of the rays in front of this one can amount to: an ulp a piece, then one of that."""
    return sum(
        len(values) * U * math.fsum(values[a : b + 1])
        for a, b in zip(layout.first[:ray], layout.last[:ray], strict=True)
    )


def test_nothing_is_in_front_of_the_first_piece():
    layout = layout_of(np.array([0, 1, 1]))
    assert sums_in_front(np.array([1e30, 3.0, 5.0]), layout)[[0, 1]].tolist() == [0.0, 0.0]


# --- the identity: media that are constant on parts


class Ray:
    """Pieces of a ray: lists of parts (length, true extinction, true colour, model's, model's colour)."""

    def __init__(self, pieces, behind):
        self.pieces, self.behind = pieces, behind

    def radiance(self, model):
        """The premultiplied RGBA of the true medium or of the model, exactly."""
        color, clear = mpf(0), mpf(1)
        for piece in self.pieces:
            for length, *media in piece:
                sigma, c = media[2:] if model else media[:2]
                opacity = 1 if sigma == math.inf else -mp.expm1(-mpf(sigma) * mpf(length))
                color += clear * opacity * mpf(c)
                clear *= 1 - opacity
        return [color + clear * mpf(self.behind[0]), 1 - clear * (1 - mpf(self.behind[1]))]

    def modelled(self):
        """What `gathered` is told: exact integrals of the model, and honest errors."""
        rows = [self._piece(piece) for piece in self.pieces]
        depth, light, color, change, depth_error, color_error = (
            np.array([float(x) for x in column]) for column in zip(*rows, strict=True)
        )
        in_front = np.exp(-np.concatenate([[0.0], np.cumsum(np.minimum(depth, 800.0))[:-1]]))
        gray = [np.tile(x, (3, 1)) for x in (light, color, change)]
        return Modelled(
            depth, -np.expm1(-depth), in_front, *gray, depth_error, color_error, np.zeros((3, len(depth)))
        )

    @staticmethod
    def _piece(parts):
        depth, light, error, off = mpf(0), mpf(0), mpf(0), mpf(0)
        for length, sigma, c, model_sigma, model_c in parts:
            light += mp.exp(-depth) * -mp.expm1(-mpf(model_sigma) * mpf(length)) * mpf(model_c)
            depth += mpf(model_sigma) * mpf(length)
            error += abs(mpf(sigma) - mpf(model_sigma)) * mpf(length)
            off = max(off, abs(mpf(c) - mpf(model_c)))
        colors = [part[4] for part in parts]
        middle = colors[len(colors) // 2]
        change = max(abs(mpf(c) - mpf(middle)) for c in colors)
        return min(depth, mpf(10) ** 300), light, middle, change, min(error, mpf(10) ** 300), off


unit = st.integers(0, 16).map(lambda k: k / 16)
extinction = st.one_of(
    st.just(0.0),
    unit,
    st.builds(lambda m, e: m * 10.0**e, st.floats(0.1, 1.0), st.integers(-12, 6)),
    st.just(math.inf),
)


@st.composite
def part(draw):
    true = draw(extinction)
    kind = draw(st.sampled_from(["same", "near", "any"]))
    finite = min(true, 1e5)
    model = {"same": finite, "near": finite * (1 + draw(st.floats(-0.1, 0.1)))}.get(kind)
    if model is None:
        model = min(draw(extinction), 1e5)
    color = draw(unit)
    return (
        draw(st.sampled_from([0.01, 0.5, 1.0, 3.0])),
        true,
        color,
        model,
        color if draw(st.booleans()) else draw(unit),
    )


rays = st.builds(
    Ray, st.lists(st.lists(part(), min_size=1, max_size=3), min_size=1, max_size=5), st.tuples(unit, unit)
)


@given(st.lists(rays, min_size=1, max_size=3))
def test_the_error_is_within_the_bound(some):
    models = [ray.modelled() for ray in some]
    together = Modelled(
        *(
            np.concatenate([getattr(m, name) for m in models], axis=-1)
            for name in Modelled.__dataclass_fields__
        )
    )
    layout = layout_of(np.repeat(np.arange(len(some)), [len(ray.pieces) for ray in some]))
    behind = np.array([[ray.behind[0]] * 3 + [ray.behind[1]] for ray in some])
    result = gathered(together, layout, behind, 1.0)
    for k, ray in enumerate(some):
        with mp.workdps(40):
            truth = ray.radiance(model=False)
            for found, true in ((result.rgba[k, 0], truth[0]), (result.rgba[k, 3], truth[1])):
                assert abs(mpf(float(found)) - true) <= result.bound[k]
            # What is clear is bounded too, or else nothing is known of the ray.
            clear = (1 - truth[1]) / (1 - mpf(ray.behind[1])) if ray.behind[1] < 1 else mpf(0)
            # 1 - opacity is rounded, and so is the sum of depths: ulp of 1.
            assert clear <= result.clear[k] + 16 * U or result.bound[k] > clear / 2


@given(rays)
def test_the_image_is_that_of_the_model_but_for_rounding(ray):
    behind = np.array([[ray.behind[0]] * 3 + [ray.behind[1]]])
    result = gathered(ray.modelled(), layout_of(np.zeros(len(ray.pieces), int)), behind, 1.0)
    with mp.workdps(40):
        model = ray.radiance(model=True)
    # Two roundings for each of some pieces, and a depth of at most 800 whose ulp is felt as t e^-t < 1.
    for found, true in ((result.rgba[0, 0], model[0]), (result.rgba[0, 3], model[1])):
        assert abs(found - float(true)) <= (2 * len(ray.pieces) + 8) * 2 * U


def one_piece(sigma, model_sigma, color=1.0, model_color=1.0, length=1.0, behind=(0.0, 0.0)):
    ray = Ray([[(length, sigma, color, model_sigma, model_color)]], behind)
    result = gathered(
        ray.modelled(), layout_of(np.zeros(1, int)), np.array([[behind[0]] * 3 + [behind[1]]]), 1.0
    )
    with mp.workdps(40):
        error = max(
            abs(a - mpf(float(b)))
            for a, b in zip(ray.radiance(model=False), result.rgba[0, [0, 3]], strict=True)
        )
    return float(error), float(result.bound[0])


def test_the_bound_is_sharp_where_a_thin_piece_is_a_little_too_clear():
    error, bound = one_piece(1e-3 + 1e-6, 1e-3)
    assert error <= bound <= error * 1.01  # 1 + depth, and the second order


def test_the_bound_is_sharp_where_the_colour_is_off():
    error, bound = one_piece(2.0, 2.0, color=0.5, model_color=0.25)
    assert error <= bound <= error * (1 + 1e-12)


def test_a_model_of_the_colour_of_what_lies_behind_may_be_as_thick_as_it_likes():
    # No contrast: only alpha is at stake, and what lies behind is opaque.
    error, bound = one_piece(5.0, 1.0, color=0.5, model_color=0.5, behind=(0.5, 1.0))
    assert error == 0
    # Rounding, 82 ulp, and as much more as it makes of the light behind, e times as uncertain.
    assert bound <= 82 * U * (1 + np.e) * (1 + 1e-9)


def test_errors_behind_an_opaque_piece_do_not_count():
    ray = Ray([[(1.0, math.inf, 0.5, 1e3, 0.5)], [(1.0, 0.0, 0.0, 5.0, 1.0)]], (0.0, 0.0))
    told = ray.modelled()
    told.depth_error[0] = 0.0  # it is known to be opaque
    result = gathered(told, layout_of(np.zeros(2, int)), np.zeros((1, 4)), 1.0)
    assert result.bound[0] <= 200 * U


def test_errors_of_the_quadrature_are_added():
    told = Ray([[(1.0, 1.0, 0.5, 1.0, 0.5)], [(1.0, 1.0, 0.5, 1.0, 0.5)]], (0.0, 0.0)).modelled()
    told.light_error[:] = [[1e-3, 1e-3]]
    result = gathered(told, layout_of(np.zeros(2, int)), np.zeros((1, 4)), 1.0)
    assert result.bound[0] == pytest.approx(1e-3 * (1 + np.exp(-1.0)), rel=1e-10)


def test_an_error_in_the_light_behind_is_part_of_the_contrast():
    # The first piece has the colour of what arrives, but what arrives is uncertain by 0.1.
    told = Ray([[(1.0, 1.0, 0.5, 1.0, 0.5)], [(1e3, 1.0, 0.5, 1.0, 0.5)]], (0.0, 0.0)).modelled()
    told.depth_error[0], told.light_error[:, 1] = 1e-3, 0.1
    result = gathered(told, layout_of(np.zeros(2, int)), np.zeros((1, 4)), 1.0)
    arriving = 0.1 * np.exp(-1.0)
    # In the colour of the first piece and at its end: 1e-3 of the uncertain 0.1.
    assert result.share[0] >= 1e-3 * 0.1 * (1 - 1e-9)
    assert result.bound[0] == pytest.approx(arriving * np.exp(1e-3) + 1e-4, rel=1e-3)


def test_rounding_is_in_every_bound():
    ray = Ray([[(1.0, 0.0, 0.0, 0.0, 0.0)]] * 5, (0.0, 0.0))
    result = gathered(ray.modelled(), layout_of(np.zeros(5, int)), np.zeros((1, 4)), 2.0)
    # Two for each piece, and those of the ends and of the sums, of the brightest colour.
    assert result.bound[0] >= (2 * 5 + 16) * U * 2.0


def test_no_bound_exceeds_the_brightest_colour():
    error, bound = one_piece(math.inf, 0.0)
    assert error <= bound <= 1.0 + 1e-12
