"""Rays cut at the planes of the grid, against exact rational arithmetic.

R rays; origins and directions are (3, R) in index space, before padding.
"""

from fractions import Fraction
from itertools import product
from math import floor

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from volref import Camera, Scene, TransferFunction, Volume
from volref.planning import plan
from volref.records import Spans
from volref.stages import cells
from volref.stages.cells import cells_along, position_error, recentred
from volref.stages.sampling import PAD
from volref.stages.spans import box_spans
from volref.truth.exact import prepare

U = Fraction(1, 2**53)
CAMERA = Camera.look_at((0, 0, -9), (0, 0, 0), (0, 1, 0), 30.0, 0.1, 100.0)
FOG = TransferFunction([0.0], [(1, 1, 1)], [1.0])
few = settings(max_examples=25)  # fractions are slow


def noise(shape=(4, 5, 6), dtype=np.float64, seed=1, **place):
    values = np.random.default_rng(seed).random(shape)
    if np.dtype(dtype).kind == "u":
        values *= np.iinfo(dtype).max
    return Volume(values.astype(dtype), **place)


class Cut:
    """Rays through a volume, recentred, cut, and where each piece lies: middle t (n,)."""

    def __init__(self, volume, origins, directions, *, precise=True, table=FOG):
        self.volume = volume
        scene = Scene(volume, table, CAMERA, 4, 4)
        self.grid = prepare(scene, plan(scene, method="exact")).grid
        origins, directions = (np.array(x, float).reshape(-1, 3).T for x in (origins, directions))
        spans = box_spans(origins, directions, *volume.index_bounds)
        self.moved, self.rests, self.spans = recentred(origins, directions, spans, PAD)
        self.directions = directions
        args = self.grid, self.moved, self.rests, directions, self.spans
        self.pieces = cells_along(*args, precise=precise)
        self.error = position_error(self.grid, self.moved, directions, self.spans)
        rays, near, far = cells._near_part(self.grid, self.moved, directions, self.spans)
        nothing = rays, np.empty(0), np.empty(0)
        between = (
            cells._between_planes(self.moved[:, rays], directions[:, rays], near, far)
            if len(rays)
            else nothing
        )
        ray, self.length, self.middle = between
        self.ray = rays[ray]

    def position(self, j, v):
        """The exact padded position at v of piece j, were none dropped."""
        ray, t = self.ray[j], Fraction(self.middle[j]) + v * Fraction(self.length[j])
        columns = zip(*(x[:, ray] for x in (self.moved, self.rests, self.directions)), strict=True)
        return [Fraction(o) + Fraction(rest) + t * Fraction(d) for o, rest, d in columns]

    def whole(self, j):
        """The cell of piece j, as float64 arithmetic places its middle."""
        ray = self.ray[j]
        return [
            floor(d * self.middle[j] + o)
            for o, d in zip(self.moved[:, ray], self.directions[:, ray], strict=True)
        ]


def trilinear(volume, position):
    """The field at a padded position, in exact arithmetic."""
    whole = [floor(x) for x in position]
    fraction = [x - i for x, i in zip(position, whole, strict=True)]
    total = Fraction(0)
    for bits in product((0, 1), repeat=3):
        share = Fraction(1)
        for bit, f in zip(bits, fraction, strict=True):
            share *= f if bit else 1 - f
        x, y, z = (
            min(max(i + bit - 1, 0), n - 1) for i, bit, n in zip(whole, bits, volume.size, strict=True)
        )
        total += share * Fraction(float(volume.values[z, y, x]))
    return total


def cubic_at(pieces, j, v):
    c0, c1, c2, c3 = (Fraction(c) for c in pieces.cubic[:, j])
    return ((c3 * v + c2) * v + c1) * v + c0


