"""What programs upload, texel by texel: atlases, number formats, classified voxels, tables, domains."""

import math
from itertools import product

import numpy as np
import pytest

from tests.emulation.scenes import radar_example
from volref import Camera, Pipeline, Scene, TransferFunction, TransferFunction2D, Volume
from volref.emulation.device import Device
from volref.emulation.groups import TableTexture, VolumeTexture
from volref.emulation.textures.lookup import look_up, textures_of
from volref.emulation.textures.uploads import (
    CANVAS_ROWS,
    atlas_of,
    baked_table,
    domain_of,
    table_place,
    table_texture,
    tiles_of,
    uploads_of,
    volume_texture,
)
from volref.image import decode_srgb
from volref.workspace import Workspace

CAMERA = Camera.look_at((3, 3, 30), (3, 3, 3), (0, 1, 0), 30, 1, 90)
COLORS = np.array([(0.1, 0.9, 0.3), (0.6, 0.2, 0.5), (1.0, 0.4, 0.0)])
KNOTS, OPACITY = np.array([10.0, 70.0, 210.0]), np.array([0.0, 0.8, 0.3])


def scene(values, transfer=None, **place):
    usual = TransferFunction.from_opacity(KNOTS, COLORS, OPACITY, 2.0)
    return Scene(Volume(np.asarray(values), **place), transfer or usual, CAMERA, 2, 2)


def bent(values):
    """Straight rgba (n, 4) of values by the knots above, held beyond them."""
    rgba = np.column_stack([COLORS, OPACITY])
    return np.stack([np.interp(values, KNOTS, channel) for channel in rgba.T], axis=-1)


def some_values(size=(5, 3, 4), low=0, high=256, seed=1):
    return np.random.default_rng(seed).integers(low, high, size)


def tiled(slices, across, *, first_tile, rows, padding):
    """The atlas of slices[z][y][x], written down texel by texel; row 0 at v = 0."""
    depth, height, width = slices.shape[:3]
    tall, wide, down = height + 2 * padding, width + 2 * padding, math.ceil(depth / across)
    atlas = np.zeros((down * tall, across * wide, slices.shape[3]), slices.dtype)
    for z in range(depth):
        tile_column, tile_row = z % across, z // across
        if first_tile == "v1":
            tile_row = down - 1 - tile_row
        for row in range(tall):
            y = (row if rows == "with-v" else tall - 1 - row) - padding
            for column in range(wide):
                x = column - padding
                inside = slices[z, min(max(y, 0), height - 1), min(max(x, 0), width - 1)]
                atlas[tile_row * tall + row, tile_column * wide + column] = inside
    return atlas


@pytest.mark.parametrize(
    ("first_tile", "rows", "padding"), [*product(("v0", "v1"), ("with-v", "against-v"), (0, 1, 3))]
)
@pytest.mark.parametrize("across", [1, 2, 3, 5, 7])
def test_an_atlas_is_what_a_loop_over_its_texels_writes(across, first_tile, rows, padding):
    slices = some_values((5, 3, 4, 2), low=1)
    switches = VolumeTexture("atlas", first_tile=first_tile, rows=rows, padding=padding)
    found = atlas_of(slices, switches, (across, math.ceil(5 / across)))
    expected = tiled(slices, across, first_tile=first_tile, rows=rows, padding=padding)
    np.testing.assert_array_equal(found, expected)


def test_an_atlas_is_as_square_as_can_be_and_its_last_row_of_tiles_may_be_short():
    for slices in range(1, 200):
        across, down = tiles_of(VolumeTexture("atlas"), slices)
        assert (across - 1) ** 2 < slices <= across**2
        assert (down - 1) * across < slices <= down * across
    assert tiles_of(VolumeTexture("atlas", tiles_across=9), 4) == (9, 1)


def test_an_atlas_of_a_program_has_its_slices_and_its_tiles():
    values = some_values()
    program = Pipeline("p", domain=(0, 255)).with_switches(volume={"layout": "atlas", "first_tile": "v1"})
    uploads = uploads_of(scene(values), program)
    expected = tiled(values.astype(np.uint8)[..., None], 3, first_tile="v1", rows="with-v", padding=0)
    np.testing.assert_array_equal(uploads.volume, expected)
    assert (uploads.tiles, uploads.size, uploads.grid) == ((3, 2), (4, 3, 5), None)


