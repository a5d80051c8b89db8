"""Counts and lengths of steps by each rule, against loops over rays in numpy.float32."""

import math

import numpy as np
import pytest

from tests.emulation.scenes import radar_example
from volref import Camera, Pipeline, Scene, TransferFunction, Volume
from volref.emulation.device import Device
from volref.emulation.rays.box import box_of
from volref.emulation.rays.paths import Ends, Paths, paths_of, vector_length, world_step_of

f32 = np.float32
SPACING, SIZE = (0.5, 1.25, 2.0), (8, 6, 5)
SIDES = tuple(n * s for n, s in zip(SIZE, SPACING, strict=True))
RAYS = 60


def scene():
    nx, ny, nz = SIZE
    turn = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
    volume = Volume(np.zeros((nz, ny, nx), np.uint8), spacing=SPACING, direction=turn)
    transfer = TransferFunction.from_opacity([0, 255], [(1, 1, 1)] * 2, [0, 0.5])
    return Scene(volume, transfer, Camera.look_at((1, 2, 30), (0, 0, 0), (0, 1, 0), 30, 1, 90), 2, 2)


def ends(kind=f32, along=None):
    """Random chords of the box; the first has no length."""
    rng = np.random.default_rng(6)
    near, far = rng.random((2, 3, RAYS)).astype(kind)
    far[:, 0] = near[:, 0]
    return Ends(np.arange(RAYS), near, far if along is None else near + along, along=along)


def made(stepping, along=None, **device):
    shown = scene()
    machine = Device("d", **device)
    given = ends(machine.control_type, along)
    pipeline = Pipeline("p").with_switches(stepping=stepping)
    return given, paths_of(given, shown, pipeline, box_of(shown), machine)


def length_of(x, y, z):
    """The length of a vector in the type of its numbers, from left to right."""
    return np.sqrt(x * x + y * y + z * z)


def world_length(vector):
    """In float64: the box is turned, which changes no length."""
    return math.sqrt(sum((float(c) * side) ** 2 for c, side in zip(vector, SIDES, strict=True)))


def scalars(given):
    """For each ray but the first, its number, its entry and the way to its exit, as float32 scalars."""
    for ray in range(1, RAYS):
        near, far = given.entry[:, ray], given.exit[:, ray]
        yield ray, near, [b - a for a, b in zip(near, far, strict=True)]


@pytest.mark.parametrize("divisor", ["divided", "multiplied"])
def test_a_rule_of_a_count_divides_the_ray_into_equal_steps(divisor):
    given, paths = made({"rule": "count", "steps": 7}, constant_divisor=divisor)
    share = f32(1) / f32(7)
    for ray, _, way in scalars(given):
        expected = [c / f32(7) if divisor == "divided" else c * share for c in way]
        np.testing.assert_array_equal(paths.delta[:, ray], expected)
        assert paths.texture_step[ray] == length_of(*expected)
    assert set(paths.count) == {7}
    assert set(paths.step) == {share}
    assert set(paths.length) == {f32(1)}
    assert not np.array_equal(
        *(made({"rule": "count", "steps": 7}, constant_divisor=d)[1].delta for d in ("divided", "multiplied"))
    )


@pytest.mark.parametrize(("length", "steps", "expected"), [(0.03, 9, 0.03), (None, 9, 1 / 9)])
def test_a_rule_of_a_length_in_texture_space_turns_the_ray_into_a_unit_vector_first(length, steps, expected):
    given, paths = made({"rule": "texture-length", "length": length, "steps": steps})
    size = f32(expected)
    for ray, _, way in scalars(given):
        whole = length_of(*way)
        step = [c / whole * size for c in way]
        np.testing.assert_array_equal(paths.delta[:, ray], step)
        assert paths.step[ray] == length_of(*step)
        assert paths.length[ray] == whole


def test_a_length_that_is_counted_down_is_the_nominal_one_and_multiplied_first():
    given, paths = made({"rule": "texture-length", "length": 0.03, "end": "length-left"})
    for ray, _, way in scalars(given):
        whole = length_of(*way)
        np.testing.assert_array_equal(paths.delta[:, ray], [f32(0.03) * c / whole for c in way])
        assert (paths.step[ray], paths.length[ray]) == (f32(0.03), whole)