def assert_true(cut):
    """Pieces cover the spans in order, lie in their cells, and have the values of the field."""
    pieces = cut.pieces
    assert pieces.ray.tolist() == cut.ray.tolist()
    for ray in range(cut.moved.shape[1]):
        span = cut.spans.t_far[ray] - cut.spans.t_near[ray]
        # Each end of a piece is rounded.
        mine = cut.ray == ray
        assert abs(cut.length[mine].sum() - max(span, 0.0)) <= (2 + mine.sum()) * 2.0**-52 * abs(span)
    for j in range(len(pieces.ray)):
        error = Fraction(cut.error[pieces.ray[j]])
        own = max(Fraction(0), (1 - Fraction(pieces.astray[j])) / 2)
        for v in (-own, -own / 3, Fraction(0), own * 4 / 5, own):
            position = cut.position(j, v)
            if own > 0:
                assert all(i <= x <= i + 1 for x, i in zip(position, cut.whole(j), strict=True)), (j, v)
                off = abs(trilinear(cut.volume, position) - cubic_at(pieces, j, v))
                assert off <= Fraction(pieces.slack[j]), (j, float(off), pieces.slack[j])
            else:
                assert all(
                    i - 2 * error <= x <= i + 1 + 2 * error
                    for x, i in zip(position, cut.whole(j), strict=True)
                )


# --- rays of all kinds

KINDS = {
    "slanted": ([(-3, -2, -1), (9, 1, 2)], [(0.7, 0.4, 0.5), (-0.8, 0.1, 0.05)]),
    "along the axes": ([(-3, 1.3, 2.2), (2.2, -9, 1.1), (2.5, 3.1, 9)], [(1, 0, 0), (0, 1, 0), (0, 0, -1)]),
    "in lattice planes": ([(2, -3, 1.7), (-3, 3, 2), (1, 1, -2)], [(0, 0.6, 0.1), (0.8, 0, 0), (0, 0, 1)]),
    "along the diagonal": ([(-2, -2, -2), (6, 6, 6)], [(0.5, 0.5, 0.5), (-1, -1, -1)]),
    "through corners": ([(-1, 0, 1), (5, 4, 0)], [(1, 1, 0.5), (-0.5, -0.5, 0.25)]),
    "hardly slanted": ([(2, 2, -3), (2.5, 1 - 1e-13, -3)], [(1e-13, -1e-13, 1), (-1e-300, 1e-13, 1)]),
    "grazing a face": ([(-3, -0.5, 1.2), (-3, 4.5, 1.2)], [(1, 0, 0.1), (1, -1e-13, 0)]),
    "from inside": ([(2.2, 1.7, 1.9), (2, 3, 1), (-0.5, 2, 2)], [(0.3, -0.4, 0.2), (1, 1, 0), (1, 0, 0.5)]),
    "from far away": ([(-1e7, 2.3, 1e7 + 0.7)], [(1e7 + 2.5, 0.1, -1e7)]),
    "at a power of two": ([(2.0**24 - 0.05, 2.0**24 + 4.0, 1.5)], [(-1.0, -1.0, 1e-9)]),
    "missing it": ([(9, 9, 9), (-3, 2, 2)], [(1, 0, 0), (0, 1, 0)]),
    "on the wrong side of a plane by rounding": ([(np.nextafter(2, 0), 1.2, -1)], [(0, 0, 1)]),
}


@pytest.mark.parametrize("precise", [False, True])
@pytest.mark.parametrize("kind", KINDS)
def test_pieces_have_the_values_of_the_field(kind, precise):
    assert_true(Cut(noise(), *KINDS[kind], precise=precise))


@pytest.mark.parametrize("dtype", [np.uint8, np.float32, np.uint16])
def test_samples_of_other_types_are_exact_too(dtype):
    assert_true(Cut(noise(dtype=dtype), *KINDS["slanted"]))


@pytest.mark.parametrize("shape", [(1, 1, 1), (1, 5, 1), (4, 1, 6)])
def test_axes_of_one_voxel_are_constant(shape):
    assert_true(Cut(noise(shape), *KINDS["slanted"]))
    assert_true(Cut(noise(shape), *KINDS["in lattice planes"]))


def test_node_volumes_end_at_their_outer_samples():
    cut = Cut(noise(centering="node"), *KINDS["slanted"])
    assert_true(cut)
    assert len(cut.pieces.ray) > 0


