"""Cases of interpolation: voxel types, borders, positions along the ray."""

import numpy as np
from numpy.typing import ArrayLike, DTypeLike

from volref.arrays import Floats, Numbers
from volref.phantoms.transfer import grey_ramp
from volref.records import Spans
from volref.scene import Camera, Scene, Volume
from volref.stages import sampling
from volref.studies.stability import precise, textbook
from volref.studies.stability.case import EPS, Case, Measured, measured
from volref.truth import march, tracing
from volref.workspace import Workspace

FAMILY = "Interpolation"

NOTHING_ROUNDED = "exact: the values are small whole numbers, so that no operation rounds"


def sampled(volume: Volume, index: ArrayLike) -> Floats:
    """Return volref's values at index points (n, 3), x y z."""
    position = np.array(index, dtype=np.float64).T + sampling.PAD
    return sampling.trilinear(sampling.padded_grid(volume), position, Workspace()).copy()


def _pair(low: float, high: float, dtype: DTypeLike, fraction: float) -> tuple[Numbers, Floats]:
    """Return two neighbours along x and what volref finds between them."""
    values = np.array([[[low, high]]], dtype=dtype)
    return values[0, 0], sampled(Volume(values), [(fraction, 0.0, 0.0)])


def _far_face() -> Measured:
    """Take x + 4 y + 16 z at points of the outer half voxel at high x, where it does not change with x."""
    x, y, z = np.meshgrid([3.0, 3.25, 3.5], [0.0, 1.0, 2.5], [0.0, 1.5, 3.0], indexing="ij")
    points = np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1)
    volume = Volume(np.arange(64.0).reshape(4, 4, 4))
    flat = volume.values.ravel()
    low = np.floor(points).astype(int)
    f = points[:, 0] - low[:, 0]
    first = low @ np.array([1, 4, 16])
    along = [
        flat[(first + k) % 64] + f * (flat[(first + k + 1) % 64] - flat[(first + k) % 64]) for k in (0, 4, 16)
    ]
    fy, fz = points[:, 1] - low[:, 1], points[:, 2] - low[:, 2]
    naive = along[0] + fy * (along[1] - along[0]) + fz * (along[2] - along[0])
    reference = 3.0 + 4 * points[:, 1] + 16 * points[:, 2]
    return measured(reference, naive, sampled(volume, points), 0.0)


def _near_the_last_sample() -> Measured:
    """Take an index just below the last sample, which float32 rounds up to it."""
    index = 126.99999999
    volume = Volume((np.arange(128.0) % 2 * 1e6).reshape(1, 1, 128))
    f = np.float64(np.float32(index)) - 126
    reference = 1e6 * (index - 126)
    return measured(reference, 1e6 * f, sampled(volume, [(index, 0.0, 0.0)]), 3 * EPS * 1e6)


def _lerp_end() -> Measured:
    corners, found = _pair(1e8, 1.0, np.float32, 1.0)
    return measured(1.0, textbook.lerp(corners[0], corners[1], 1.0), found, 0.0)


def _lerp_overflow() -> Measured:
    single, found = _pair(3e38, -3e38, np.float32, 0.5)
    _, largest = _pair(1e300, -1e300, np.float64, 0.5)
    naive = textbook.lerp(single[0], single[1], 0.5)
    return measured([0.0, 0.0], [naive, naive], [found[0], largest[0]], 0.0)


def _lerp_in_type(low: int, high: int, dtype: DTypeLike, fraction: float) -> Measured:
    corners, found = _pair(low, high, dtype, fraction)
    with np.errstate(all="ignore"):
        naive = float(corners[0]) + fraction * float(corners[1] - corners[0])
    return measured(low + fraction * (high - low), naive, found, 0.0)


def _uint8_mean() -> Measured:
    corners, found = _pair(200, 100, np.uint8, 0.5)
    with np.errstate(all="ignore"):
        naive = float(corners[0] + corners[1]) / 2
    return measured(150.0, naive, found, 0.0)


