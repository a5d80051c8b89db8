"""Seed 003 and its base held to scalar programs and closed forms; what each decision costs, by number."""

import dataclasses

import numpy as np
import pytest

from tests.oracles import burkalo as oracle
from volref import Camera, Mesh, Scene, SceneError, TransferFunction, Volume, emulate, render
from volref.emulation.catalogue import named
from volref.emulation.device import Device
from volref.emulation.drawing import prepare
from volref.emulation.loop.marching import march
from volref.emulation.textures.uploads import uploads_of
from volref.phantoms.specimens import vessel

WIDTH, HEIGHT = 25, 18
LOOK = ((150.0, -260.0, 140.0), (0.0, 5.0, -10.0), (0.1, 0.2, 1.0), 36.0)
WITHIN = ((15.0, -20.0, 30.0), (0.0, 15.0, -20.0), (0.1, 0.2, 1.0), 80.0)
BACKGROUND = (0.2, 0.4, 0.7, 1.0)
FLOAT = {"format": "float"}


def specimen(look=LOOK):
    """A made-up aorta: no two of its sides, axes or ends are alike."""
    volume = vessel((16, 12, 24), spacing=8.0)
    colors = [(0.1, 0.0, 0.0), (0.8, 0.3, 0.2), (1.0, 0.9, 0.7), (1.0, 1.0, 1.0)]
    transfer = TransferFunction.from_spline([-200, 60, 300, 700], colors, [0.0, 0.01, 0.3, 0.6])
    camera = Camera.look_at(*look, near=5.0, far=600.0)
    return Scene(volume, transfer, camera, WIDTH, HEIGHT, background=BACKGROUND)


def spline(name="burkalo2022", **groups):
    """The pipeline with a float canvas, over the spline's own domain."""
    changed = named(name).with_switches(**{"output": FLOAT, **groups})
    return dataclasses.replace(changed, domain=(-200.0, 700.0))


def block(value=255, size=(3, 3, 3)):
    """Volume of one value, side 1 along z."""
    return Volume(np.full(size[::-1], value, np.uint8), spacing=tuple(1 / n for n in size), origin=(0, 0, 0))


def faint(opacity, color=(1.0, 1.0, 1.0)):
    """The same colour and opacity everywhere."""
    return TransferFunction.from_opacity([0, 255], [color] * 2, [opacity] * 2)


def straight_on(volume, transfer, width=1, height=1, **more):
    """Along z at the middle of a volume of side 1: the middle ray has t = 3 and 4 and length 1, all exact."""
    middle = volume.corners.mean(axis=0)
    camera = Camera.look_at(middle + np.array([0, 0, 3.5]), middle, (0, 1, 0), 90.0, 1.0, 10.0)
    return Scene(volume, transfer, camera, width, height, **more)


def raw(name="burkalo2022", **groups):
    """The pipeline without what comes after the loop: the canvas holds C and A."""
    output = {"tone_map": "none", "gamma": 1.0, "blend": "none", "format": "exact"}
    return named(name).with_switches(output=output, **groups)


def scalar_samples(scene, pipeline, look, x, y, jitter=0.0):
    uploads = uploads_of(scene, pipeline)
    aspect = pipeline.name != "burkalo2022-printed"
    origin, direction = oracle.ray(scene.volume, look, x, y, WIDTH, HEIGHT, aspect=aspect)
    table = uploads.table[0] / (255 if uploads.table.dtype == np.uint8 else 1)
    codes, centered = uploads.volume[..., 0], pipeline.table.coordinate == "centered"
    places = oracle.places(origin, direction, 1 / pipeline.stepping.steps, jitter)
    return [oracle.entry(table, oracle.fetched(codes, at), centered=centered) for at in places]


def scalar_pixel(scene, pipeline, samples):
    if not samples:
        return list(scene.background), 0
    if pipeline.name == "mpilia2018":
        color, alpha, count = oracle.deepest_in_front(samples)
        return oracle.base(color, alpha, scene.background[:3]), count
    color, alpha, count = oracle.over(samples)
    if pipeline.name == "burkalo2022":
        return oracle.working(color, alpha, scene.background[:3]), count
    return oracle.printed(color, alpha), count


