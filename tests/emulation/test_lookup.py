"""From positions to colours: the order of interpolation and classification, and mix() on each machine."""

import dataclasses

import numpy as np
import pytest

from volref import Camera, Pipeline, Scene, TransferFunction, Volume
from volref.emulation.device import Device
from volref.emulation.textures.lookup import look_up, mix, textures_of
from volref.emulation.textures.uploads import uploads_of
from volref.workspace import Workspace

CAMERA = Camera.look_at((3, 3, 30), (3, 3, 3), (0, 1, 0), 30, 1, 90)
COLORS = np.array([(0.1, 0.9, 0.3), (0.6, 0.2, 0.5), (1.0, 0.4, 0.0)])
POINTS = np.random.default_rng(1).random((3, 40))
EXACT = {"format": "exact"}
ATLAS = {"layout": "atlas", "in_tile": "clamped"}


@pytest.fixture(scope="module")
def scene():
    values = np.random.default_rng(2).random((4, 3, 5))
    transfer = TransferFunction.from_opacity([0.0, 0.4, 1.0], COLORS, [0.0, 0.9, 0.3], 2.0)
    return Scene(Volume(values), transfer, CAMERA, 2, 2)


def found(scene, points=POINTS, device=None, **groups):
    groups["volume"] = EXACT | groups.get("volume", {})
    groups["table"] = EXACT | {"size": 8} | groups.get("table", {})
    pipeline = Pipeline("p", domain=(0, 1)).with_switches(**groups)
    machine = device or Device.named("exact")
    textures = textures_of(uploads_of(scene, pipeline), pipeline, machine)
    return look_up(textures, points.astype(machine.control_type), Workspace())


def between(low, high, share):
    return low + share * (high - low)


def linear(values, x):
    """Values at the middles of equal cells of 0..1, between them linear, held beyond."""
    values = np.asarray(values)
    place = min(max(x, 0.0), 1.0) * len(values) - 0.5
    lower = int(np.floor(place))
    one, two = (values[min(max(k, 0), len(values) - 1)] for k in (lower, lower + 1))
    return between(one, two, place - lower)


def entry(scene, value):
    """Straight rgba of a value: 8 entries at their middles, between them linear."""
    knots = scene.transfer.values
    at = (np.arange(8) + 0.5) / 8
    table = np.stack(
        [np.interp(at, knots, c) for c in (*scene.transfer.colors.T, scene.transfer.opacity)], -1
    )
    return linear(table, value)


def in_slice(field, x, y):
    """A slice [y][x] of numbers or colours at a place, bilinear."""
    return linear([linear(row, x) for row in field], y)


def sliced(field, point):
    """The two slices around a point, and how far it is towards the second: slices at their middles."""
    x, y, z = point
    place = max(z * len(field) - 0.5, 0.0)
    first = int(place)
    second = min(first + 1, len(field) - 1)
    return in_slice(field[first], x, y), in_slice(field[second], x, y), place - first


@pytest.mark.parametrize("volume", [{"layout": "3d"}, ATLAS])
def test_values_are_interpolated_and_then_classified(scene, volume):
    sample = found(scene, volume=volume)
    for k, point in enumerate(POINTS.T):
        value = between(*sliced(scene.volume.values, point))
        # Float64, some sums.
        np.testing.assert_allclose(sample.value[k], value, rtol=0, atol=1e-13)
        np.testing.assert_allclose(sample.color[:, k], entry(scene, value), rtol=0, atol=1e-12)
    assert sample.gradient is sample.magnitude is None


