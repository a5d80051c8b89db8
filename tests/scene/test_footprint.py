"""The rectangle of a volume on the screen against rays that are all cast."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

import volref as vr
from volref.scene.footprint import footprint
from volref.scene.transform import transform_directions, transform_points
from volref.stages.rays import pixel_rays
from volref.stages.spans import box_spans

POINT = st.tuples(*[st.floats(-6, 6)] * 3)
TABLE = vr.TransferFunction([0], [(1, 1, 1)], [1])


def seen_by(scene):
    """The pixels (H, W) whose rays meet the box of the volume."""
    rays = pixel_rays(scene.camera, scene.width, scene.height, np.arange(scene.width * scene.height))
    matrix = scene.volume.index_from_world
    origins, directions = (
        transform_points(matrix, rays.origins).T,
        transform_directions(matrix, rays.directions).T,
    )
    spans = box_spans(origins, directions, *scene.volume.index_bounds)
    return (spans.t_far > spans.t_near).reshape(scene.height, scene.width)


def scene_of(eye, target, parallel, place=(0, 0, 0)):
    up = (0.3, 0.1, 1.0)
    if parallel:
        camera = vr.Camera.orthographic(eye, target, up, 9.0, 0.0, 50.0)
    else:
        camera = vr.Camera.look_at(eye, target, up, 70.0, 0.1, 50.0)
    volume = vr.Volume(np.zeros((2, 3, 4)), spacing=(1, 0.5, 1.5), origin=place)
    return vr.Scene(volume, TABLE, camera, 24, 16)


@given(eye=POINT, target=POINT, parallel=st.booleans())
def test_no_ray_that_meets_the_box_lies_outside(eye, target, parallel):
    try:
        scene = scene_of(eye, target, parallel)
    except vr.SceneError:  # no view from there
        return
    place = footprint(scene)
    outside = seen_by(scene)
    outside[place.top : place.bottom, place.left : place.right] = False
    assert not outside.any()


def test_it_is_tight_but_for_a_pixel_or_two():
    scene = scene_of((9.0, -7.0, 8.0), (1.0, 0.5, 0.5), parallel=False)
    rows, columns = np.nonzero(seen_by(scene))
    place = footprint(scene)
    assert rows.min() - place.top <= 2
    assert place.bottom - rows.max() <= 3
    assert columns.min() - place.left <= 2
    assert place.right - columns.max() <= 3


def test_a_box_behind_the_eye_or_beside_the_view_has_no_pixel():
    assert footprint(scene_of((20.0, 0.0, 0.0), (40.0, 0.0, 0.0), parallel=False)).pixels == 0
    assert footprint(scene_of((20.0, 0.0, 0.0), (0.0, 0.0, 0.0), parallel=True, place=(0, 90, 0))).pixels == 0
    out = vr.render(scene_of((20.0, 0.0, 0.0), (40.0, 0.0, 0.0), parallel=False))
    assert (out.samples, out.bound.max(), out.met_tolerance) == (0, 0.0, True)


def test_from_within_the_box_every_pixel_may_see_it():
    assert footprint(scene_of((0.2, 0.2, 0.2), (5.0, 0.0, 0.0), parallel=False)).pixels == 24 * 16
