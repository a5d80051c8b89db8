"""`verify` finds what is wrong in an image, and nothing in one that is right."""

import dataclasses
import json

import numpy as np
import pytest

import volref as vr
from tests.scenes import camera_towards, colorful_transfer, rough_scene, rough_volume
from volref.phantoms import scenes as phantoms
from volref.truth.verification import verify


def square(center, half=1.0):
    """An opaque square across the view of `known_scene`, nearer to the eye than the middle of its box."""
    corners = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
    return vr.Mesh(np.array(corners) * half + center, [(0, 1, 2), (0, 2, 3)], colors=(0.2, 0.9, 0.1))


def known_scene(**more):
    """A ramp seen along z, which is known in closed form, and what the marcher makes of it."""
    scene, truth = phantoms.ramp_scene(8, 6, **more)
    out = vr.render(scene, method="march", step=0.5)
    return scene, dataclasses.replace(out, rgba=truth, bound=np.full((6, 8), 1e-14))


def moved(out, x, y, by):
    """The image with one channel of one pixel moved by so many of its bounds."""
    rgba = out.rgba.copy()
    rgba[y, x, 1] += by * out.bound[y, x]
    return dataclasses.replace(out, rgba=rgba)


def test_an_image_in_closed_form_is_right_to_its_rounding():
    scene, out = known_scene()
    checked = vr.verify(scene, out, rays=12)
    assert checked.ok
    assert len(checked.error) == 12
    # The closed form is float64: six parts of some ten roundings each, half an eps at most.
    assert checked.largest_error <= 60 * np.finfo(np.float64).eps / 2
    assert (checked.remainder <= 1e-33).all()
    assert (checked.truth.argmax(axis=1) == 3).all()


@pytest.mark.parametrize("interpolation", ["extinction", "opacity"])
def test_a_march_is_within_its_estimate_and_its_error_is_the_true_one(interpolation):
    field = rough_volume(shape=(4, 4, 4))
    colors, strengths = colorful_transfer().colors, [0.0, 0.0, 0.3, 0.7]
    transfer = vr.TransferFunction([0, 0.3, 0.6, 1], colors, **{interpolation: strengths})
    scene = rough_scene(8, 6, transfer=transfer, shape=field.values.shape)
    coarse, fine = vr.render(scene, method="march", step=0.1), vr.render(scene, method="march", step=0.001)
    pixels = [(3, 3), (4, 2), (2, 4)]
    checked = vr.verify(scene, coarse, pixels=pixels)
    assert checked.pixels.tolist() == [list(pixel) for pixel in pixels]
    for (x, y), error, truth in zip(pixels, checked.error, checked.truth, strict=True):
        # The fine march, of second order, is 10^4 times closer, but for its estimate.
        assert np.abs(truth - fine.rgba[y, x]).max() <= 2 * fine.bound[y, x]
        assert error == pytest.approx(np.abs(coarse.rgba - fine.rgba)[y, x].max(), rel=0.01)


@pytest.mark.parametrize(("by", "ok"), [(0.5, True), (-10.0, False), (10.0, False)])
def test_a_pixel_moved_by_ten_bounds_is_caught(by, ok):
    scene, out = known_scene()
    checked = vr.verify(scene, moved(out, 3, 2, by), pixels=[(3, 2), (4, 2)])
    assert checked.ok is ok
    assert checked.within.tolist() == [ok, True]
    assert checked.ratio[0] == pytest.approx(abs(by), abs=0.2)  # the closed form's own rounding
    assert checked.share_within == (1.0 if ok else 0.5)


def test_a_pixel_that_is_not_a_number_is_caught():
    scene, out = known_scene()
    checked = vr.verify(scene, moved(out, 3, 2, np.nan), pixels=[(3, 2)])
    assert not checked.ok
    assert "nan" in str(checked)


def test_no_error_is_allowed_where_the_bound_is_0():
    scene, out = known_scene()
    checked = vr.verify(scene, dataclasses.replace(out, bound=np.zeros((6, 8))), pixels=[(3, 2)])
    assert not checked.ok
    assert np.isinf(checked.ratio[0])
    assert checked.as_dict()["pixels"][0]["ratio"] is None


def test_surfaces_end_rays_and_lie_behind():
    scene, _ = known_scene()
    meshes = [square((0, 0, 1.2), 1.5)]
    scene = vr.Scene(
        scene.volume, scene.transfer, scene.camera, 8, 6, meshes, background=(0.1, 0.2, 0.3, 0.4)
    )
    out = vr.render(scene, method="march", step=0.001)
    hit = np.isfinite(out.distance)
    assert hit.any()
    assert not hit.all()
    for y, x in (np.argwhere(hit)[0], np.argwhere(hit)[-1], np.argwhere(~hit)[0]):
        checked = vr.verify(scene, out, pixels=[(int(x), int(y))])
        assert checked.largest_error <= 1e-6  # the marcher's at this step
        nearer = dataclasses.replace(out, distance=out.distance - 0.1)
        assert vr.verify(scene, nearer, pixels=[(int(x), int(y))]).largest_error > 1e-4 or not hit[y, x]


