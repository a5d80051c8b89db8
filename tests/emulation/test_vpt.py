"""VPT's emission-absorption renderer held to a scalar program and closed forms; its rounding, by number."""

import dataclasses

import numpy as np
import pytest

from tests.oracles import vpt_program as oracle
from volref import Camera, Scene, SceneError, TransferFunction, Volume, emulate
from volref.emulation.catalogue import named
from volref.emulation.device import Device
from volref.emulation.drawing import prepare
from volref.emulation.loop.opacity import factor_of
from volref.emulation.textures.uploads import uploads_of

WIDTH, HEIGHT = 24, 18
LOOK = ((26.0, -17.0, 22.0), (5.0, 6.0, 6.0), (0.1, 0.2, 1.0), 40.0, 12.0, 80.0)
VPT = named("vpt-eam")
FLOATS = VPT.with_switches(output={"format": "float", "mean_format": "float"})


def waves(size=(11, 13, 9)):
    nx, ny, nz = size
    z, y, x = np.meshgrid(*(np.arange(n) / n for n in (nz, ny, nx)), indexing="ij")
    return np.rint(255 * (0.5 + 0.3 * np.sin(9 * x + 4 * z) * np.cos(5 * y) + 0.2 * np.cos(8 * z * y)))


def oblique(opacity=0.6, unit_distance=3.0, **more):
    """Three different sides; the near plane is in front of the box."""
    volume = Volume(waves().astype(np.uint8), spacing=(1.0, 0.8, 1.4), origin=(0.5, 1.0, 1.5))
    colors = [(0.1, 0.2, 0.9), (0.1, 0.9, 1.0), (1.0, 0.3, 0.1)]
    transfer = TransferFunction.from_opacity(
        [0, 120, 255], colors, [0.0, opacity / 4, opacity], unit_distance
    )
    camera = Camera.look_at(*LOOK[:4], near=LOOK[4], far=LOOK[5])
    return Scene(volume, transfer, camera, WIDTH, HEIGHT, **more)


def block(value=255, transfer=None, *, near=1.0, clip_z="-1..1", **more):
    """One pixel along z through the unit cube, its volume of one value."""
    volume = Volume(np.full((3, 3, 3), value, np.uint8), spacing=(1 / 3,) * 3, origin=(1 / 6,) * 3)
    camera = Camera.look_at((0.5, 0.5, 3.0), (0.5, 0.5, 0.5), (0, 1, 0), 40.0, near, 10.0, clip_z=clip_z)
    look = transfer or TransferFunction.from_opacity([0, 255], [(1.0, 1.0, 1.0)] * 2, [1.0, 1.0])
    return Scene(volume, look, camera, 1, 1, **more)


def offsets(*each, scene=None):
    size = (1, 1) if scene is None else (scene.height, scene.width)
    return np.broadcast_to(np.array(each)[:, None, None], (len(each), *size))


@pytest.mark.parametrize(
    ("opacity", "unit", "offset"), [(0.6, 3.0, 0.0), (0.05, 3.0, 0.73), (1.0, 0.8, 0.31)]
)
def test_pixels_of_a_frame_are_those_of_a_scalar_program(opacity, unit, offset):
    scene = oblique(opacity, unit)
    found = emulate(scene, FLOATS, jitter=offsets(offset, scene=scene))
    uploads, drawing = uploads_of(scene, FLOATS), prepare(scene, FLOATS, Device())
    extinction = factor_of(scene, FLOATS, drawing.box)
    drawn = stopped = 0
    for y in range(0, HEIGHT, 2):
        for x in range(1, WIDTH, 3):
            ends = oracle.near_and_far(scene.volume, LOOK, x, y, WIDTH, HEIGHT)
            pixel = oracle.frame(
                uploads.volume[..., 0],
                uploads.table[0],
                *ends,
                steps=64,
                extinction=extinction,
                offset=offset,
            )
            color, count = pixel or ([0.0] * 3, 0)
            # A matrix in float32 moves positions by some 1e-6, where colours change by up to ten a unit.
            np.testing.assert_allclose(found.passes["frame"][y, x], [*color, 1.0], rtol=0, atol=3e-5)
            assert found.samples[y, x] == count
            drawn, stopped = drawn + (count > 0), stopped + (0 < count < 64)
    assert drawn > 15
    assert (stopped > 0) == (unit < 1)


