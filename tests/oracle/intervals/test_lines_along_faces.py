"""Where a slab test puts the ends of lines all but along faces: where lines beside them end, and no wider."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from volref.emulation.device import Device
from volref.oracle.intervals.slabs import Lines, cuts_of
from volref.oracle.intervals.slack import slack_of

LINES, MOVES = 60, 20
ERROR = 1e-6
SLACK = slack_of(Device())

# The rounding of the products that this file itself makes.
FLOAT64 = 1e-12


def lines_from(origin, along):
    off = np.full(origin.shape, ERROR)
    return Lines(origin, along, off, off, np.ones(origin.shape[1]))


def ends_of(origin, along):
    """Where lines (3, n) enter the unit cube and leave it, by the definition."""
    faces = np.array([(face - origin) / along for face in (0.0, 1.0)])
    begin, end = np.maximum(faces.min(axis=0).max(axis=0), 0), faces.max(axis=0).min(axis=0)
    return begin, end


@given(st.integers(0, 2**32 - 1))
def test_lines_beside_a_line_end_where_it_says(seed):
    rng = np.random.default_rng(seed)
    # Some are so near to a face that errors may turn them into it.
    origin = rng.choice([-1.0, 3e-6, 0.5, 1 - 5e-6, 2.5], (3, LINES))
    # Components that are 0, that errors may turn, and that they may not.
    along = rng.choice([0.0, 3e-7, -1.5e-6, 1e-5], (3, LINES))
    along[rng.integers(0, 3, LINES), np.arange(LINES)] = rng.choice([-1.0, 0.7], LINES)
    cuts = cuts_of(lines_from(origin, along), SLACK)
    for _ in range(MOVES):
        o, d = (one + rng.uniform(-ERROR, ERROR, one.shape) for one in (origin, along))
        begin, end = ends_of(o, d)
        there = begin < end
        assert (there <= cuts.maybe).all()
        assert (cuts.sure <= there).all()
        for t, place, off in ((begin, cuts.entry, cuts.entry_off), (end, cuts.exit, cuts.exit_off)):
            apart = np.abs(o + t * d - place).max(axis=0)
            assert (apart - off)[there].max(initial=0.0) <= FLOAT64


def test_a_line_parallel_to_an_axis_ends_as_surely_as_others():
    origin, along = np.full((3, 1), 0.5), np.array([[0.0], [0.0], [-1.0]])
    cuts = cuts_of(lines_from(origin, along), SLACK)
    assert cuts.sure.all()
    # Beside the line by both errors, and the same again along it.
    assert max(cuts.entry_off[0], cuts.exit_off[0]) <= 4 * ERROR