@pytest.mark.parametrize(
    ("name", "look"),
    [("burkalo2022", LOOK), ("burkalo2022", WITHIN), ("burkalo2022-printed", LOOK), ("mpilia2018", LOOK)],
)
def test_pixels_are_those_of_a_scalar_program(name, look):
    # So few steps that no alpha of the base comes near 1, where its image hangs on the last bit.
    scene, pipeline = specimen(look), spline(name, stepping={"steps": 30})
    jitter = np.random.default_rng(3).random((1, HEIGHT, WIDTH)) if name == "mpilia2018" else None
    found = emulate(scene, pipeline, jitter=jitter)
    stopped = 0
    for y in range(1, HEIGHT, 3):
        for x in range(0, WIDTH, 2):
            offset = 0.0 if jitter is None else jitter[0, y, x]
            samples = scalar_samples(scene, pipeline, look, x, y, offset)
            expected, count = scalar_pixel(scene, pipeline, samples)
            # Positions may differ in float32's last digit where matrices were rounded apart.
            np.testing.assert_allclose(found.rgba[y, x], expected, rtol=0, atol=3e-6)
            assert found.samples[y, x] == count
            stopped += 0 < count < len(samples)
    assert stopped > 0 or name == "mpilia2018"


def test_the_focal_length_and_the_aspect_make_the_rays_of_the_camera():
    scene, pipeline = specimen(), named("burkalo2022")
    focal = prepare(scene, pipeline, Device()).ends
    eye = prepare(scene, pipeline.with_switches(rays={"direction": "eye"}), Device()).ends
    np.testing.assert_array_equal(focal.pixel, eye.pixel)
    # The eye is some two boxes away: float32 keeps 2e-7 there, and t times v doubles it.
    for one, other in ((focal.entry, eye.entry), (focal.exit, eye.exit)):
        np.testing.assert_allclose(one, other, rtol=0, atol=2e-6)


def test_rays_of_the_focal_length_end_at_a_mesh_as_those_of_the_eye_do():
    plate = Mesh([(-90, 4, -99), (90, -9, -99), (90, 5, 99), (-90, 9, 99)], [(0, 1, 2), (0, 2, 3)], (1, 1, 1))
    scene = dataclasses.replace(specimen(), meshes=(plate,))
    rules = (raw(rays={"direction": rule}, meshes={"kind": "distance"}) for rule in ("focal", "eye"))
    focal, eye = (prepare(scene, rule, Device()).ends for rule in rules)
    whole = prepare(specimen(), raw(), Device()).ends
    np.testing.assert_array_equal(focal.pixel, eye.pixel)
    np.testing.assert_allclose(focal.exit, eye.exit, rtol=0, atol=2e-6)  # as above
    uncut = whole.exit[:, np.isin(whole.pixel, focal.pixel)]
    assert (np.abs(focal.exit - uncut).max(axis=0) > 0.1).any()


def test_without_the_aspect_a_wide_canvas_shows_the_square_image_stretched():
    scene, printed = specimen(), spline("burkalo2022-printed")
    square = spline("burkalo2022", output={"format": "float", "blend": "none"})
    wide = emulate(dataclasses.replace(scene, width=3 * HEIGHT), printed).rgba
    right = emulate(dataclasses.replace(scene, width=HEIGHT), square).rgba
    # Of three pixels the middle one has the centre of one of the square image; rounding of x apart.
    np.testing.assert_allclose(wide[:, 1::3], right, rtol=0, atol=3e-5)
    drawn = wide[..., 3] > 0
    widest = drawn.any(axis=0).sum() / (right[..., 3] > 0).any(axis=0).sum()
    assert widest == pytest.approx(3, abs=0.2)  # silhouettes end within a third of a pixel