def test_values_large_against_their_differences_keep_the_digits_that_there_are():
    volume = Volume(1e8 + np.random.default_rng(3).random((4, 5, 6)))
    cut = Cut(volume, *KINDS["slanted"])
    assert_true(cut)
    # Half an ulp of the value, and a few ulp of the differences.
    assert cut.pieces.slack.max() <= 1e8 * 2.0**-53 * 1.001


component = st.one_of(
    st.sampled_from([0.0, 1.0, -1.0, 0.5, 1e-13, -1e-16]), st.floats(-1.0, 1.0), st.integers(-4, 4).map(float)
)
place = st.one_of(
    st.integers(-1, 6).map(float), st.integers(-2, 12).map(lambda k: k / 2), st.floats(-0.5, 4.0)
)


@few
@given(
    st.lists(st.tuples(*[place] * 3), min_size=1, max_size=2),
    st.tuples(*[component] * 3).filter(lambda d: max(map(abs, d)) > 1e-3),
    st.sampled_from([0.0, 3.0, 1e5]),
    st.booleans(),
)
def test_pieces_of_any_ray_have_the_values_of_the_field(targets, direction, back, precise):
    origins = [[x - back * d for x, d in zip(target, direction, strict=True)] for target in targets]
    assert_true(Cut(noise(), origins, [direction] * len(origins), precise=precise))


@pytest.mark.parametrize("precise", [False, True])
def test_the_slack_is_of_use(precise):
    rng = np.random.default_rng(4)
    targets, directions = rng.random((100, 3)) * 4, rng.normal(size=(100, 3))
    cut = Cut(noise(), targets - 5 * directions, directions, precise=precise)
    error = np.array(
        [
            max(
                float(abs(trilinear(cut.volume, cut.position(j, v)) - cubic_at(cut.pieces, j, v)))
                for v in (Fraction(-1, 3), Fraction(1, 4))
            )
            for j in range(len(cut.ray))
        ]
    )
    # Errors are those of a few roundings; the bound has all of them against it, at any place of the grid.
    assert np.median(cut.pieces.slack) <= (300 if precise else 1000) * np.median(error)
    # 16 indices of position, 70 roundings, an ulp of the value: of differences of at most 1.
    assert cut.pieces.slack.max() <= (4 * 40 + 70 + 1) * float(U) * (7 if not precise else 3)


def test_a_constant_field_has_no_slack():
    cut = Cut(Volume(np.full((4, 5, 6), 0.3)), *KINDS["slanted"])
    assert (cut.pieces.slack == 0).all()
    assert (cut.pieces.cubic[0] == 0.3).all()


@pytest.mark.parametrize("precise", [False, True])
@pytest.mark.parametrize("term", range(1, 8))
def test_the_first_size_bounds_the_partial_derivatives(term, precise):
    # One product of x, y and z at a time, on a piece along the diagonal from end to end of the cell.
    corners = tuple(
        np.array([float(all(corner & bit or not term & bit for bit in (1, 2, 4)))]) for corner in range(8)
    )
    half, one = [np.array([0.5])] * 3, [np.array([1.0])] * 3
    cubic, moved, size = cells._cubic(list(corners), half, one, precise=precise)
    degree = bin(term).count("1")
    assert cubic[:, 0].sum() != 0
    assert moved[0] >= degree  # at the far corner each of the derivatives is 1
    assert size[0] >= 1


# --- what is dropped


@few
@given(st.integers(0, 99), st.sampled_from([(4, 5, 6), (11, 12, 9)]))
def test_only_cells_that_cannot_be_seen_are_dropped(seed, shape):
    values = np.random.default_rng(seed).random(shape) ** 8
    table = TransferFunction([0.5, 0.6], [(1, 1, 1)] * 2, [0.0, 1.0])
    rng = np.random.default_rng(seed)
    directions = rng.normal(size=(8, 3)) * (rng.random((8, 3)) < 0.8) + 1e-9
    origins = rng.random((8, 3)) * shape[::-1] - 30 * directions
    full, sparse = (Cut(Volume(values), origins, directions, table=t) for t in (FOG, table))

    def found(cut):
        return list(
            zip(cut.pieces.ray.tolist(), cut.pieces.length.tolist(), cut.pieces.cubic.T.tolist(), strict=True)
        )

    kept = found(sparse)
    for ray, length, cubic in found(full):
        v = np.linspace(-0.5, 0.5, 9)
        seen = np.polynomial.polynomial.polyval(v, cubic).max() > 0.5 + 1e-9
        # Where a ray first comes near anything seen it may be cut once more.
        if seen and length > 1e-9:
            assert (
                any(r == ray and abs(c[0] - cubic[0]) < 1e-12 for r, _, c in kept)
                or sum(length for r, length, _ in kept if r == ray) > 0
            )
    assert sum(p[1] for p in kept) <= sum(p[1] for p in found(full)) * (1 + 1e-12)


