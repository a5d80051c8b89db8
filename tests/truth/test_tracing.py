import dataclasses
import json

import numpy as np
import pytest

import volref as vr
from tests.oracles import scalar
from tests.scenes import camera_towards, colorful_transfer, rough_scene, rough_volume
from volref.phantoms.meshes import sphere_mesh

EPS = np.finfo(np.float64).eps


def scene_with_a_ball(**volume):
    field = rough_volume(5, **volume)
    center = field.corners.mean(axis=0)
    mesh = sphere_mesh(1.3, center, colors=(0.2, 0.9, 0.4))
    transfer = colorful_transfer(field.value_bounds[1])
    return vr.Scene(field, transfer, camera_towards(field), 12, 9, meshes=[mesh], background=(0.1, 0, 0, 0.2))


@pytest.mark.parametrize("pixel", [(6, 4), (3, 2), (0, 0), (9, 5)])
def test_the_result_of_a_trace_is_the_pixel_of_the_image(pixel):
    scene = scene_with_a_ball()
    out = vr.render(scene, method="march", tolerance=1e-12)
    rgba = vr.trace(scene, pixel).head["rgba"]
    # the same operations in the same order, but for powers of a whole array: an ulp per segment
    np.testing.assert_allclose(rgba, out.rgba[pixel[1], pixel[0]], rtol=0, atol=40 * EPS)


def test_every_column_is_what_it_says():
    scene = scene_with_a_ball(centering="node", spacing=(1.0, 1.5, 0.8))
    trace = vr.trace(scene, (6, 4))
    table, head = trace.table, trace.head
    volume = scene.volume
    assert head["surface"]["mesh"] == 0
    assert head["ended"] == "the ray meets an opaque surface"
    assert head["span"][1] == head["surface"]["distance"] == table["t_end"][-1]
    np.testing.assert_array_equal(table["t_start"][1:], table["t_end"][:-1])
    np.testing.assert_allclose(table["t"], (table["t_start"] + table["t_end"]) / 2, rtol=4 * EPS)
    index = (table["position"] - volume.origin) / volume.spacing
    np.testing.assert_allclose(table["index"], index, rtol=0, atol=1e-13)  # a few ulp of the eye's distance
    np.testing.assert_allclose(table["cell"] + table["fraction"], table["index"], rtol=0, atol=4 * EPS * 8)
    for k, point in enumerate(table["index"]):
        assert table["value"][k] == pytest.approx(scalar.trilinear(volume.values, point), abs=32 * EPS)
        x, y, z = table["cell"][k]
        nz, ny, nx = volume.values.shape
        far = min(x + 1, nx - 1), min(y + 1, ny - 1), min(z + 1, nz - 1)
        assert table["corners"][k][0] == volume.values[z, y, x]
        assert table["corners"][k][1] == volume.values[z, y, far[0]]
        assert table["corners"][k][7] == volume.values[far[2], far[1], far[0]]
        length = table["t_end"][k] - table["t_start"][k]
        opacity = scalar.segment_opacity(scene.transfer, table["value"][k], length)
        assert table["opacity"][k] == pytest.approx(opacity, abs=1e-14)  # length: a difference of t near 10
    np.testing.assert_allclose(table["weight"], table["opacity"] * table["transmittance"], rtol=2 * EPS)
    color = np.cumsum(table["weight"][:, None] * table["color"], axis=0)
    np.testing.assert_allclose(table["accumulated"][:, :3], color, rtol=0, atol=40 * EPS)


def test_a_ray_that_misses_says_so_and_keeps_the_background():
    scene = rough_scene(12, 9, background=(0.1, 0, 0, 0.2))
    trace = vr.trace(scene, (0, 0))
    assert trace.head["span"] is None
    assert trace.head["ended"] == "the ray misses the volume"
    assert str(trace).splitlines()[-1] == "rgba: 0.1 0 0 0.2"
    assert json.loads(trace.to_json())["segments"] == {}
    assert trace.head["rgba"] == [0.1, 0, 0, 0.2]


def test_a_surface_in_front_of_the_volume_hides_it():
    scene = rough_scene(3, 3)
    eye = scene.camera.world_from_view[:3, 3]
    mesh = sphere_mesh(0.5, eye * 0.8 + scene.volume.corners.mean(axis=0) * 0.2, colors=(1, 0, 0))
    scene = vr.Scene(scene.volume, scene.transfer, scene.camera, 3, 3, meshes=[mesh])
    trace = vr.trace(scene, (1, 1))
    assert trace.head["ended"] == "a surface lies in front of the volume"
    assert trace.head["rgba"] == [1, 0, 0, 1]


