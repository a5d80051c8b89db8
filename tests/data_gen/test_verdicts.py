import numpy as np
import pytest

import volref as vr
from data_gen import verdicts
from data_gen.verdicts import IMAGES, Drawn, judged, picture_of
from tests.scenes import rough_scene
from volref.oracle.faults.fault import Subject


@pytest.fixture
def scene(monkeypatch):
    made = rough_scene(10, 8)
    monkeypatch.setattr(verdicts, "demo_scene", lambda *_: made)
    return made


def test_an_image_without_a_fault_is_what_the_program_draws(scene):
    subject = Subject(scene, vr.pipelines()["texture3d"], vr.Device.named("swiftshader"))
    right = picture_of(subject, Drawn("texture3d"))
    np.testing.assert_array_equal(right, vr.emulate(scene, "texture3d", "swiftshader").rgba8)
    assert (picture_of(subject, Drawn("texture3d", "G1-half-voxel", 0.5)) != right).any()


@pytest.mark.usefixtures("scene")
def test_right_images_are_inside_and_wrong_ones_outside_and_explained():
    assert judged(Drawn("texture3d")).kind == "pass"
    case = judged(Drawn("texture3d", "O2-add-alpha"))
    assert case.kind == "fail"
    assert case.why.ranking[0].fault == "O2-add-alpha"


def test_images_have_names_of_their_own():
    assert len({drawn.name for drawn in IMAGES}) == len(IMAGES)