def test_bytes_are_the_nearest_and_what_is_beyond_the_domain_is_at_its_ends():
    values = np.array([[[-40.0, 0.0, 0.5, 99.9, 100.0, 1e9, 20 / 255, 30.5]]])
    found = uploads_of(scene(values), Pipeline("p", domain=(0, 100))).volume
    assert found.dtype == np.uint8
    # 30.5 / 100 of 255 is 77.775.
    assert found.reshape(-1).tolist() == [0, 0, 1, 255, 255, 255, 0, 78]


def test_the_difference_of_narrow_codes_is_not_taken_in_their_own_type():
    values = np.array([[[-128, -1, 0, 127]]], np.int8)
    found = uploads_of(scene(values), Pipeline("p", domain=(-128, 127))).volume
    assert found.reshape(-1).tolist() == [0, 127, 128, 255]


@pytest.mark.parametrize(("kind", "type_"), [("half", np.float16), ("float", np.float32)])
def test_floats_are_rounded_to_their_type_and_not_held(kind, type_):
    values = np.random.default_rng(2).normal(0.5, 1.0, (2, 3, 4))
    program = Pipeline("p", domain=(0, 1)).with_switches(volume={"format": kind})
    found = uploads_of(scene(values), program).volume
    assert found.shape == (2, 3, 4, 1)
    assert found.min() < 0
    # Through float32, as a shader or an upload has it, to the type.
    np.testing.assert_array_equal(found[..., 0], values.astype(np.float32).astype(type_).astype(np.float64))


def test_exact_texels_lose_nothing():
    values = np.random.default_rng(3).normal(size=(2, 3, 4))
    program = Pipeline("p", domain=(0, 1)).with_switches(volume={"format": "exact"})
    np.testing.assert_array_equal(uploads_of(scene(values), program).volume[..., 0], values)


@pytest.mark.parametrize("layout", ["3d", "atlas"])
def test_sixteen_bits_in_two_channels_are_put_together_again(layout):
    values = some_values((3, 4, 5), high=65536)
    program = Pipeline("p", domain=(0, 65535)).with_switches(
        volume={"format": "unorm16-split", "layout": layout, "filter": "nearest", "between": "none"}
    )
    uploads = uploads_of(scene(values), program)
    assert uploads.volume.dtype == np.uint8
    if layout == "3d":
        high, low = np.moveaxis(uploads.volume.astype(np.int64), -1, 0)
        np.testing.assert_array_equal(256 * high + low, values)
    z, y, x = (np.stack(np.meshgrid(*map(np.arange, values.shape), indexing="ij")).reshape(3, -1) + 0.5) / (
        np.array(values.shape)[:, None]
    )
    # A thousandth beyond the first of two slices, whose place in float64 may round to just before it.
    found = look_up(textures_of(uploads, program, Device()), np.stack([x, y, z + 1e-3 / 3]), Workspace())
    # Two products and a sum in float64.
    np.testing.assert_allclose(found.value, values.reshape(-1) / 65535, rtol=0, atol=3e-16)


@pytest.mark.parametrize("kind", ["unorm8", "exact"])
@pytest.mark.parametrize("coordinate", ["direct", "centered"])
@pytest.mark.parametrize("layout", ["3d", "atlas"])
def test_voxels_that_are_classified_before_they_are_uploaded_hold_the_tables_colours(
    layout, coordinate, kind
):
    values = some_values((4, 3, 2), low=-20, high=300)
    program = Pipeline("p", domain=(0, 255)).with_switches(
        volume={"layout": layout, "format": kind},
        table={"order": "pre", "format": "exact", "size": 16, "coordinate": coordinate},
    )
    found = uploads_of(scene(values), program).volume
    colours = np.zeros((4, 3, 2, 4))
    entries = bent(255 * (np.arange(16) + 0.5) / 16)
    for index in np.ndindex(4, 3, 2):
        unit = values[index] / 255
        place = 16 * unit if coordinate == "direct" else 15 * unit + 0.5
        place = min(max(place, 0.0), 16.0) - 0.5
        lower = math.floor(place)
        one, two = (entries[min(max(k, 0), 15)] for k in (lower, lower + 1))
        colours[index] = one + (place - lower) * (two - one)
    if layout == "atlas":
        colours = tiled(colours, 2, first_tile="v0", rows="with-v", padding=0)
    # A byte is half a step beside the colour; float64's own rounding of the place otherwise.
    found, limit = (found, 1e-12) if kind == "exact" else (found / 255, 0.5 / 255 + 1e-7)
    np.testing.assert_allclose(found, colours, rtol=0, atol=limit)


