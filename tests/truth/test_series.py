"""A scene at several times: each image is that of its own volume."""

import dataclasses

import numpy as np
import pytest

from tests.scenes import rough_scene, rough_volume
from volref import Render, SceneError, Series, render, render_series, supersample

SCENE = rough_scene(8, 6)
VOLUMES = [rough_volume(seed) for seed in (0, 1, 2)]
SERIES = Series(VOLUMES, [0, 10, 40])


def at(volume):
    return dataclasses.replace(SCENE, volume=volume)


def test_each_image_is_that_of_the_scene_with_that_volume():
    times, images = zip(*render_series(SCENE, SERIES), strict=True)
    assert times == (0, 10, 40)
    for image, volume in zip(images, VOLUMES, strict=True):
        assert np.array_equal(image.rgba, render(at(volume)).rgba)
        assert image.bound_kind == "certified"


def test_between_two_volumes_their_mix_is_rendered():
    ((time, image),) = render_series(SCENE, SERIES, [25], interpolation="linear", method="march", step=0.3)
    expected = render(at(SERIES.at(25, "linear")), method="march", step=0.3)
    assert time == 25
    assert np.array_equal(image.rgba, expected.rgba)
    assert image.bound_kind == "estimate"


def test_several_rays_per_pixel_go_with_it():
    ((_, image),) = render_series(SCENE, SERIES, [10], factor=2)
    assert np.array_equal(image.rgba, supersample(at(VOLUMES[1]), 2).rgba)


def test_one_volume_is_rendered_once(monkeypatch):
    calls = []

    def counted(scene, **options):
        calls.append(scene)
        return render(scene, **options)

    monkeypatch.setattr("volref.truth.series.render", counted)
    images = [image for _, image in render_series(SCENE, SERIES, [0, 1, 2, 9, 10])]
    assert len(calls) == 2
    assert images[0] is images[2]
    assert all(isinstance(image, Render) for image in images)


def test_what_cannot_be_is_refused_before_anything_is_rendered():
    for call, fragment in [
        (lambda: render_series(SCENE, VOLUMES), "series must be a volref.Series"),
        (lambda: render_series(SCENE, SERIES, [0, 41]), "time must be at most 40"),
        (lambda: render_series(SCENE, SERIES, interpolation="cubic"), "interpolation must be"),
    ]:
        with pytest.raises(SceneError) as refusal:
            call()
        assert fragment in str(refusal.value)