def _half_float() -> Measured:
    corners, found = _pair(65535, 65533, np.uint16, 0.5)
    with np.errstate(all="ignore"):
        half = corners.astype(np.float16)
    return measured(65534.0, textbook.lerp(half[0], half[1], 0.5), found, 0.0)


def _uint32_odd() -> Measured:
    corners, found = _pair(16777217, 16777217, np.uint32, 0.25)
    _, largest = _pair(4294967295, 4294967295, np.uint32, 0.25)
    naive = [float(np.float32(corners[0])), float(np.float32(4294967295))]
    return measured([16777217.0, 4294967295.0], naive, [found[0], largest[0]], 0.0)


def _int64() -> Measured:
    low, high = -(2**53), 2**53 - 2
    corners, found = _pair(low, high, np.int64, 0.5)
    single = corners.astype(np.float32)
    return measured(-1.0, textbook.lerp(single[0], single[1], 0.5), found, 0.0)


def _constant() -> Measured:
    fractions = np.random.default_rng(1).random((3, 4096))
    found = sampled(Volume(np.full((2, 2, 2), np.float32(0.1))), fractions.T)
    value = float(np.float32(0.1))
    return measured(np.full(4096, value), textbook.weighted_corners(np.full(8, value), fractions), found, 0.0)


def _denormals() -> Measured:
    values = np.array([[[1e-310, 3e-310]]])
    found = sampled(Volume(values), [(0.0, 0, 0), (0.5, 0, 0), (1.0, 0, 0)])
    reference = [1e-310, (1e-310 + 3e-310) / 2, 3e-310]
    return measured(reference, np.array(reference, np.float32), found, 5e-324 / 1e-310)


def _positions() -> Measured:
    """Trace a ray through 512 voxels at half a voxel; its own samples are the answer."""
    volume = Volume(np.zeros((512, 4, 4), np.uint8))
    camera = Camera.look_at((1.3, 1.7, 520.0), (1.9, 0.8, 0.0), (0, 1, 0), 30.0, 0.1, 1000.0)
    scene = Scene(volume, grey_ramp(), camera, 1, 1)
    found = tracing.trace(scene, (0, 0), step=0.5)
    first, step, count = found.head["span"][0], found.head["step"], len(found.table["segment"])
    distances = [first + (k + 0.5) * step for k in range(count)]
    ray = list(zip(found.head["origin"], found.head["direction"], strict=True))
    reference = np.stack([precise.along_ray(o, d, distances) for o, d in ray], axis=1)
    naive = np.empty((count, 3))
    place = np.array([o + d * distances[0] for o, d in ray], np.float32)
    stride = np.array([d * step for _, d in ray], np.float32)
    for k in range(count):
        naive[k] = place
        place = place + stride
    return measured(reference, naive, found.table["index"], 4 * EPS * 520)


def _step_count() -> Measured:
    ends = np.array([0.1 + 0.1 + 0.1, 0.8 + 0.1, 1.1 - 0.1 - 0.4])
    counts, _ = march.segments_of(Spans(np.zeros(3), ends), 0.1)
    return measured([3.0, 9.0, 6.0], np.ceil(ends / 0.1), counts, 0.0)


def _length_of_a_million() -> Measured:
    """Where a million steps of 0.1 end, or, as they come in threes, two more that are shorter."""
    counts, steps = march.segments_of(Spans(np.zeros(1), np.array([1e5])), 0.1)
    naive = float(np.add.accumulate(np.full(10**6, 0.1, np.float32))[-1])
    return measured(1e5, naive, counts * steps, 2 * EPS)