@pytest.mark.parametrize(
    ("steps", "count", "ideal"),
    [(64, 64, 64), (99, 99, 100), (100, 101, 100), (200, 201, 200), (128, 128, 128)],
)
def test_the_count_of_samples_hangs_on_the_rounding_of_the_step(steps, count, ideal):
    # In float64 the rounding is another one; powers of two have none.
    scene = block(0, TransferFunction.from_opacity([0, 255], [(1, 1, 1)] * 2, [0.0, 0.5]))
    pipeline = VPT.with_switches(stepping={"steps": steps})
    assert len(oracle.parameters(steps)) == count
    assert emulate(scene, pipeline).samples.item() == count
    assert emulate(scene, pipeline, "exact").samples.item() == ideal


def test_of_a_thousand_step_counts_every_other_gets_one_sample_more():
    counts = [len(oracle.parameters(n)) - n for n in range(1, 1001)]
    assert set(counts) == {0, 1}
    assert sum(counts) == 510


def test_an_extra_sample_is_an_extra_opacity():
    # A slab of extinction 0.01 over a length of 1: 200 samples would give 1 - (1 - 0.01 / 200)^200.
    transfer = TransferFunction.from_opacity([0, 255], [(1, 1, 1)] * 2, [1.0, 1.0])
    steps = {"steps": 200}
    pipeline = FLOATS.with_switches(
        stepping=steps, opacity={"factor": 0.01}, accumulation={"alpha": "accumulated"}
    )
    alpha = emulate(block(255, transfer), pipeline).passes["frame"][0, 0, 3]
    assert alpha == pytest.approx(1 - (1 - 0.01 / 200) ** 201, rel=1e-6)


def test_a_ray_that_misses_is_opaque_black_whatever_the_background():
    scene = oblique(background=(0.2, 0.4, 0.6, 0.8))
    found = emulate(scene, VPT)
    missed = found.samples == 0
    assert missed.any()
    for target in found.passes.values():
        assert np.all(target[missed] == (0, 0, 0, 1))
        assert np.all(target[..., 3] == 1)


def test_the_near_plane_cuts_the_box_and_the_far_plane_does_not():
    faint = TransferFunction.from_opacity([0, 255], [(1, 1, 1)] * 2, [0.5, 0.5])
    pipeline = FLOATS.with_switches(opacity={"factor": 0.1}, accumulation={"alpha": "accumulated"})
    alphas = {}
    for name, near, far in (("whole", 1.0, 10.0), ("cut", 2.5, 10.0), ("far", 1.0, 2.5)):
        scene = block(255, faint)
        camera = Camera.look_at((0.5, 0.5, 3.0), (0.5, 0.5, 0.5), (0, 1, 0), 40.0, near, far)
        alphas[name] = emulate(dataclasses.replace(scene, camera=camera), pipeline).passes["frame"][0, 0, 3]
    # Half of the box is behind the near plane: the same count of steps, half as long.
    assert alphas["cut"] / alphas["whole"] == pytest.approx(0.5, abs=0.01)
    assert alphas["far"] == pytest.approx(alphas["whole"], rel=1e-6)


def test_rays_begin_at_the_same_near_plane_for_either_range_of_clip_z():
    faint = FLOATS.with_switches(opacity={"factor": 0.1})
    one, other = (emulate(block(clip_z=clip_z, near=2.5), faint) for clip_z in ("-1..1", "0..1"))
    np.testing.assert_array_equal(one.rgba, other.rgba)


def test_unprojected_rays_are_those_of_the_eye_where_nothing_is_near():
    scene = oblique()
    ours = prepare(scene, VPT, Device()).ends
    eye = prepare(scene, VPT.with_switches(rays={"direction": "eye"}), Device()).ends
    np.testing.assert_array_equal(ours.pixel, eye.pixel)
    # Places on the far plane are some ten boxes away, where a matrix in float32 keeps 1e-6 of each.
    np.testing.assert_allclose(ours.entry, eye.entry, rtol=0, atol=5e-6)
    np.testing.assert_allclose(ours.exit, eye.exit, rtol=0, atol=5e-6)