def test_entries_of_a_table_are_the_transfer_functions_own_values():
    where = {
        "centers": [(k + 0.5) / 16 for k in range(16)],
        "ends": [k / 15 for k in range(16)],
        "canvas": [foot_on_gradient(k + 0.5, 0.5, 15, CANVAS_ROWS - 1) for k in range(16)],
    }
    for baked, shares in where.items():
        program = Pipeline("p").with_switches(
            table={"size": 16, "baked": baked, "rows": 3, "format": "exact"}
        )
        found = baked_table(scene(some_values()), program, (-20.0, 236.0))
        expected = bent(-20 + 256 * np.array(shares))
        for row in found:
            # Float64 on both sides.
            np.testing.assert_allclose(row, expected, rtol=0, atol=1e-14, err_msg=baked)


def test_opacities_of_a_texture_of_their_own_have_its_format():
    program = Pipeline("p").with_switches(table={"size": 16, "format": "unorm8", "opacity_format": "exact"})
    both = uploads_of(scene(some_values()), program).table
    apart = {
        kind: uploads_of(scene(some_values()), program.with_switches(table=switches)).table
        for kind, switches in (
            ("bytes", {"opacity_format": None}),
            ("exact", {"format": "exact", "opacity_format": None}),
        )
    }
    np.testing.assert_array_equal(both[..., :3], apart["bytes"][..., :3] / 255)
    np.testing.assert_array_equal(both[..., 3], apart["exact"][..., 3])


def foot_on_gradient(x, y, right, bottom):
    """The share of the way from (0, 0) to (right, bottom) at which the foot of (x, y) lies."""
    length = math.hypot(right, bottom)
    return (x * right / length + y * bottom / length) / length


def test_entries_of_extinctions_are_the_opacity_of_one_unit_distance():
    transfer = TransferFunction(KNOTS, COLORS, [0.0, 1.5, 0.2], unit_distance=1.0)
    program = Pipeline("p").with_switches(table={"size": 8})
    found = baked_table(scene(some_values(), transfer), program, (10.0, 210.0))[0, :, 3]
    sigma = np.interp(10 + 200 * (np.arange(8) + 0.5) / 8, KNOTS, [0.0, 1.5, 0.2])
    np.testing.assert_allclose(found, 1 - np.exp(-sigma), rtol=0, atol=1e-14)


def test_an_empty_last_column_is_transparent_black_in_all_rows():
    program = Pipeline("p").with_switches(table={"size": 8, "rows": 2, "last_column": "empty"})
    found = uploads_of(scene(some_values()), program).table
    filled = uploads_of(scene(some_values()), program.with_switches(table={"last_column": "filled"})).table
    assert not found[:, -1].any()
    assert filled[:, -1].any()
    np.testing.assert_array_equal(found[:, :-1], filled[:, :-1])


@pytest.mark.parametrize(("kind", "limit"), [("exact", 1e-14), ("unorm8", 0.0)])
def test_tables_that_are_decoded_from_srgb_are_uploaded_encoded_but_for_alpha(kind, limit):
    # 1e-14: the curve and its inverse in float64.
    program = Pipeline("p").with_switches(table={"size": 8, "format": kind, "srgb": True})
    plain = program.with_switches(table={"srgb": False})
    coded, linear = (uploads_of(scene(some_values()), p).table for p in (program, plain))
    np.testing.assert_array_equal(coded[..., 3], linear[..., 3])
    unit = coded / 255 if kind == "unorm8" else coded
    light = np.concatenate([decode_srgb(unit[..., :3]), unit[..., 3:]], axis=-1)
    if kind == "exact":
        np.testing.assert_allclose(light, linear, rtol=0, atol=limit)
    fetched = table_texture(uploads_of(scene(some_values()), program), program, Device()).texels
    np.testing.assert_allclose(fetched, light, rtol=0, atol=limit)


