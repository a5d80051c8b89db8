"""Charts: small, drawn at a slant, and all of them show something."""

import numpy as np
import pytest

import volref as vr
from volref.golden.charts import CHARTS
from volref.golden.charts.places import letter

LARGEST_SIDE, LARGEST_IMAGE = 16, 64

charts = pytest.mark.parametrize("chart", CHARTS.values(), ids=CHARTS)


@pytest.fixture(scope="module")
def canvases():
    """Every chart's canvas, drawn once."""
    subjects = {name: chart.subject() for name, chart in CHARTS.items()}
    return {
        name: vr.emulate(one.scene, one.pipeline, one.device, one.jitter, one.frames)
        for name, one in subjects.items()
    }


@charts
def test_a_chart_is_small(chart):
    scene = chart.make()
    assert max(scene.volume.size) <= LARGEST_SIDE
    assert max(scene.width, scene.height) <= LARGEST_IMAGE


@charts
def test_no_ray_runs_along_a_face_and_no_camera_looks_at_the_middle(chart):
    """Where it does, pixels hang on a rounding: the image would not be one."""
    scene = chart.make()
    along = np.abs(scene.volume.index_from_world[:3, :3] @ scene.camera.world_from_view[:3, :3])
    assert along.min() > 0.001
    middle = scene.camera.view_from_world @ np.append(scene.volume.corners.mean(axis=0), 1.0)
    assert np.hypot(*middle[:2]) > 0.1


@charts
def test_a_chart_shows_its_subject_large_and_bright(chart, canvases):
    canvas = canvases[chart.name].rgba
    changed = np.abs(canvas - canvas[0, 0]).max(axis=-1) > 0.1
    assert changed.mean() > 0.1
    assert np.ptp(canvas[..., :3], axis=(0, 1)).max() > 0.2


@charts
def test_colours_of_tables_meshes_and_backgrounds_are_whole_fifths(chart):
    scene = chart.make()
    colors = [scene.transfer.colors, scene.background, *(mesh.colors for mesh in scene.meshes)]
    for color in colors:
        assert np.allclose(5 * np.asarray(color), np.rint(5 * np.asarray(color)), atol=1e-12)  # .6 is rounded


@charts
def test_a_chart_is_the_same_each_time_it_is_made(chart, canvases):
    one = chart.subject()
    again = vr.emulate(one.scene, one.pipeline, one.device, one.jitter, one.frames)
    assert np.array_equal(again.rgba, canvases[chart.name].rgba)


@charts
def test_a_chart_says_what_it_is(chart):
    assert chart.name == chart.name.lower()
    assert " " not in chart.name
    assert chart.title
    assert chart.separates


def test_no_two_charts_are_alike(canvases):
    names = list(canvases)
    for number, one in enumerate(names):
        for other in names[number + 1 :]:
            assert not np.array_equal(canvases[one].rgba8, canvases[other].rgba8), (one, other)


def test_the_f_is_itself_in_no_mirror_and_no_turn():
    values = letter(9).values
    cube = np.zeros((12, 12, 12), np.uint8)
    cube[:9, :12, :10] = values
    seen = set()
    for axes in ((0, 1, 2), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0)):
        for flips in np.ndindex(2, 2, 2):
            turned = np.flip(cube.transpose(axes), [axis for axis in range(3) if flips[axis]])
            seen.add(turned.tobytes())
    assert len(seen) == 48