def test_light_of_the_table_is_decoded_before_it_is_filtered():
    # Between black and white: the mean of the lights, not the light of the mean code, which is 0.214.
    black, white = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)
    transfer = TransferFunction.from_opacity([-99, -1, 1, 99], [black, black, white, white], [1.0] * 4)
    scene = block(0, transfer)
    pipeline = dataclasses.replace(FLOATS, domain=(-127.5, 127.5)).with_switches(
        table={"size": 2}, stepping={"steps": 1}, opacity={"factor": 1.0}
    )
    # The value lies at 128 / 255 of the domain; one sample over a length of 1 is all there is.
    assert emulate(scene, pipeline).passes["frame"][0, 0, 0] == pytest.approx(128 / 255 * 2 - 0.5, abs=1e-6)


@pytest.mark.parametrize("opacity", [1.5, 3.0])
def test_an_alpha_above_one_divides_the_colour(opacity):
    transfer = TransferFunction.from_opacity([0, 255], [(0.25, 0.5, 0.75)] * 2, [1.0, 1.0])
    # The first sample alone makes A = opacity and C = A c.
    pipeline = FLOATS.with_switches(stepping={"steps": 1}, opacity={"factor": opacity}, table={"srgb": False})
    frame = emulate(block(255, transfer), pipeline).passes["frame"][0, 0]
    # Colours are bytes of the table.
    np.testing.assert_allclose(frame, [64 / 255, 128 / 255, 191 / 255, 1.0], rtol=0, atol=1e-7)
    without = pipeline.with_switches(accumulation={"normalize": "none"})
    over = emulate(block(255, transfer), without).passes["frame"][0, 0]
    np.testing.assert_allclose(over[:3], opacity * frame[:3], rtol=1e-6)


def test_the_mean_of_frames_is_stored_in_bytes_after_each_of_them():
    scene, each = oblique(0.2), (0.1, 0.85, 0.5, 0.33, 0.02)
    frames = [emulate(scene, VPT, jitter=offsets(o, scene=scene)).passes["frame"] for o in each]
    bytes_of = [np.rint(255 * frame).astype(int) for frame in frames]
    found = emulate(scene, VPT, jitter=offsets(*each, scene=scene), frames=5).passes["running_mean"]
    ties = 0
    for y in range(HEIGHT):
        for x in range(0, WIDTH, 2):
            for c in range(3):
                column = [int(frame[y, x, c]) for frame in bytes_of]
                assert round(255 * found[y, x, c]) == oracle.running_mean(column)
                ties += sum(column[:2]) % 2
    assert ties > 20


def test_the_middle_of_two_neighbour_bytes_is_rounded_as_float32_has_it():
    # k and k + 1: half-way exactly, if it were not for the rounding of 1 / 255.
    up = [oracle.running_mean([k, k + 1]) - k for k in range(255)]
    assert 0 < sum(up) < 255
    even = [(k + 1) // 2 * 2 - k for k in range(255)]
    assert up != even


def test_a_mean_in_bytes_gets_stuck():
    # From frame 128 on 1 / n of a difference of one step is less than half a step.
    assert oracle.running_mean([100] * 10 + [101] * 5000) == 100
    assert oracle.running_mean([101, *[100] * 5000]) in (100, 101)


@pytest.mark.parametrize(
    "shape", [{}, {"low": 0.1, "high": 0.7, "mid": 0.3}, {"saturation": 0.25}, {"gamma": 1.0, "mid": 0.2}]
)
def test_the_tone_map_is_the_scalar_one(shape):
    scene = oblique()
    found = emulate(scene, FLOATS.with_switches(output=shape))
    light, shown = found.passes["running_mean"], found.rgba
    for y, x in np.argwhere(found.samples > 0)[::5]:
        # The mean and the canvas are stored in float32; a root near black makes 1e-8 a 3e-4 of it.
        np.testing.assert_allclose(
            shown[y, x, :3], oracle.artistic(light[y, x, :3], **shape), rtol=1e-6, atol=1e-7
        )
        assert shown[y, x, 3] == 1


def test_one_byte_of_a_dark_mean_is_twenty_on_the_canvas():
    assert round(255 * oracle.artistic([1 / 255] * 3)[0]) == 21


def test_a_middle_beside_its_ends_is_refused():
    with pytest.raises(SceneError, match="low, mid and high must rise, got 0, 1, 1; sort them"):
        VPT.with_switches(output={"mid": 1.0})