def test_a_visible_voxel_in_an_empty_volume_is_found_from_everywhere():
    values = np.zeros((17, 18, 19))
    values[9, 5, 12] = 1.0
    rng = np.random.default_rng(8)
    directions = rng.normal(size=(300, 3))
    # Past the voxel by less than one along each axis: some of the 8 cells around it are met.
    origins = np.array([12, 5, 9]) + rng.uniform(-0.9, 0.9, (300, 3)) - 40 * directions
    cut = Cut(Volume(values), origins, directions, table=TransferFunction([0, 1], [(1, 1, 1)] * 2, [0, 1.0]))
    assert set(cut.pieces.ray.tolist()) == set(range(300))
    assert cut.pieces.length.sum() < 0.5 * (cut.spans.t_far - cut.spans.t_near).sum()


# --- recentring

number = st.one_of(st.floats(-1e8, 1e8), st.floats(-1.0, 1.0), st.just(0.0), st.just(2.0**24 - 0.05))


@given(st.tuples(*[number] * 6), st.floats(0.0, 1e8), st.floats(1e-6, 1e8))
def test_a_moved_origin_and_its_rest_are_the_ray_to_twice_the_digits(ray, t_near, length):
    origin, direction = np.array(ray[:3])[:, None], np.array(ray[3:])[:, None]
    spans = Spans(np.array([t_near]), np.array([t_near + length]))
    moved, rest, shifted = recentred(origin, direction, spans, PAD)
    middle = 0.5 * (spans.t_near[0] + spans.t_far[0])
    for axis in range(3):
        o, d = Fraction(origin[axis, 0]), Fraction(direction[axis, 0])
        exact = o + d * Fraction(middle) + PAD
        size = abs(o) + abs(d * Fraction(middle)) + PAD
        # Products of what is rounded off: u^2, and what underflows.
        assert abs(Fraction(moved[axis, 0]) + Fraction(rest[axis, 0]) - exact) <= 8 * U**2 * size + Fraction(
            1, 2**1000
        )
        assert abs(rest[axis, 0]) <= 0.5 * np.spacing(abs(moved[axis, 0])) * (1 + 1e-15)
    assert shifted.t_near[0] == t_near - middle
    assert shifted.t_far[0] == spans.t_far[0] - middle


def test_empty_spans_stay_empty():
    spans = Spans(np.array([3.0, np.inf]), np.array([2.0, -np.inf]))
    moved, rest, shifted = recentred(np.ones((3, 2)), np.ones((3, 2)), spans, 0.0)
    assert (shifted.t_near >= shifted.t_far).all()
    assert (moved == 1).all()
    assert (rest == 0).all()


@pytest.mark.parametrize("kind", KINDS)
def test_no_position_is_further_off_than_its_error(kind):
    cut = Cut(noise((9, 30, 60)), *KINDS[kind])
    for j, ray in enumerate(cut.ray):
        for v in (-0.5, 0.0, 0.5):
            exact = cut.position(j, Fraction(v))
            for axis in range(3):
                d = cut.directions[axis, ray]
                found = Fraction(d * cut.middle[j] + cut.moved[axis, ray]) + Fraction(v) * Fraction(
                    d * cut.length[j]
                )
                assert abs(found - exact[axis]) <= Fraction(cut.error[ray])


def test_the_error_of_positions_is_of_use():
    cut = Cut(noise((9, 30, 60)), *KINDS["slanted"])
    # The origin, twice the way in indices, and the grid's size: each at most 128.
    assert (cut.error <= 4 * 128 * float(U)).all()
