import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mp, mpf

from tests.oracles.ray_integral import graded, ray_integral
from volref.phantoms import closed

FRONT, BACK = (0.9, 0.2, 0.0), (0.1, 0.7, 1.0)
EPS = np.finfo(np.float64).eps

# The goal for all closed forms is 1e-13 relative; each is a short chain of operations that lose no digits
# (a few ulp each; the moment was at most 10 eps off in some thousands of tries), so 64 eps = 1.4e-14 is
# asked.
CLOSE = 64 * EPS

ENDS = [
    (0.3, 0.3, 2.0),
    (0.0, 0.0, 1.0),
    (0.0, 1e-9, 1.0),
    (1e-9, 0.0, 1.0),
    (0.0, 1.0, 1.5),
    (1.0, 0.0, 1.5),
    (0.5, 0.5 + 1e-12, 3.0),
    (2.0, 2.0 - 1e-9, 3.0),
    (0.666, 0.0, 1.0),
    (0.668, 0.0, 1.0),
    (4.0, 0.1, 3.0),
    (0.1, 4.0, 3.0),
    (0.0, 200.0, 1.0),
    (300.0, 0.0, 1.0),
    (100.0, 1e4, 1.0),
]


@pytest.fixture(autouse=True)
def thirty_digits():
    with mp.workdps(30):
        yield


def line(first, last, length):
    """The function of t that runs linearly from `first` at 0 to `last` at `length`."""
    start, slope = mpf(first), (mpf(last) - mpf(first)) / mpf(length)
    return lambda t: start + slope * t


def mix(first, last, length):
    """One such function per channel."""
    return [line(a, b, length) for a, b in zip(first, last, strict=True)]


def assert_close(got, want):
    for have, exact in zip(got.tolist(), want, strict=True):
        assert abs(mpf(have) - exact) <= CLOSE * abs(exact)


@pytest.mark.parametrize(("extinction", "length"), [(0.3, 2.0), (1e-17, 1.0), (1e4, 1.0), (0.0, 1.0)])
def test_a_homogeneous_slab_agrees_with_quadrature(extinction, length):
    want = ray_integral(mix(FRONT, FRONT, length), lambda _: mpf(extinction), length, graded(length, 1e4))
    assert_close(closed.homogeneous(FRONT, extinction, length), want)


@pytest.mark.parametrize(("first", "last", "length"), ENDS)
def test_linear_colour_and_extinction_agree_with_quadrature(first, last, length):
    extinction = line(first, last, length)
    want = ray_integral(mix(FRONT, BACK, length), extinction, length, graded(length, (first + last) * length))
    assert_close(closed.linear_both(FRONT, BACK, first, last, length), want)


@pytest.mark.parametrize(("first", "last", "length"), ENDS[::3])
def test_a_linear_extinction_agrees_with_quadrature(first, last, length):
    extinction = line(first, last, length)
    want = ray_integral(
        mix(FRONT, FRONT, length), extinction, length, graded(length, (first + last) * length)
    )
    assert_close(closed.linear_extinction(FRONT, first, last, length), want)


@pytest.mark.parametrize("depth", [1e-20, 1e-8, 0.7, 1.0, 1.0000001, 30.0, 1e4])
def test_a_linear_colour_agrees_with_quadrature(depth):
    want = ray_integral(mix(FRONT, BACK, 2.0), lambda _: mpf(depth) / 2, 2.0, graded(2.0, depth))
    assert_close(closed.linear_color(FRONT, BACK, depth / 2, 2.0), want)


@pytest.mark.parametrize(
    ("first", "last", "length"), [(0.1, 10.0, 1.0), (10.0, 0.1, 1.0), (1.0, 1.0, 2.0), (1.0, 1 + 1e-9, 2.0)]
)
def test_an_exponential_extinction_agrees_with_quadrature(first, last, length):
    rate = mp.log(mpf(last) / mpf(first)) / length

    def extinction(t):
        return mpf(first) * mp.exp(rate * t)

    def share(t):
        return (extinction(t) - first) / (mpf(last) - first) if last != first else t / mpf(length)

    colors = [lambda t, paint=paint: paint(share(t)) for paint in mix(FRONT, BACK, 1)]
    want = ray_integral(colors, extinction, length, graded(length, 32))
    assert_close(closed.exponential_extinction(FRONT, BACK, first, last, length), want)