def test_a_filter_of_bytes_has_the_bits_of_the_device_and_one_of_floats_or_srgb_has_none():
    device = Device("d", weight_bits=8, result_bits=8, nearest_bits=16)
    bits = {"weight_bits": 8, "result_bits": 8, "nearest_bits": 16}
    for kind, srgb, narrow in (("unorm8", False, True), ("float", False, False), ("unorm8", True, False)):
        program = Pipeline("p").with_switches(
            table={"format": kind, "srgb": srgb, "filter": "nearest"}, volume={"format": kind}
        )
        uploads = uploads_of(scene(some_values()), program)
        table, volume = (make(uploads, program, device) for make in (table_texture, volume_texture))
        assert {name: getattr(table, name) for name in bits} == (bits if narrow else dict.fromkeys(bits))
        assert (volume.weight_bits, table.filter, volume.filter) == (
            8 if kind == "unorm8" else None,
            "nearest",
            "linear",
        )


def test_values_are_looked_up_in_their_own_type():
    values = np.float32([0.0, 0.1, 1.0])
    table = TableTexture(size=256, coordinate="centered")
    found = table_place(table, values)
    assert found.dtype == np.float32
    np.testing.assert_array_equal(found, (values * np.float32(255) + np.float32(0.5)) / np.float32(256))
    assert table_place(TableTexture(), values) is values


def test_the_domain_is_the_programs_then_the_tables_then_the_volumes():
    spread, one = some_values(low=5, high=90), np.full((2, 2, 2), 7.0)
    jump = TransferFunction.from_opacity([40.0, 40.0], COLORS[:2], [0.0, 0.5])
    assert domain_of(scene(spread), Pipeline("p", domain=(-1, 1))) == (-1.0, 1.0)
    assert domain_of(scene(spread), Pipeline("p")) == (10.0, 210.0)
    assert domain_of(scene(spread, jump), Pipeline("p")) == (float(spread.min()), float(spread.max()))
    low, high = domain_of(scene(one, jump), Pipeline("p"))
    assert low == 7.0 < high
    two = TransferFunction2D(np.ones((4, 4, 4)) * 0.5, (3.0, 9.0), (0.0, 1.0))
    assert domain_of(scene(spread, two), Pipeline("p")) == (3.0, 9.0)


@pytest.mark.parametrize("value", [1e18, -(2.0**53), 1e-300])
def test_a_volume_of_one_large_value_has_a_domain_all_the_same(value):
    jump = TransferFunction.from_opacity([value, value], COLORS[:2], [0.0, 0.5])
    one = scene(np.full((2, 2, 2), value), jump)
    low, high = domain_of(one, Pipeline("p"))
    assert low == value < high
    assert not uploads_of(one, Pipeline("p")).volume.any()


def test_rows_of_a_table_weight_opacity_by_the_magnitudes_at_their_middles():
    ramp = ([0.0, 64.0], [0.0, 1.0])
    transfer = TransferFunction.from_opacity([0, 64], COLORS[:2], [0.5, 0.5], gradient_opacity=ramp)
    program = Pipeline("p").with_switches(table={"rows": 4, "size": 4, "steepest": 64.0, "format": "exact"})
    found = baked_table(scene(some_values(), transfer), program, (0.0, 64.0))
    np.testing.assert_allclose(found[:, 1, 3], 0.5 * (np.arange(4) + 0.5) / 4, rtol=0, atol=1e-14)


def test_gates_without_data_are_uploaded_as_the_least_of_the_domain():
    radar = radar_example()
    low, high = radar.volume.value_bounds
    program = Pipeline("p").with_switches(
        volume={"layout": "atlas", "geometry": "spherical", "tiles_across": 1}
    )
    assert domain_of(radar, program) == (-32.0, 60.0)
    uploads = uploads_of(radar, program)
    assert uploads.size == (24, 12, 4)
    assert uploads.volume.shape == (48, 24, 1)
    # 92 dBZ in 255 steps, each value at most half a step beside its own.
    assert abs(uploads.volume.min() / 255 * 92 - 32 - low) <= 92 / 510
    assert abs(uploads.volume.max() / 255 * 92 - 32 - high) <= 92 / 510
