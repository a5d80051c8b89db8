"""Fetches of places that are off lie in what `fetched` allows, which is not much wider than they are."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from volref.emulation.device import Device
from volref.oracle.intervals.fetching import fetched
from volref.oracle.intervals.slack import Slack, slack_of
from volref.oracle.intervals.slopes import Slopes
from volref.stages.textures import Texture, fetch
from volref.workspace import Workspace

KINDS = {
    "linear": {},
    "bits": {"weight_bits": 8},
    "few bits": {"weight_bits": 3},
    "codes": {"weight_bits": 8, "result_bits": 8},
    "nearest": {"filter": "nearest"},
    "nearest, cut": {"filter": "nearest", "nearest_bits": 16},
}
SHAPES = ((6, 5, 1), (1, 9, 4), (5, 4, 7, 2), (3, 1, 4, 1), (1, 1, 1, 1))
POINTS, MOVES = 40, 12

# The rounding of the sums that this file itself makes.
FLOAT64 = 1e-12


def codes(shape, rng):
    """Texels of bytes, of which a third are 0 and a third 1: as steep as can be."""
    texels = rng.integers(0, 256, shape)
    ends = rng.integers(0, 3, shape)
    return np.where(ends == 0, 0, np.where(ends == 1, 255, texels)) / 255


def moved(place, radius, rng):
    """Places up to a radius away along each axis, half of them as far as can be."""
    way = rng.uniform(-1, 1, place.shape)
    way = np.where(rng.random(place.shape) < 0.5, np.sign(way), way)
    return place.astype(np.float64) + way * radius


def near_borders(place, radius, texture, rng):
    """Places, a third of their coordinates moved to within a radius of a texel's middle or border."""
    sizes = np.array(texture.sizes)[:, None]
    border = np.rint(2 * place * sizes) / 2 / sizes + rng.uniform(-1, 1, place.shape) * radius
    return np.where(rng.random(place.shape) < 1 / 3, border, place)


def fetch_with_other_weights(texture, place, by, rng):
    """A linear fetch whose weights (one for each axis and point) are off by up to `by`, point by point."""
    sizes = np.array(texture.sizes, np.float64)[:, None]
    at = np.clip(place, 0, 1) * sizes - 0.5
    low = np.floor(at)
    weight = at - low + rng.choice([-by, 0, by], at.shape)
    found = np.empty((texture.texels.shape[-1], place.shape[1]))
    for k in range(place.shape[1]):
        mixed = texture.texels
        # From the slowest axis to the fastest, as the array has them.
        for axis in reversed(range(len(sizes))):
            size = texture.sizes[axis]
            first, second = (int(np.clip(low[axis, k] + side, 0, size - 1)) for side in (0, 1))
            mixed = mixed[first] * (1 - weight[axis, k]) + mixed[second] * weight[axis, k]
        found[:, k] = mixed
    return found


@given(
    st.sampled_from(sorted(KINDS)),
    st.sampled_from(SHAPES),
    st.sampled_from([0.0, 1e-7, 1e-4, 3e-3, 0.03, 0.2, 0.7]),
    st.integers(0, 2**32 - 1),
)
def test_a_fetch_from_a_displaced_place_lies_inside(kind, shape, reach, seed):
    rng = np.random.default_rng(seed)
    texture = Texture(codes(shape, rng), **KINDS[kind])
    radius = np.full(POINTS, reach) * rng.random(POINTS)
    place = near_borders(rng.uniform(-0.1, 1.1, (len(shape) - 1, POINTS)), radius, texture, rng)
    value, off = fetched(Slopes(texture), place, radius, slack_of(Device.named("exact")), Workspace())
    for _ in range(MOVES):
        found = fetch(texture, moved(place, radius, rng), Workspace())
        assert (np.abs(found - value) - off).max() <= FLOAT64


@given(st.sampled_from(["linear", "bits", "codes", "nearest"]), st.integers(0, 2**32 - 1))
def test_a_fetch_in_float32_lies_inside(kind, seed):
    rng = np.random.default_rng(seed)
    made = codes((5, 4, 7, 1), rng)
    wide, narrow = (Texture(made.astype(one), **KINDS[kind]) for one in (np.float64, np.float32))
    # Halves of texels and of steps of their weights among them, where one rounding decides.
    place = rng.choice([rng.random((3, POINTS)), rng.integers(0, 64, (3, POINTS)) / 64 / 7])
    slack = slack_of(Device())
    value, off = fetched(Slopes(wide), place, np.full(POINTS, slack.control), slack, Workspace())
    found = fetch(narrow, place.astype(np.float32), Workspace())
    # Codes are decoded by a rounded reciprocal: two roundings that no place moves.
    rounding = 2.0**-23 if kind == "codes" else 0.0
    assert (np.abs(found - value) - off - rounding * np.abs(value)).max() <= 0


@settings(max_examples=25)
@given(st.sampled_from(SHAPES[2:]), st.sampled_from([0.0, 1e-4, 3e-3]), st.integers(0, 2**32 - 1))
def test_a_fetch_by_weights_that_are_off_lies_inside(shape, reach, seed):
    rng = np.random.default_rng(seed)
    texture = Texture(codes(shape, rng))
    by = 2.0**-9
    place = rng.uniform(0, 1, (len(shape) - 1, POINTS))
    radius = np.full(POINTS, reach)
    value, off = fetched(Slopes(texture), place, radius, Slack(0.0, 0.0, 0.0, by), Workspace())
    for _ in range(2):
        found = fetch_with_other_weights(texture, moved(place, radius, rng), by, rng)
        assert (np.abs(found - value) - off).max() <= FLOAT64


def test_a_weight_that_is_off_moves_a_fetch_as_far_as_it_may():
    step = Texture(np.array([[[0.0], [1.0]]]))
    place = np.array([[0.5], [0.5]])
    _, off = fetched(Slopes(step), place, np.zeros(1), Slack(0.0, 0.0, 0.0, 2.0**-9), Workspace())
    # 3 (2^-9)^2 times the bound of the mixed differences is what a second axis would add.
    assert 2.0**-9 <= off[0, 0] <= 2.0**-9 * 1.02


def test_the_bound_is_what_places_reach_on_a_smooth_texture():
    z, y, x = np.meshgrid(*3 * [np.linspace(0, 1, 11)], indexing="ij")
    texture = Texture((0.3 * x + 0.2 * y * y + 0.4 * z * x)[..., None])
    place, radius = np.random.default_rng(1).uniform(0.1, 0.9, (3, 200)), np.full(200, 1e-4)
    value, off = fetched(Slopes(texture), place, radius, slack_of(Device.named("exact")), Workspace())
    far = np.zeros(200)
    for signs in np.ndindex(2, 2, 2):
        other = place + (2 * np.array(signs)[:, None] - 1) * radius
        far = np.maximum(far, np.abs(fetch(texture, other, Workspace()) - value)[0])
    assert (off[0] >= far).all()
    # Places are off by a thousandth of a texel, slopes by no more than some times 1/500 of themselves.
    assert np.median(off[0] / far) < 1.02


def test_a_place_off_a_border_is_not_taken_across_it():
    texels = np.array([[[0.0], [0.5], [1.0], [1.0]]])
    for kind in ("nearest", "bits"):
        slopes = Slopes(Texture(texels, **KINDS[kind]))
        # 0.3 of a texel inside the second; a step of a weight of 8 bits is 1/256, of which 77 are 0.3008.
        _, off = fetched(slopes, np.array([[0.325], [0.5]]), np.full(1, 1e-6), Slack(0, 0, 0, 0), Workspace())
        assert off[0, 0] == 0