def test_twice_as_wide_a_canvas_makes_things_twice_as_wide_when_printed():
    camera = Camera.look_at(*LOOK[:3], 60.0, near=50.0, far=600.0)
    scene = dataclasses.replace(specimen(), camera=camera, width=96, height=48)
    names = "burkalo2022", "burkalo2022-printed"
    widths = [(emulate(scene, spline(name)).samples > 0).any(axis=0).sum() for name in names]
    assert widths == [24, 48]


def test_stopping_above_095_leaves_out_up_to_a_twentieth():
    # Two samples of 198 / 255 reach 1 - (57 / 255)^2 = 0.95003: the third is never taken.
    scene = straight_on(block(), faint(198 / 255))
    stopped = emulate(scene, raw()).rgba[0, 0]
    whole = emulate(scene, raw(stepping={"opaque_at": None})).rgba[0, 0]
    np.testing.assert_allclose(stopped, 1 - (57 / 255) ** 2, rtol=0, atol=1e-12)
    np.testing.assert_allclose(whole, 1.0, rtol=0, atol=1e-12)
    assert whole[0] - stopped[0] == pytest.approx(0.04997, abs=1e-5)


def test_behind_what_is_opaque_a_twentieth_of_a_white_background_is_added():
    scene = straight_on(block(), faint(198 / 255, (0.0, 0.0, 0.0)), background=(1, 1, 1, 1))
    shown = emulate(scene, named("burkalo2022").with_switches(output=FLOAT)).rgba[0, 0]
    # Black, and opaque but for the stop: 0.04997^(1 / 2.2) = 0.256, 65 of 255.
    np.testing.assert_allclose(shown, [0.256] * 3 + [1.0], rtol=0, atol=5e-4)


def test_alpha_that_is_095_itself_does_not_stop_a_ray():
    # The first sample has 0.95 to the last digit.
    scene = straight_on(block(), faint(0.95))
    count = emulate(scene, raw(table={"format": "exact"}, stepping={"steps": 4})).samples[0, 0]
    tested = {"opaque_test": "at-least", "steps": 4}
    assert count == 2
    assert emulate(scene, raw(table={"format": "exact"}, stepping=tested)).samples[0, 0] == 1


def test_half_the_sampling_rate_thins_what_is_not_corrected():
    scene = straight_on(block(), faint(13 / 255))
    alpha, samples = {}, {}
    for steps in (32, 16):
        drawn = emulate(scene, raw(stepping={"steps": steps}))
        alpha[steps], samples[steps] = drawn.rgba[0, 0, 3], int(drawn.samples[0, 0])
        # The table holds 13 / 255 to the bit.
        assert alpha[steps] == pytest.approx(1 - (242 / 255) ** samples[steps], abs=1e-12)
    assert samples == {32: 32, 16: 16}
    assert [alpha[32], alpha[16]] == pytest.approx([0.8126, 0.5671], abs=5e-5)
    corrected = [
        emulate(scene, raw(stepping={"steps": steps}, opacity={"rule": "corrected"})).rgba[0, 0, 3]
        for steps in (32, 16)
    ]
    assert corrected[0] == pytest.approx(corrected[1], abs=1e-6)  # float32 lengths of steps


def test_without_the_stop_corrected_opacity_tends_to_the_truth_in_the_first_order_and_as_it_is_does_not():
    ramp = np.linspace(0, 255, 9).round().astype(np.uint8)[:, None, None]
    volume = Volume(np.broadcast_to(ramp, (9, 9, 9)).copy(), spacing=(1 / 9,) * 3)
    table = TransferFunction.from_opacity(
        [0, 255], [(1, 0.2, 0.1), (0.1, 0.4, 1)], [0.2, 0.9], unit_distance=0.5
    )
    camera = Camera.look_at((2.1, 1.7, 2.3), (0.45, 0.45, 0.45), (0, 0, 1), 25.0, 0.5, 9.0)
    scene = Scene(volume, table, camera, 12, 10)
    truth = render(scene).rgba
    errors = {}
    for rule in ("corrected", "as-is"):
        for steps in (66, 132, 264, 528):
            stepping, wide = {"steps": steps, "opaque_at": None}, {"format": "exact", "size": 4096}
            switches = {"stepping": stepping, "opacity": {"rule": rule}, "table": wide}
            drawn = emulate(scene, raw(volume={"format": "exact"}, **switches)).rgba
            errors.setdefault(rule, []).append(np.abs(drawn - truth).mean())
    halved = np.array(errors["corrected"][:-1]) / errors["corrected"][1:]
    # How much of the last step lies behind the exit is all but random.
    assert ((halved > 1.7) & (halved < 2.4)).all()
    assert (np.diff(errors["as-is"]) > 0).all()


