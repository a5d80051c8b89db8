"""Seed 001 held to a scalar program; what its printed equations and its bytes cost, by number."""

import dataclasses

import numpy as np
import pytest

from tests.oracles import congote as oracle
from tests.webgl.scenes import EXAMPLES
from volref import Camera, RadarVolume, Scene, Sweep, TransferFunction, Volume, emulate
from volref.emulation.catalogue import named
from volref.emulation.device import Device
from volref.emulation.loop.opacity import factor_of
from volref.emulation.rays.box import box_of
from volref.emulation.textures.lookup import look_up, textures_of
from volref.emulation.textures.slices import slice_pair
from volref.emulation.textures.uploads import uploads_of
from volref.workspace import Workspace

WIDTH, HEIGHT = 12, 9
EXACT = {"format": "exact"}


def shown(name, **groups):
    """The pipeline with few steps and a canvas that rounds nothing."""
    return named(name).with_switches(output=EXACT, stepping={"steps": 60}, **groups)


def slices(size=(9, 7, 11), seed=2):
    """Bytes [z][y][x]."""
    nx, ny, nz = size
    return np.random.default_rng(seed).integers(0, 256, (nz, ny, nx), dtype=np.uint8)


def table_of(pipeline, scene):
    return (uploads_of(scene, pipeline).table[0] / 255).tolist()


def colored(opacity=0.6, unit_distance=20.0, domain=(0, 255)):
    colors = [(0.1, 0.2, 0.9), (0.2, 0.8, 0.1), (1.0, 0.4, 0.2)]
    low, high = domain
    return TransferFunction.from_opacity(
        [low, (low + high) / 2, high], colors, [0.0, 0.3 * opacity, opacity], unit_distance
    )


GRID_CAMERA = ((40.0, -31.0, 22.0), (5.0, 3.5, 4.5), (0.1, 0.2, 1.0), 15.0)
RADAR_CAMERA = ((190e3, -260e3, 120e3), (0.0, 5e3, 9e3), (0.0, 0.1, 1.0), 34.0)
TILTS = (-5.0, 2.0, 9.0, 14.0, 40.0, 75.0)


def grid_scene():
    """Eleven slices in 4 x 3 tiles."""
    volume = Volume(slices(), spacing=(1.3, 1.1, 0.9))
    camera = Camera.look_at(*GRID_CAMERA, near=1.0, far=200.0)
    return Scene(volume, colored(), camera, WIDTH, HEIGHT)


def radar_scene():
    """Noise in every gate: 24 radials of 10 gates, 10 km each."""
    codes = slices((10, 24, len(TILTS)))
    azimuths = 3.0 + 15.0 * np.arange(24)
    sweeps = [
        Sweep.from_codes(c, 0.5, -32.0, azimuths, t, 5e3, 10e3) for c, t in zip(codes, TILTS, strict=True)
    ]
    camera = Camera.look_at(*RADAR_CAMERA, near=1e3, far=1e6)
    look = colored(domain=(-32.0, 95.5), unit_distance=40e3)
    return Scene(RadarVolume(sweeps), look, camera, WIDTH, HEIGHT), codes


def setting(scene, pipeline, value, camera):
    low, high = box_of(scene).world_from_texture[:3, 3], 0
    high = low + box_of(scene).sides
    steps, factor = pipeline.stepping.steps, factor_of(scene, pipeline, box_of(scene))
    table = table_of(pipeline, scene)
    return oracle.Setting(value, tuple(low), tuple(high), table, camera, WIDTH, HEIGHT, steps, factor)


def judged(scene, pipeline, value, camera):
    """The emulation, that of the scalar program, and pixels where a coordinate lies between two bytes."""
    program = setting(scene, pipeline, value, camera)
    out, printed = emulate(scene, pipeline), pipeline.name.endswith("-printed")
    image, samples = np.zeros((HEIGHT, WIDTH, 4)), np.zeros((HEIGHT, WIDTH), int)
    sure = np.ones((HEIGHT, WIDTH), bool)
    for y, x in np.ndindex(HEIGHT, WIDTH):
        image[y, x], samples[y, x] = oracle.drawn(program, x, y, printed)
        found = oracle.ends(program, x, y)
        sure[y, x] = found is None or np.abs(np.mod(found, 1) - 0.5).min() > 1e-3
    return out, image, samples, sure