def test_a_direction_that_is_known_is_not_made_again():
    along = np.random.default_rng(7).normal(size=(3, RAYS)).astype(f32)
    along /= vector_length(along)
    _, paths = made({"rule": "texture-length", "length": 0.25}, along)
    np.testing.assert_array_equal(paths.delta, along * f32(0.25))


@pytest.mark.parametrize("length", [None, 0.3, 2.0])
def test_samples_per_voxel_are_rounded_to_a_whole_number_of_steps(length):
    given, paths = made({"rule": "voxel-count", "length": length})
    counts = set()
    for ray, _, way in scalars(given):
        voxels = length_of(*(c * f32(n) for c, n in zip(way, SIZE, strict=True)))
        count = math.floor(voxels / f32(length or 1.0) + f32(0.5))
        assert paths.count[ray] == count
        np.testing.assert_array_equal(paths.delta[:, ray], [c / f32(max(count, 1)) for c in way])
        counts.add(count)
    assert len(counts) > 3
    assert paths.count[0] == 0
    assert not paths.delta[:, 0].any()


@pytest.mark.parametrize(("length", "expected"), [(None, 0.25), (0.7, 0.7)])
def test_a_rule_of_a_length_in_the_world_measures_there(length, expected):
    given, paths = made({"rule": "world-length", "length": length})
    for ray, _, way in scalars(given):
        whole = f32(world_length(way))
        # The turned box's lengths are the same in float64 but for its last places, once rounded to float32.
        np.testing.assert_allclose(paths.length[ray], whole, rtol=2**-23)
        np.testing.assert_array_equal(
            paths.delta[:, ray], [c / paths.length[ray] * f32(expected) for c in way]
        )
    assert set(paths.step) == {f32(expected)}


def test_lengths_of_steps_are_measured_in_texture_space_and_in_the_world():
    for rule in ("count", "texture-length", "world-length", "voxel-count"):
        _, paths = made({"rule": rule, "steps": 11})
        for ray in range(1, RAYS):
            delta = paths.delta[:, ray]
            assert paths.texture_step[ray] == length_of(*delta)
            # Float64, summed in another order.
            np.testing.assert_allclose(paths.world_step[ray], world_length(delta), rtol=1e-13)


def test_a_ray_without_a_length_has_no_direction_but_for_rules_that_only_divide():
    for rule, direction in (
        ("count", True),
        ("voxel-count", True),
        ("texture-length", False),
        ("world-length", False),
    ):
        _, paths = made({"rule": rule})
        assert (paths.delta[:, 0] == 0).all() if direction else np.isnan(paths.delta[:, 0]).all()


@pytest.mark.parametrize("control", ["float16", "float32", "float64"])
@pytest.mark.parametrize("rule", ["count", "texture-length", "world-length", "voxel-count"])
def test_all_that_decides_on_samples_is_in_the_control_type(rule, control):
    _, paths = made({"rule": rule}, control=control)
    for name in ("entry", "exit", "delta", "length", "step", "texture_step"):
        assert getattr(paths, name).dtype == control, name
    assert (paths.count.dtype.kind, paths.world_step.dtype) == ("i", np.float64)


def test_some_of_the_paths_are_those_in_their_order():
    _, paths = made({"rule": "world-length"})
    chosen = np.array([5, 2, 2])
    some = paths.take(chosen)
    for name in Paths.__dataclass_fields__:
        np.testing.assert_array_equal(getattr(some, name), getattr(paths, name)[..., chosen])


def test_the_step_in_the_world_is_half_the_least_spacing_or_half_a_gate():
    usual, own = (Pipeline("p").with_switches(stepping={"length": length}).stepping for length in (None, 0.2))
    assert [world_step_of(stepping, scene()) for stepping in (usual, own)] == [0.25, 0.2]
    assert world_step_of(usual, radar_example()) == 4e3