@pytest.mark.parametrize(
    ("first", "last"),
    [
        (0.0, 1e-9),
        (0.2, 0.2),
        (0.2, 0.21),
        (0.1, 0.6),
        (0.9, 0.3),
        (1.0, 0.0),
        (1 - 1e-12, 1 - 3e-12),
        (0.0, 0.45),
    ],
)
def test_a_linear_opacity_agrees_with_quadrature(first, last):
    length, unit = 1.5, 0.5

    def depth_of(opacity):  # int_0^opacity of -log(1 - s) ds, exact at 50 digits
        return opacity + (1 - opacity) * mp.log(1 - opacity) if opacity < 1 else mpf(1)

    with mp.workdps(50):  # the difference below loses 18 digits for the closest ends
        a, b = mpf(first), mpf(last)
        mean = (depth_of(b) - depth_of(a)) / (b - a) if a != b else -mp.log(1 - a)
        alpha = -mp.expm1(-mean * length / unit)
        want = [*(mpf(c) * alpha for c in FRONT), alpha]
    assert_close(closed.linear_opacity(FRONT, first, last, length, unit), want)


def test_a_linear_opacity_without_slope_is_the_opacity_of_its_length():
    got = closed.linear_opacity((1, 1, 1), 0.3, 0.3, 3.0, 1.0)
    assert got[3] == pytest.approx(1 - 0.7**3, rel=CLOSE)
    assert closed.linear_opacity((1, 1, 1), 1.0, 1.0, 0.1)[3] == 1.0


@pytest.mark.parametrize("miss", [0.0, 0.3, 1 - 1e-9])
def test_a_ball_is_a_slab_of_its_chord_even_at_its_rim(miss):
    chord = 2 * mp.sqrt(1 - mpf(miss) ** 2)
    want = [-mp.expm1(-3 * chord)] * 4
    got = closed.homogeneous_ball((1, 1, 1), 3.0, (miss, 0.0, 7.0), (0.0, 0.0, -1.0))
    assert_close(got, want)


def test_a_ray_that_starts_in_the_ball_sees_the_rest_of_it():
    assert closed.ball_span((0, 0, 0.5), (0, 0, 1), (0, 0, 0), 1.0) == (0.0, 0.5)
    assert closed.ball_span((0, 0, 2), (0, 0, 1), (0, 0, 0), 1.0) == (0.0, 0.0)
    assert closed.ball_span((1, 0, 2), (0, 0, -1), (0, 0, 0), 1.0) == (0.0, 0.0)


def test_shells_agree_with_quadrature_along_an_oblique_chord():
    radii, extinctions, colors = [1.0, 2.0, 2.5], [2.0, 0.3, 0.9], [(1, 0, 0), (0, 1, 0), (0, 0, 1)]
    origin, direction = (0.5, 0.2, 4.0), (0.0, 0.0, -1.0)
    miss2 = mpf(0.5) ** 2 + mpf(0.2) ** 2

    def shell(t):
        distance = mp.sqrt(miss2 + (4 - t) ** 2)
        return next((k for k in range(3) if distance < radii[k]), None)

    def extinction(t):
        return mpf(0) if shell(t) is None else mpf(extinctions[shell(t)])

    def channel(i):
        return lambda t: mpf(0) if shell(t) is None else mpf(colors[shell(t)][i])

    halves = [mp.sqrt(mpf(r) ** 2 - miss2) for r in radii]
    breaks = [4 + sign * half for half in halves for sign in (-1, 1)]
    want = ray_integral([channel(i) for i in range(3)], extinction, 8, breaks)
    assert_close(closed.concentric_shells(colors, extinctions, radii, origin, direction), want)


@given(st.floats(0, 1e4), st.floats(0, 1e4), st.floats(1e-6, 1e3), st.floats(0.01, 0.99), st.integers(-40, 0))
def test_splitting_a_segment_changes_nothing(first, last, length, where, exponent):
    first, last = first * 2.0**exponent, last * 2.0**exponent
    whole = closed.linear_both(FRONT, BACK, first, last, length)
    at = (1 - where) * first + where * last
    paint = (1 - where) * np.array(FRONT) + where * np.array(BACK)
    one = closed.linear_both(FRONT, paint, first, at, where * length)
    two = closed.linear_both(paint, BACK, at, last, (1 - where) * length)
    # T of the first part is 1 - alpha, off by eps; the cut itself shifts colour and depth by a few ulp.
    # Colours are at most 1; the worst of 20000 tries was 4.6 eps.
    assert np.abs(closed.over(one, two) - whole).max() <= 16 * EPS


@given(st.floats(0, 1e300), st.floats(0, 1e300))
def test_the_moment_lies_between_zero_and_alpha(first, last):
    moment = closed.linear_moment(first, last)
    assert 0 <= moment <= -math.expm1(-(first / 2 + last / 2)) * (1 + CLOSE)