@pytest.mark.parametrize(("steps", "count"), [(20, 20), (50, 51), (100, 101), (128, 128), (200, 201)])
def test_the_length_that_is_left_decides_on_a_last_sample_in_float32(steps, count):
    # A ray of length 1: taking 1 / steps away `steps` times leaves 0, or a few 1e-8.
    scene = straight_on(block(), faint(1 / 255))
    assert emulate(scene, raw(stepping={"steps": steps})).samples[0, 0] == count
    assert emulate(scene, raw(stepping={"steps": 128}), Device.named("exact")).samples[0, 0] == 128


def test_what_is_left_is_counted_down_by_the_nominal_step_not_by_the_length_of_the_rounded_one():
    drawing = prepare(specimen(), raw(stepping={"opaque_at": None}), Device())
    assert (drawing.paths.step == np.float32(1 / 200)).all()
    assert (drawing.paths.texture_step != drawing.paths.step).any()
    twice = dataclasses.replace(drawing.paths, step=2 * drawing.paths.step)
    offset = np.zeros(WIDTH * HEIGHT)
    whole = march(drawing.program(offset)).samples
    half = march(dataclasses.replace(drawing, paths=twice).program(offset)).samples
    np.testing.assert_allclose(half, whole / 2, rtol=0, atol=1)


def two_slices(name, **stepping):
    """C and A of a ray through green, then red in front of it, both of opacity 1 / 2."""
    values = np.array([0, 255], np.uint8).reshape(2, 1, 1)
    volume = Volume(values, spacing=(1.0, 1.0, 0.5), origin=(0.0, 0.0, 0.0))
    table = TransferFunction.from_opacity([0, 255], [(0, 1, 0), (1, 0, 0)], [0.5, 0.5])
    switches = {
        "stepping": {"steps": 2, **stepping},
        "volume": {"filter": "nearest"},
        "table": {"format": "exact", "baked": "ends", "coordinate": "centered"},
    }
    return raw(name, **switches), straight_on(volume, table)


def test_over_has_the_nearer_sample_in_front():
    pipeline, scene = two_slices("burkalo2022", offset=0.5)
    # Red 1/2; then half of what is left of green.
    np.testing.assert_allclose(emulate(scene, pipeline).rgba[0, 0], [0.5, 0.25, 0, 0.75], rtol=0, atol=1e-12)


def test_the_base_has_the_deeper_sample_in_front_and_alpha_twice_in_what_is_behind():
    pipeline, scene = two_slices("mpilia2018")
    jitter = np.full((1, 1, 1), 0.5)
    # C = 1/2 red, A = 1/2; then C = 1/2 green + 1/2 A C = 1/2 green + 1/8 red, A = 3/4.
    drawn = emulate(scene, pipeline, jitter=jitter).rgba[0, 0]
    np.testing.assert_allclose(drawn, [0.125, 0.5, 0, 0.75], rtol=0, atol=1e-12)
    # And on the canvas A C.
    shown = pipeline.with_switches(output={"blend": "shader-straight"})
    drawn = emulate(scene, shown, jitter=jitter).rgba[0, 0]
    np.testing.assert_allclose(drawn, [0.09375, 0.375, 0, 1], rtol=0, atol=1e-12)