@pytest.mark.parametrize("name", ["congote2012", "congote2012-printed"])
def test_an_atlas_is_drawn_as_the_equations_say(name):
    scene = grid_scene()
    out, image, samples, sure = judged(
        scene, shown(name), oracle.of_slices(scene.volume.values, 4), GRID_CAMERA
    )
    assert np.count_nonzero(samples[sure]) > 40
    np.testing.assert_array_equal(out.samples[sure], samples[sure])
    # Float32 is rounded alike on both sides; colours are 60 sums in float64.
    np.testing.assert_allclose(out.rgba[sure], image[sure], rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", ["congote2012-radar", "congote2012-radar-printed"])
def test_a_radar_is_drawn_as_the_equations_say(name):
    scene, codes = radar_scene()
    value = oracle.of_radar(codes.tolist(), TILTS, 3.0 - 7.5)
    out, image, samples, sure = judged(scene, shown(name), value, RADAR_CAMERA)
    assert np.count_nonzero(samples[sure]) > 40
    np.testing.assert_array_equal(out.samples[sure], samples[sure])
    np.testing.assert_allclose(out.rgba[sure], image[sure], rtol=0, atol=1e-12)


# What the printed equations cost.


def atlas(codes, **volume):
    """Lookup of values 0..1 at places (n, 3) in an atlas of bytes [z][y][x], with switches of the volume."""
    camera = Camera.look_at(*GRID_CAMERA, near=1.0, far=200.0)
    scene = Scene(Volume(codes), colored(), camera, WIDTH, HEIGHT)
    pipeline = named("congote2012").with_switches(volume=volume)
    textures = textures_of(uploads_of(scene, pipeline), pipeline, Device.named("exact"))
    return lambda places: look_up(textures, np.array(places, float).T, Workspace()).value


def numbered(count):
    """Slices of 4 x 4 voxels that hold their own number, in bytes."""
    return np.repeat(np.arange(count, dtype=np.uint8), 16).reshape(count, 4, 4)


def read_as(count, y, **volume):
    """Numbers of the slices that are read in the middle of each slice's columns, at a height y in it."""
    found = atlas(numbered(count), filter="nearest", between="none", **volume)
    return np.rint(255 * found([(0.5, y, (s + 0.5) / count) for s in range(count)])).astype(int).tolist()


@pytest.mark.parametrize(
    ("y", "read"),
    [
        # Eq. 8 in 4 x 3 tiles: the column is right; the row is 0, moved by s mod 3 thirds of a tile.
        (0.2, [0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2]),
        (0.5, [0, 1, 6, 3, 0, 5, 2, 3, 4, 1, 2]),
        (0.9, [0, 5, 6, 3, 4, 5, 2, 7, 4, 1, 6]),
    ],
)
def test_eq_8_reads_slices_of_the_lowest_two_rows_of_tiles_only(y, read):
    assert read_as(11, y) == list(range(11))
    assert read_as(11, y, tile_row="printed") == read


def test_eq_8_is_no_better_in_as_many_rows_as_columns():
    read = read_as(9, 0.2, tile_row="printed")
    assert read == [0, 1, 2] * 3
    assert read_as(9, 0.2, tile_row="rows") == list(range(9))
    assert read_as(11, 0.2, tile_row="rows") != list(range(11))


def test_eq_9_reads_the_second_slice_in_the_first_column_or_at_the_right_edge():
    """From slice M on floor(s2 / M) is 1 or more: the coordinate clamps to the last column of texels."""
    codes = slices((5, 4, 11))
    rules = {"filter": "nearest", "in_tile": "bleeds"}
    second = atlas(codes, second_column="printed", **rules)
    just_below = [((x + 0.5) / 5, 0.4, (s + 1 - 1e-9) / 11) for s in range(10) for x in range(5)]
    found = np.rint(255 * second(just_below)).astype(int).reshape(10, 5)
    for s in range(10):
        first_of_row = (s + 1) // 4 * 4
        if s + 1 < 4:
            expected = codes[first_of_row, 1]
        else:
            last = first_of_row + 3
            expected = np.full(5, codes[last, 1, -1] if last < 11 else 0)
        np.testing.assert_array_equal(found[s], expected)


def test_eq_17_extrapolates_by_as_many_times_as_there_are_slices():
    """mix(v1, v2, x S - s1): the share runs from -(S - 1) to S; where z is right it runs from 0 to 1."""
    rng = np.random.default_rng(8)
    places, size, tiles = rng.random((3, 20000)), (24, 20, 17), (5, 4)
    volume = named("congote2012").volume
    right = slice_pair(volume, size, tiles, places).share
    printed = slice_pair(dataclasses.replace(volume, between="x"), size, tiles, places).share
    assert (right.min() >= 0, right.max() < 1) == (True, True)
    assert -16 < printed.min() < -15
    assert 16 < printed.max() < 17
    assert np.mean((printed < 0) | (printed > 1)) == pytest.approx(16 / 17, abs=0.005)
    # Of noise: three values of five leave 0..1, and they are wrong by 1.9 in the root of the mean square.
    codes = slices(size)
    at = places[:, (places[2] < 16 / 17)].T
    good, bad = atlas(codes)(at), atlas(codes, between="x")(at)
    assert (good.min() >= 0, good.max() <= 1) == (True, True)
    assert (bad.min(), bad.max()) == pytest.approx((-11.3, 11.5), abs=0.1)
    assert np.mean((bad < 0) | (bad > 1)) == pytest.approx(0.595, abs=0.005)
    assert np.sqrt(np.mean((bad - good) ** 2)) == pytest.approx(1.90, abs=0.01)


def test_eq_5_puts_slices_half_a_slice_too_low_and_blends_the_last_with_nothing():
    """Slice i of S lies at i / S; its middle is at (i + 1/2) / S."""
    ramp = 10 * numbered(17)
    found, centred = atlas(ramp), atlas(ramp, slices="centers", second_slice="clamped")
    z = np.linspace(0.1, 0.9, 33)
    at = [(0.5, 0.5, zz) for zz in z]
    np.testing.assert_allclose(255 * (found(at) - centred(at)), 5.0, atol=1e-9)
    # 17 slices in 5 x 4 tiles: tile 17 is empty, and the value goes to 0 over the last 1/17 of the box.
    last = [(0.5, 0.5, (16 + part) / 17) for part in (0.0, 0.5, 0.75)]
    np.testing.assert_allclose(255 * found(last), [160.0, 80.0, 40.0], atol=1e-9)


def test_in_a_full_atlas_the_last_slice_blends_with_an_edge_of_the_last_row():
    """16 slices in 4 x 4 tiles: slice 16 would lie above the atlas, whose edge there is of slice 12."""
    found = atlas(numbered(16))
    assert 255 * found([(0.5, 0.5, 15.5 / 16)])[0] == pytest.approx((15 + 12) / 2)


def block(value=255, size=(4, 4, 4), **more):
    return Volume(np.full(size[::-1], value, np.uint8), **more)


def straight_on(volume, transfer, **more):
    """One ray through the middle of a volume, along z."""
    middle = volume.corners.mean(axis=0)
    camera = Camera.look_at(middle + np.array([0, 0, 40.0]), middle, (0, 1, 0), 2.0, 1.0, 100.0)
    return Scene(volume, transfer, camera, 1, 1, **more)


def bare(name="congote2012", **groups):
    """Without bytes on the way, and without what blends the outer slice with nothing."""
    groups = {name: dict(changes) for name, changes in groups.items()}
    groups.setdefault("volume", {})["slices"] = "centers"
    groups["volume"] |= {"second_slice": "clamped", "format": "exact"}
    return named(name).with_switches(rays=EXACT, table=EXACT, output=EXACT, **groups)


def test_eq_4_makes_an_opaque_white_block_grey():
    """A grows by a whatever is in front, and reaches 1 when the colour is about 1/2; it may overshoot by a.

    With n samples of opacity a = 1 / n: C = sum of (1 - k a) a = 1 - (n - 1) / 2 n.
    """
    white = TransferFunction.from_opacity([0, 255], [(1, 1, 1)] * 2, [0.9, 0.9])
    scene = straight_on(block(), white)

    def drawn(rule, factor):
        return emulate(scene, bare(opacity={"factor": factor / 0.9}, accumulation={"rule": rule})).rgba[0, 0]

    red, alpha = drawn("add-alpha", 2.0)[[0, 3]]
    # In float64 a hundred times 0.01 falls a hair short of 1, and one sample more is taken.
    assert red == pytest.approx(0.505, abs=1e-9)
    assert alpha == pytest.approx(1.0, abs=0.0101)
    red, alpha = drawn("over", 2.0)[[0, 3]]
    assert red == alpha == pytest.approx(1 - 0.99**200, abs=1e-9)
    red, alpha = drawn("add-alpha", 60.0)[[0, 3]]
    assert (red, alpha) == pytest.approx((0.3 + 0.21 + 0.12 + 0.03, 1.2), abs=1e-9)


def test_eq_1_draws_what_the_table_has_transparent():
    """V_a, the value, stands where the table's opacity belongs."""
    clear = TransferFunction.from_opacity([0, 255], [(1, 1, 1)] * 2, [0.0, 0.0])
    scene = straight_on(block(128), clear)

    def alpha(source):
        return emulate(scene, bare(opacity={"source": source, "factor": 1.0})).rgba[0, 0, 3]

    assert alpha("table") == 0
    assert alpha("value") == pytest.approx(1 - (1 - 128 / 255 / 200) ** 200, abs=1e-9)


def test_opacity_does_not_know_how_long_a_ray_is():
    """Eq. 1 divides by the number of steps: a path of 1 through a slab and one of 2 look the same."""
    fog = TransferFunction.from_opacity([0, 255], [(1, 1, 1)] * 2, [0.5, 0.5])
    slab = block(size=(40, 40, 4), spacing=(1.0, 1.0, 0.25))
    middle = slab.corners.mean(axis=0)
    truths = []
    for tilt in (0.0, 60.0):
        away = np.array([np.sin(np.radians(tilt)), 0.0, np.cos(np.radians(tilt))])
        camera = Camera.look_at(middle + 30 * away, middle, (0, 1, 0), 2.0, 1.0, 100.0)
        scene = Scene(slab, fog, camera, 1, 1)
        alpha = emulate(scene, bare(opacity={"factor": 1.0})).rgba[0, 0, 3]
        assert alpha == pytest.approx(1 - (1 - 0.5 / 200) ** 200, abs=1e-9)
        truths.append(emulate(scene, bare(opacity={"rule": "corrected"})).rgba[0, 0, 3])
    assert truths == pytest.approx([0.5, 0.75], abs=1e-6)


@pytest.mark.parametrize(
    ("name", "share"),
    [("oblique", 0.030), ("full", 0.029), ("turned", 0.026), ("dense", 0.138), ("thin", 0.0)],
)
def test_bytes_of_the_colour_cube_change_pixels(name, share):
    """So many of the drawn pixels change by more than 1/255 from coordinates in floats to those in bytes."""
    scene = EXAMPLES[name].make()
    exact = named("congote2012").with_switches(output=EXACT)
    coded, floating = (
        emulate(scene, exact.with_switches(rays={"format": kind})).rgba for kind in ("unorm8", "float")
    )
    off = np.abs(coded - floating).max(axis=-1) > 1 / 255
    assert off.sum() / floating.any(axis=-1).sum() == pytest.approx(share, abs=5e-4)
