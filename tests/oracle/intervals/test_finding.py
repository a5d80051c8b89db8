"""The table over an interval of values: every place of it lies near the chord, whatever the table."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from volref.emulation.groups import TableTexture
from volref.emulation.textures.uploads import table_place
from volref.oracle.intervals.finding import Finder, Reach, classified, joined
from volref.oracle.intervals.slack import Slack
from volref.stages.textures import Texture, fetch
from volref.workspace import Workspace

EXACT = Slack(0.0, 0.0, 0.0, 0.0)
SIZES = (2, 3, 5, 32, 256)
ALONG = np.linspace(-1, 1, 241)

# The rounding of the sums that this file itself makes.
FLOAT64 = 1e-12


def tables(size, shape, rng):
    """Entries (1, size, 4): smooth, with a spike, a jump, or of noise."""
    along = np.linspace(0, 1, size)
    entries = np.stack([along, 1 - along, 0.5 + 0.4 * np.sin(7 * along), along**2], axis=1)
    if shape == "spike":
        entries[rng.integers(size)] = (1, 1, 0, 1)
    if shape == "jump":
        entries[size // 2 :] = (0.1, 0.9, 0.2, 0.95)
    if shape == "noise":
        entries = rng.random((size, 4))
    return entries[None]


def finder_of(entries, switches, slack=EXACT, **bits):
    texture = Texture(entries, "nearest" if switches.filter == "nearest" else "linear", **bits)
    pipeline = SimpleNamespace(table=switches)
    return Finder(SimpleNamespace(pipeline=pipeline, table=texture), slack)


def looked_up(finder, values):
    place = table_place(finder.textures.pipeline.table, values)
    return fetch(finder.textures.table, (place, np.full(len(place), 0.5)), Workspace())


def near_chord(points, ends, spread):
    """Whether points (4, m) lie within `spread` (4,) of some place of a chord, the same in all channels."""
    low, high = np.zeros(points.shape[1]), np.ones(points.shape[1])
    for point, first, last, beside in zip(points, *ends, spread, strict=True):
        # The shares t of the chord with |first + t (last - first) - point| <= beside.
        whole, room = last - first, beside + FLOAT64
        if abs(whole) <= FLOAT64:
            low = np.where(np.abs(point - first) <= room + FLOAT64, low, np.inf)
        else:
            sides = np.sort([(point - first - room) / whole, (point - first + room) / whole], axis=0)
            low, high = np.maximum(low, sides[0]), np.minimum(high, sides[1])
    return low <= high


@given(
    st.sampled_from(SIZES),
    st.sampled_from(["smooth", "spike", "jump", "noise"]),
    st.sampled_from(["linear", "nearest"]),
    st.sampled_from(["direct", "centered"]),
    st.sampled_from([0.0, 1e-6, 1e-3, 0.02, 0.3]),
    st.integers(0, 2**32 - 1),
)
def test_every_place_of_the_curve_lies_beside_the_chord(size, shape, kind, coordinate, reach, seed):
    rng = np.random.default_rng(seed)
    switches = TableTexture(size=size, filter=kind, coordinate=coordinate)
    finder = finder_of(tables(size, shape, rng), switches)
    values, radii = rng.uniform(-0.05, 1.05, 12), reach * rng.random(12)
    ends, spread = classified(finder, values, radii, Workspace())
    for k, (value, radius) in enumerate(zip(values, radii, strict=True)):
        found = looked_up(finder, value + radius * ALONG)
        assert near_chord(found, ends[:, :, k], spread[:, k]).all()


@pytest.mark.parametrize("bits", [{"weight_bits": 8}, {"weight_bits": 8, "result_bits": 8}])
def test_so_does_every_place_of_a_table_whose_filter_rounds(bits):
    rng = np.random.default_rng(4)
    entries = np.rint(255 * tables(32, "noise", rng)) / 255
    finder = finder_of(entries, TableTexture(size=32), **bits)
    values, radii = rng.random(60), np.full(60, 0.02)
    ends, spread = classified(finder, values, radii, Workspace())
    # A step of the weight is 2^-8 of what two entries differ by, and a code of the result 1/255.
    steps = 2.0**-8 + (2 / 255 if "result_bits" in bits else 0.0)
    for k, value in enumerate(values):
        found = looked_up(finder, value + radii[k] * ALONG)
        least, most = ends[:, :, k].min(axis=0) - spread[:, k], ends[:, :, k].max(axis=0) + spread[:, k]
        assert (found >= least[:, None] - steps).all()
        assert (found <= most[:, None] + steps).all()


def test_between_two_entries_the_chord_is_the_curve():
    switches = TableTexture(size=5)
    finder = finder_of(tables(5, "noise", np.random.default_rng(2)), switches)
    ends, spread = classified(finder, np.array([0.4]), np.array([0.05]), Workspace())
    assert spread.max() == 0
    expected = looked_up(finder, np.array([0.35, 0.45]))
    np.testing.assert_allclose(ends[:, :, 0].T, expected, rtol=0, atol=1e-15)


def test_a_spike_between_two_places_is_seen():
    entries = np.zeros((1, 256, 4))
    entries[0, 100] = 1.0
    finder = finder_of(entries, TableTexture(size=256))
    at = (100 + 0.5) / 256
    ends, spread = classified(finder, np.array([at, at, at]), np.array([0.01, 0.001, 0.1]), Workspace())
    assert (np.abs(1 - ends).min(axis=0) <= spread).all()
    # No wider than the spike is high.
    assert spread.max() <= 1.0


def test_values_and_colours_of_two_reaches_are_in_their_union():
    rng = np.random.default_rng(8)
    finder = finder_of(tables(32, "noise", rng), TableTexture(size=32))
    values, radius = rng.random((2, 20)), np.full(20, 0.01)
    one, other = (Reach(*classified(finder, v, radius, Workspace()), v, radius) for v in values)
    at = np.arange(0, 20, 2)
    both = joined(one, other.take(at), at)
    for value in values[0], np.where(np.arange(20) % 2 == 0, values[1], values[0]):
        assert (np.abs(value - both.value) <= both.radius + FLOAT64).all()
        found = looked_up(finder, value)
        middle, half = both.ends.mean(axis=0), np.abs(both.ends[1] - both.ends[0]) / 2
        assert (np.abs(found - middle) <= half + both.spread + FLOAT64).all()