def test_pixels_are_random_distinct_and_of_rays_that_meet_the_volume():
    volume = rough_volume(shape=(2, 2, 2))
    camera = camera_towards(volume, fov_y=100.0)  # the volume is small in the middle of the image
    scene = vr.Scene(volume, colorful_transfer(), camera, 24, 16)
    out = vr.render(scene)
    drawn = [verify(scene, out, rays=4, seed=seed).pixels.tolist() for seed in (0, 0, 1)]
    assert drawn[0] == drawn[1] != drawn[2]
    every = verify(scene, out, rays=1000)
    assert len({tuple(pixel) for pixel in every.pixels.tolist()}) == len(every.error)
    seen = {(x, y) for y, x in np.argwhere(out.rgba[..., 3] > 0).tolist()}
    assert seen <= {tuple(pixel) for pixel in every.pixels.tolist()}
    assert len(every.error) < 24 * 16 / 2


def test_a_volume_out_of_sight_leaves_nothing_to_verify():
    volume = rough_volume()
    camera = vr.Camera.look_at((50, 0, 0), (90, 0, 0), (0, 0, 1), 20.0, 1.0, 100.0)
    scene = vr.Scene(volume, colorful_transfer(), camera, 4, 3)
    checked = vr.verify(scene, vr.render(scene))
    assert checked.ok
    assert (checked.largest_error, checked.median_error, checked.median_bound) == (0, 0, 0)
    assert str(checked) == "verified 0 rays: none meets the volume"


def test_it_prints_the_worst_rays_first():
    scene, out = known_scene()
    checked = vr.verify(scene, moved(moved(out, 3, 2, 20), 4, 3, 30), rays=48)
    lines = str(checked).splitlines()
    count = len(checked.error)
    assert lines[0].startswith(f"verified {count} rays at 30 digits in ")
    assert "(estimate)" in lines[0]
    assert [line.split()[:2] for line in lines[2:4]] == [["4", "3"], ["3", "2"]]
    assert [line.endswith("outside") for line in lines[2:5]] == [True, True, False]
    assert lines[-1] == f"  ... and {count - 8} with a smaller share of their bound"


def test_it_is_plain_data_and_reports_progress():
    scene, out = known_scene()
    calls = []
    checked = vr.verify(scene, out, rays=3, progress=lambda *call: calls.append(call))
    document = json.loads(json.dumps(checked.as_dict(), allow_nan=False))
    assert (document["ok"], document["rays"], document["digits"]) == (True, 3, 30)
    assert document["largest_error"] == max(ray["error"] for ray in document["pixels"])
    assert calls == [(1, 3), (2, 3), (3, 3)]


def test_more_digits_may_be_asked_for():
    scene, out = known_scene()
    checked = vr.verify(scene, out, pixels=[(3, 2)], digits=60)
    assert 0 < checked.remainder[0] < 1e-62


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"rays": 0}, "rays must be a whole number from 1 to 2147483648, got 0; change it"),
        ({"digits": 15}, "digits must be a whole number from 20 to 1000, got 15; change it"),
        ({"seed": -1}, "seed must be a whole number from 0 to 9223372036854775808, got -1; change it"),
        ({"pixels": [(8, 0)]}, "pixel x must be a whole number from 0 to 7, got 8; change it"),
        ({"pixels": [(0, 6)]}, "pixel y must be a whole number from 0 to 5, got 6; change it"),
        ({"pixels": [3]}, "pixels must be pairs of numbers x, y, got 3; count from the top left, from 0"),
    ],
)
def test_bad_arguments_are_refused_with_one_sentence(arguments, message):
    scene, out = known_scene()
    with pytest.raises(vr.SceneError) as refusal:
        vr.verify(scene, out, **arguments)
    assert str(refusal.value) == message


def test_an_image_of_another_size_or_of_meshes_only_is_refused():
    scene, out = known_scene()
    small = vr.Scene(scene.volume, scene.transfer, scene.camera, 4, 3)
    with pytest.raises(vr.SceneError, match="out must be an image of the scene, 4 x 3 pixels, got 8 x 6"):
        vr.verify(small, out)
    bare = vr.Scene(None, None, scene.camera, 8, 6, [square((0, 0, 0))])
    with pytest.raises(vr.SceneError, match="scene must have a volume to verify, got meshes only"):
        vr.verify(bare, vr.render(bare))


def test_without_mpmath_it_says_how_to_get_it(monkeypatch):
    scene, out = known_scene()
    monkeypatch.setattr("volref.truth.verification.find_spec", lambda _name: None)
    with pytest.raises(vr.SceneError) as refusal:
        vr.verify(scene, out)
    assert str(refusal.value) == (
        "mpmath must be installed to verify images, got no module 'mpmath'; run: pip install 'volref[verify]'"
    )