def test_the_base_hangs_on_where_float32_rounds_alpha_to_one():
    # Red in front of green, 32 samples of each: float32's alpha is 1 after 25 halvings, float64's after 54.
    values = np.array([0, 255], np.uint8).reshape(2, 1, 1)
    volume = Volume(values, spacing=(1.0, 1.0, 0.5), origin=(0.0, 0.0, 0.0))
    table = TransferFunction.from_opacity([0, 255], [(0, 1, 0), (1, 0, 0)], [0.5, 0.5])
    scene = straight_on(volume, table)
    pipeline = raw("mpilia2018", volume={"filter": "nearest"}, stepping={"steps": 64})
    narrow, wide = (emulate(scene, pipeline, device) for device in (Device(), Device.named("exact")))
    assert [narrow.samples[0, 0], wide.samples[0, 0]] == [25, 54]
    assert narrow.rgba[0, 0, :3].argmax() == 0
    assert wide.rgba[0, 0, :3].argmax() == 1


def test_the_gamma_of_a_premultiplied_colour_is_more_than_its_alpha():
    scene = straight_on(block(), faint(0.5))
    one = {"steps": 1}
    drawn = emulate(scene, named("burkalo2022-printed").with_switches(output=FLOAT, stepping=one)).rgba[0, 0]
    half = 128 / 255
    assert drawn[3] == pytest.approx(half, abs=1e-7)
    assert drawn[0] == pytest.approx((half / (1 + half)) ** (1 / 2.2), abs=1e-7)
    assert drawn[0] - drawn[3] == pytest.approx(0.105, abs=1e-3)


def test_reinhard_of_light_that_ends_at_one_ends_at_a_half():
    scene = straight_on(block(), faint(1.0))
    drawn = emulate(scene, named("burkalo2022").with_switches(output=FLOAT)).rgba[0, 0]
    np.testing.assert_allclose(drawn, [0.5 ** (1 / 2.2)] * 3 + [1], rtol=0, atol=1e-7)


@pytest.mark.parametrize("name", ["burkalo2022", "mpilia2018"])
def test_a_background_behind_nothing_comes_out_as_it_was(name):
    scene = straight_on(block(), faint(0.0), 3, 3, background=BACKGROUND)
    drawn = emulate(scene, named(name).with_switches(output={"format": "exact"}))
    assert (drawn.samples > 0).any()
    np.testing.assert_allclose(drawn.rgba, np.broadcast_to(BACKGROUND, (3, 3, 4)), rtol=0, atol=1e-15)


def test_printed_writes_over_the_background():
    scene = straight_on(block(), faint(0.0), background=BACKGROUND)
    drawn = emulate(scene, named("burkalo2022-printed"))
    np.testing.assert_array_equal(drawn.rgba[0, 0], np.zeros(4))


def test_a_spline_is_baked_as_it_is_and_read_half_an_entry_off_if_baked_to_the_ends():
    points = [0, 100, 180, 255], [(0, 0, 0)] * 2 + [(1, 1, 1)] * 2, [0.0, 0.1, 0.9, 1.0]
    scene = straight_on(block(), TransferFunction.from_spline(*points))
    pipeline = dataclasses.replace(
        named("burkalo2022").with_switches(table={"format": "exact"}), domain=(0, 255)
    )
    baked = uploads_of(scene, pipeline).table[0]
    np.testing.assert_allclose(baked[:, 3], scene.transfer.opacity, rtol=0, atol=1e-14)
    values = np.arange(256) / 255
    ends = uploads_of(scene, pipeline.with_switches(table={"baked": "ends"})).table[0]
    read = [[oracle.entry(table, v)[3] for v in values] for table in (baked, ends)]
    steepest = np.abs(np.diff(scene.transfer.opacity)).max()
    apart = np.abs(np.subtract(*read)).max()
    # Half an entry at 0 and 1, nothing in the middle; the spline is steep in between.
    assert 0.1 * steepest < apart < 0.5 * steepest


def test_parallel_rays_are_refused():
    volume = block()
    camera = Camera.orthographic((0, 0, 5), (0, 0, 0), (0, 1, 0), 2.0, 1.0, 9.0)
    with pytest.raises(SceneError, match="direction 'focal', got a parallel one; use a pipeline with 'eye'"):
        emulate(Scene(volume, faint(0.5), camera, 2, 2), "burkalo2022")