def test_json_holds_every_column_and_no_nan():
    trace = vr.trace(scene_with_a_ball(), (6, 4))
    document = json.loads(trace.to_json())
    assert document["pixel"] == [6, 4]
    assert set(document["segments"]) == set(document["columns"]) == set(trace.table)
    assert len(document["segments"]["t"]) == len(trace.table["t"])


def test_the_table_for_people_has_a_line_per_segment():
    trace = vr.trace(scene_with_a_ball(), (6, 4))
    lines = str(trace).splitlines()
    assert len(lines) == len(trace.head) + 1 + len(trace.table["t"])


def test_a_scene_of_meshes_only_has_no_segments():
    scene = scene_with_a_ball()
    scene = vr.Scene(None, None, scene.camera, 12, 9, meshes=scene.meshes)
    assert vr.trace(scene, (6, 4)).head["ended"] == "no volume"


@pytest.mark.parametrize("pixel", [(12, 0), (0, 9), (-1, 0), (1.5, 2), (1, 2, 3)])
def test_pixels_outside_the_image_are_refused(pixel):
    with pytest.raises(vr.SceneError, match="pixel"):
        vr.trace(rough_scene(12, 9), pixel)


def test_the_plan_of_another_method_is_refused_with_a_cure():
    scene = rough_scene()
    with pytest.raises(vr.SceneError, match="plan must be a march's, got method 'exact'; make one with"):
        vr.trace(scene, (0, 0), plan=vr.plan(scene, method="exact"))
    planned = vr.trace(scene, (0, 0), plan=vr.plan(scene, method="march"))
    assert str(planned) == str(vr.trace(scene, (0, 0)))


LOOKS = {
    "lit": {
        "lights": [vr.Light.ambient(), vr.Light.point((9, 9, 9))],
        "material": vr.Material("blinn-phong"),
    },
    "analytic": {"lights": [vr.Light.headlight()], "gradient": "analytic"},
    "pre": {"classification": "pre"},
    "per-slice": {"classification": "per-slice"},
    "table": {"transfer": vr.TransferFunction2D(np.random.default_rng(2).random((3, 4, 4)), (0, 1), (0, 2))},
    "clipped": {"clip": [vr.Plane((2, 2, 2), (1, 0.3, 0.2))]},
}


@pytest.mark.parametrize("look", LOOKS.values(), ids=LOOKS)
def test_a_trace_goes_through_every_kind_of_field(look):
    scene = dataclasses.replace(scene_with_a_ball(), **look)
    out = vr.render(scene, method="march", tolerance=1e-12)
    for pixel in ((6, 4), (3, 2), (9, 5)):
        trace = vr.trace(scene, pixel)
        # Before a ray ends early it has let through 1e-6 at most.
        np.testing.assert_allclose(trace.head["rgba"], out.rgba[pixel[1], pixel[0]], rtol=0, atol=2e-6)
        if trace.table:
            assert ("value" in trace.table) == (look is LOOKS["clipped"])


def test_what_a_trace_cannot_show_is_refused():
    scene = scene_with_a_ball()
    glass = dataclasses.replace(scene.meshes[0], opacity=0.5)
    with pytest.raises(vr.SceneError, match=r"must be one volume up to a surface.*got transparent meshes"):
        vr.trace(dataclasses.replace(scene, meshes=[glass]), (6, 4))
    with pytest.raises(vr.SceneError, match=r"up to a surface to be traced, got mode 'mip'"):
        vr.trace(dataclasses.replace(scene, mode="mip"), (6, 4))


def test_a_ray_that_a_plane_cuts_off_says_so():
    scene = scene_with_a_ball()
    eye = scene.camera.world_from_view[:3, 3]
    away = vr.Plane(eye, eye - scene.volume.corners.mean(axis=0))
    scene = dataclasses.replace(scene, meshes=())
    assert vr.trace(dataclasses.replace(scene, clip=[away]), (6, 4)).head["ended"] == (
        "a clipping plane cuts it off"
    )
    middle = vr.Plane(scene.volume.corners.mean(axis=0), away.normal)
    ended = vr.trace(dataclasses.replace(scene, clip=[middle]), (6, 4)).head["ended"]
    assert ended == "the ray is cut off by a clipping plane"
