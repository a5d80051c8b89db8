import numpy as np
import pytest

from volref import Light, Material, Plane, SceneError, clip_box


def test_each_kind_of_light_has_what_it_needs_and_nothing_else():
    assert Light.point((1, 2, 3)).position.tolist() == [1, 2, 3]
    assert Light.ambient((1, 0.5, 0)).color == (1.0, 0.5, 0.0)
    assert Light.headlight().direction is None
    with pytest.raises(SceneError, match=r"light.direction must be given for a 'directional' light"):
        Light("directional")
    with pytest.raises(
        SceneError, match=r"light.position must be given for a 'point' light and for no other"
    ):
        Light("ambient", position=(0, 0, 0))


def test_directions_have_length_one_however_short_they_were():
    for length in (1e-200, 1.0, 1e59):
        direction = Light.directional(np.array([1.0, -2.0, 2.0]) * length).direction
        assert np.allclose(direction, [1 / 3, -2 / 3, 2 / 3], rtol=4 * np.finfo(float).eps)


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: Light.directional((0, 0, 0)), "light.direction must have a direction"),
        (lambda: Light.ambient((1, -1, 0)), "light.color must be at least 0"),
        (lambda: Light.point((0, 0, 0), attenuation=(0, 1, 0)), "must have a first number above 0"),
        (lambda: Material("shiny"), "material.model must be 'lambert' or 'phong' or "),
        (lambda: Material(diffuse=-1), "material.diffuse must be at least 0"),
        (lambda: Plane((0, 0, 0), (0, 0, 0)), "plane.normal must have a direction"),
        (lambda: clip_box((0, 0, 0), (1, 0, 1)), "clip_box.high must lie above low"),
    ],
)
def test_bad_numbers_are_refused_in_one_sentence(build, words):
    with pytest.raises(SceneError, match=words):
        build()


def test_a_box_of_planes_keeps_its_inside():
    planes = clip_box((-1, -2, -3), (1, 2, 3))
    points = np.random.default_rng(0).uniform(-4, 4, (500, 3))
    kept = np.all([plane.height(points) >= 0 for plane in planes], axis=0)
    assert (kept == (np.abs(points) <= (1, 2, 3)).all(axis=1)).all()
    assert 0 < kept.sum() < 500