CASES = (
    Case(
        "far-face",
        FAMILY,
        "In the outer half voxel, does the value stay that of the last sample?",
        "x + 4 y + 16 z with x held at 3, the clamp of a GPU texture",
        "the flat index + 1, which at the end of a row is the first voxel of the next",
        NOTHING_ROUNDED,
        _far_face,
    ),
    Case(
        "index-126.99999999",
        FAMILY,
        "Is a point just before the last sample told from it?",
        "linear interpolation from 0 to 1e6: 1e6 (index - 126)",
        "the index in float32, which is 127",
        "three operations on 1e6",
        _near_the_last_sample,
    ),
    Case(
        "lerp-at-its-far-end",
        FAMILY,
        "Between 1e8 and 1, is the value at the second sample 1?",
        "the sample itself",
        "a + f (b - a) at f = 1 in float32: 1e8 - 1e8",
        "exact: at a sample the fraction is 0, and a + 0 (b - a) = a",
        _lerp_end,
    ),
    Case(
        "lerp-of-extremes",
        FAMILY,
        "Halfway between 3e38 and -3e38 (float32), and between 1e300 and -1e300 (float64)?",
        "0",
        "a + f (b - a) in float32: b - a is -infinity",
        "exact: float64 holds b - a, and volumes are held to 1e300",
        _lerp_overflow,
    ),
    Case(
        "uint8-200-and-100",
        FAMILY,
        "Is the mean of uint8 200 and 100 150?",
        "150",
        "200 + 100 = 44 in uint8",
        NOTHING_ROUNDED,
        _uint8_mean,
    ),
    Case(
        "int8-extremes",
        FAMILY,
        "A quarter of the way from int8 -128 to 127?",
        "-64.25",
        "127 - (-128) = -1 in int8",
        NOTHING_ROUNDED,
        lambda: _lerp_in_type(-128, 127, np.int8, 0.25),
    ),
    Case(
        "uint16-5-and-7",
        FAMILY,
        "Halfway from uint16 7 down to 5?",
        "6",
        "5 - 7 = 65534 in uint16",
        NOTHING_ROUNDED,
        lambda: _lerp_in_type(7, 5, np.uint16, 0.5),
    ),
    Case(
        "uint16-half-float",
        FAMILY,
        "Halfway between uint16 65535 and 65533?",
        "65534",
        "a half-float texture, whose largest number is 65504",
        NOTHING_ROUNDED,
        _half_float,
    ),
    Case(
        "uint32-extremes",
        FAMILY,
        "Are the uint32 codes 16777217 and 4294967295 kept apart from their neighbours?",
        "the codes themselves",
        "float32, which has 24 bits",
        "exact: float64 has 53 bits",
        _uint32_odd,
    ),
    Case(
        "int64-extremes",
        FAMILY,
        "Halfway from the int64 -2^53 to 2^53 - 2, the range that volumes may have?",
        "-1",
        "float32, which has 24 bits",
        NOTHING_ROUNDED,
        _int64,
    ),
    Case(
        "constant-field",
        FAMILY,
        "Is a field whose samples are all 0.1 exactly 0.1 everywhere?",
        "0.1 (float32) at 4096 random points",
        "eight corners times eight weights in float32, whose sum is not quite 1",
        "exact: a + f (a - a) = a",
        _constant,
    ),
    Case(
        "denormal-values",
        FAMILY,
        "Are values of 1e-310 interpolated, not flushed to 0?",
        "1e-310, 2e-310, 3e-310",
        "float32, whose least number is 1.4e-45",
        "half a unit of the denormal grid, 5e-324, per operation: one in 1e-310 for both",
        _denormals,
        "relative",
    ),
    Case(
        "positions-along-the-ray",
        FAMILY,
        "Where are the 1000 samples of a ray through 512 voxels?",
        "origin + direction t in 400 digits, from the traced ray's own numbers",
        "p += step in float32",
        "start, stride, product and sum are off by half an ulp of 520 each, and the direction's by two",
        _positions,
    ),
    Case(
        "step-count",
        FAMILY,
        "How many steps of 0.1 are in 0.3, 0.9 and 0.6, as sums of tenths?",
        "3, 9 and 6",
        "ceil(length / 0.1), of 0.30000000000000004 / 0.1",
        "exact: steps may be longer than asked by 1e-12 of them",
        _step_count,
    ),
    Case(
        "million-steps",
        FAMILY,
        "Where do a million steps of 0.1 end?",
        "1e5",
        "t += 0.1 in float32",
        "the count times the step, a quotient: two roundings",
        _length_of_a_million,
        "relative",
    ),
)