def test_slices_are_classified_one_by_one_and_then_mixed(scene):
    sample = found(scene, volume=ATLAS, table={"order": "per-slice"})
    plain = found(scene, volume=ATLAS)
    np.testing.assert_array_equal(sample.value, plain.value)
    assert np.abs(sample.color - plain.color).max() > 0.05
    for k, point in enumerate(POINTS.T):
        one, two, share = sliced(scene.volume.values, point)
        expected = between(entry(scene, one), entry(scene, two), share)
        np.testing.assert_allclose(sample.color[:, k], expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize("volume", [{"layout": "3d"}, ATLAS])
def test_voxels_are_classified_and_then_interpolated(scene, volume):
    sample = found(scene, volume=volume, table={"order": "pre"})
    colors = np.stack([entry(scene, v) for v in scene.volume.values.reshape(-1)]).reshape(4, 3, 5, 4)
    for k, point in enumerate(POINTS.T):
        np.testing.assert_allclose(sample.color[:, k], between(*sliced(colors, point)), rtol=0, atol=1e-12)
    np.testing.assert_array_equal(sample.value, sample.color[3])


@pytest.mark.parametrize("order", ["post", "per-slice", "pre"])
def test_without_mixing_the_first_of_two_slices_is_taken(scene, order):
    sample = found(scene, volume=ATLAS | {"between": "none"}, table={"order": order})
    field = scene.volume.values
    if order == "pre":
        field = np.stack([entry(scene, v) for v in field.reshape(-1)]).reshape(4, 3, 5, 4)
    for k, point in enumerate(POINTS.T):
        one, _, _ = sliced(field, point)
        expected = one if order == "pre" else entry(scene, one)
        np.testing.assert_allclose(sample.color[:, k], expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize("volume", [{"layout": "3d"}, ATLAS])
def test_sixteen_bits_are_interpolated_as_their_sum(scene, volume):
    deep = found(scene, volume=volume | {"format": "unorm16-split"})
    plain = found(scene, volume=volume)
    # Half a step of 16 bits.
    np.testing.assert_allclose(deep.value, plain.value, rtol=0, atol=0.5 / 65535 + 1e-9)
    np.testing.assert_allclose(deep.color, plain.color, rtol=0, atol=1e-4)


def test_a_nearest_volume_and_table_hold_what_their_texels_hold(scene):
    sample = found(scene, volume={"filter": "nearest"}, table={"filter": "nearest"})
    values = scene.volume.values
    x, y, z = (np.floor(p * n).astype(int) for p, n in zip(POINTS, (5, 3, 4), strict=True))
    np.testing.assert_array_equal(sample.value, values[z, y, x])
    at = (np.floor(sample.value * 8) + 0.5) / 8
    expected = [
        np.interp(at, scene.transfer.values, c) for c in (*scene.transfer.colors.T, scene.transfer.opacity)
    ]
    np.testing.assert_allclose(sample.color, expected, rtol=0, atol=1e-14)


@pytest.mark.parametrize("kind", ["float16", "float32", "float64"])
def test_mix_is_computed_as_the_device_has_it_in_its_own_type(kind):
    x, y, share = np.random.default_rng(3).random((3, 2000)).astype(kind)
    difference, total = (mix(Device("d", mix=word), x, y, share) for word in ("difference", "sum"))
    assert difference.dtype == total.dtype == kind
    np.testing.assert_array_equal(difference, x + (y - x) * share)
    np.testing.assert_array_equal(total, x * (1 - share) + y * share)
    assert (difference != total).any()


def test_two_slices_are_mixed_as_the_device_does(scene):
    kinds = [
        found(scene, volume=ATLAS, device=Device("d", values="float32", mix=word))
        for word in ("difference", "sum")
    ]
    assert (kinds[0].value != kinds[1].value).any()
    np.testing.assert_allclose(kinds[0].value, kinds[1].value, rtol=0, atol=3e-7)


def test_positions_are_control_numbers_and_colours_are_values(scene):
    for control, values in (("float32", "float64"), ("float64", "float32"), ("float16", "float16")):
        for volume in ({"layout": "3d"}, ATLAS):
            device = Device("d", control=control, values=values)
            sample = found(scene, device=device, volume=volume)
            assert sample.value.dtype == sample.color.dtype == values


def test_filters_of_bytes_have_the_machines_weights(scene):
    bytes_ = {"format": "unorm8"}
    plain, mesa = (
        found(scene, device=device, volume=bytes_).value * 255
        for device in (Device(), Device("d", weight_bits=8, result_bits=8))
    )
    np.testing.assert_allclose(mesa, np.rint(mesa), rtol=0, atol=1e-12)
    # Each of three interpolations is rounded to a byte, weights to 1/256 of up to 255.
    assert 0.1 < np.abs(mesa - plain).max() < 3 * (0.5 + 0.5)
    floats = [found(scene, device=device).value for device in (Device(), Device("d", weight_bits=8))]
    np.testing.assert_array_equal(*floats)


def test_a_scene_of_another_size_is_another_atlas(scene):
    longer = dataclasses.replace(scene, volume=Volume(np.repeat(scene.volume.values, 2, axis=0)))
    sample = found(longer, volume=ATLAS)
    for k, point in enumerate(POINTS.T):
        value = between(*sliced(longer.volume.values, point))
        np.testing.assert_allclose(sample.value[k], value, rtol=0, atol=1e-13)
