"""The modes as `render` draws them: through plan, meshes, clipping planes, lights, layers and radars."""

import dataclasses
from concurrent.futures import ProcessPoolExecutor

import numpy as np
import pytest

import volref as vr
from tests.scenes import camera_towards, rough_scene
from volref.phantoms.meshes import sphere_mesh
from volref.stages.rays import pixel_rays

ULP = np.finfo(float).eps
GREY = vr.TransferFunction([-10, 10], [(0, 0, 0), (1, 1, 1)], opacity=[1, 1])


def ball(count=24, centre=(0.1, -0.2, 0.05)):
    """The distance from a point, sampled, negative: greatest in the middle."""
    at = np.linspace(-1, 1, count)
    z, y, x = np.meshgrid(at, at, at, indexing="ij")
    values = -np.sqrt((x - centre[0]) ** 2 + (y - centre[1]) ** 2 + (z - centre[2]) ** 2)
    spacing = (2 / (count - 1),) * 3
    return vr.Volume(values, spacing, origin=(-1, -1, -1), centering="node")


def ball_scene(mode, **more):
    volume = ball()
    return vr.Scene(volume, GREY, camera_towards(volume), 24, 18, mode=mode, **more)


def test_a_lit_isosurface_of_a_ball_is_shaded_as_a_sphere_from_four_views():
    volume, radius, centre = ball(64), 0.6, np.array([0.1, -0.2, 0.05])
    transfer = vr.TransferFunction([-2, 0], [(0.9, 0.5, 0.3)] * 2, opacity=[1, 1])
    lights = [
        vr.Light.ambient((0.2, 0.3, 0.4)),
        vr.Light.directional((1, 2, -1), (0.8, 0.9, 0.7)),
        vr.Light.point((2, -2, 1), attenuation=(1, 0, 0.2)),
    ]
    for model in ("lambert", "phong", "blinn-phong"):
        material = vr.Material(model, ambient=0.5, diffuse=0.6, specular=0.4, shininess=7)
        for direction in ((1, 0.2, 0.3), (-0.4, 1, 0.5), (0.1, -1, -0.7), (-1, -0.3, 1)):
            camera = camera_towards(volume, direction)
            look = {"mode": "isosurface", "isovalue": -radius, "lights": lights, "material": material}
            scene = vr.Scene(volume, transfer, camera, 20, 16, **look)
            out = vr.render(scene)
            rays = pixel_rays(camera, 20, 16, np.arange(320))
            away = rays.origins - centre
            along = (away * rays.directions).sum(axis=1)
            root = along**2 - (away**2).sum(axis=1) + radius**2
            hit = root > 0.02  # near the silhouette the normal turns fast
            t = -along[hit] - np.sqrt(root[hit])
            points = rays.origins[hit] + t[:, None] * rays.directions[hit]
            normals = (points - centre) / radius
            expected = np.array(
                [
                    scalar_shading(lights, material, point, normal, -view, (0.9, 0.5, 0.3))
                    for point, normal, view in zip(points, normals, rays.directions[hit], strict=True)
                ]
            )
            shown = out.rgba.reshape(-1, 4)[hit]
            assert out.bound_kind == "estimate"
            assert hit.sum() > 30
            assert (shown[:, 3] == 1).all()
            # 64 samples across: central differences put the normal off by about (2/63)^2 / (2 r^2) of itself
            # at the most bent places, and the surface by as much; the highlight is 7 times as steep.
            assert np.abs(shown[:, :3] - expected).max() < 0.02
            assert np.abs(out.distance.reshape(-1)[hit] - t).max() < 2e-3


def scalar_shading(lights, material, point, normal, viewer, color):
    """Lambert 1760, Phong 1975 and Blinn 1977 for one point, from the formulas, number by number."""
    result = np.zeros(3)
    for light in lights:
        shine = np.array(light.color)
        if light.kind == "ambient":
            result += material.ambient * shine * color
            continue
        if light.kind == "point":
            way = np.array(light.position) - point
            distance = np.linalg.norm(way)
            c0, c1, c2 = light.attenuation
            shine = shine / (c0 + c1 * distance + c2 * distance**2)
            way = way / distance
        else:
            way = -light.direction
        facing = float(normal @ way)
        if facing <= 0:
            continue
        result += material.diffuse * shine * facing * color
        if material.model == "phong":
            result += material.specular * shine * max(0, (2 * facing * normal - way) @ viewer) ** 7
        elif material.model == "blinn-phong":
            half = (way + viewer) / np.linalg.norm(way + viewer)
            result += material.specular * shine * max(0, normal @ half) ** 7
    return result


def assert_same_distance(one, other):
    """A ray that ends elsewhere is counted from another middle: a few roundings of the distance."""
    np.testing.assert_allclose(one, other, rtol=8 * ULP)


def test_modes_see_what_lies_before_an_opaque_mesh_and_the_mesh_behind_it():
    mesh = sphere_mesh(0.5, (0.1, -0.2, 0.05), colors=(1, 0, 0), subdivisions=3)
    for mode in ("mip", "minip", "average"):
        without, out = (vr.render(ball_scene(mode, meshes=meshes)) for meshes in ((), (mesh,)))
        covered = np.isfinite(out.distance)
        assert covered.any()
        assert not covered.all()
        np.testing.assert_array_equal(out.rgba[~covered], without.rgba[~covered])
        if mode != "minip":  # the least value lies outside, before the mesh on some rays
            assert (out.rgba[covered] != without.rgba[covered]).any(axis=-1).all()
    out = vr.render(ball_scene("mip", meshes=[mesh]))
    # Before a sphere around it the greatest value is the one on the sphere.
    assert np.abs(out.rgba[covered][:, 0] - (10 - 0.5) / 20).max() < 0.01


def test_an_isosurface_hides_a_mesh_behind_it_and_not_one_before_it():
    inner, outer = (
        sphere_mesh(radius, (0.1, -0.2, 0.05), colors=(1, 0, 0), subdivisions=3) for radius in (0.3, 0.8)
    )
    scene = ball_scene("isosurface", isovalue=-0.6)
    bare = vr.render(scene)
    hit = np.isfinite(bare.distance)
    behind = vr.render(dataclasses.replace(scene, meshes=[inner]))
    np.testing.assert_array_equal(behind.rgba[hit], bare.rgba[hit])
    assert_same_distance(behind.distance[hit], bare.distance[hit])
    before = vr.render(dataclasses.replace(scene, meshes=[outer]))
    assert (before.rgba[hit] == (1, 0, 0, 1)).all()


def test_glass_before_an_isosurface_lies_over_it():
    glass = sphere_mesh(0.8, (0.1, -0.2, 0.05), colors=(1, 0, 0), subdivisions=3)
    fields = {name: getattr(glass, name) for name in ("vertices", "faces", "colors")}
    glass = vr.Mesh(**fields, opacity=0.25)
    scene = ball_scene("isosurface", isovalue=-0.6)
    bare, out = vr.render(scene), vr.render(dataclasses.replace(scene, meshes=[glass]))
    hit = np.isfinite(bare.distance)
    np.testing.assert_allclose(out.rgba[hit], 0.75 * bare.rgba[hit] + (0.25, 0, 0, 0.25), rtol=8 * ULP)
    assert_same_distance(out.distance[hit], bare.distance[hit])
    assert out.bound_kind == "certified"
    with pytest.raises(vr.SceneError, match=r"scene.meshes must be opaque in mode 'mip'"):
        ball_scene("mip", meshes=[glass])


def test_a_clipped_isosurface_is_seen_from_inside():
    plane = vr.Plane((0.1, -0.2, 0.05), (1.1, 0.7, 0.9))
    facing = vr.Plane(plane.point, -plane.normal)
    scene = ball_scene("isosurface", isovalue=-0.6)
    whole = vr.render(scene)
    kept, cut = (vr.render(dataclasses.replace(scene, clip=[each])) for each in (plane, facing))
    hit = np.isfinite(whole.distance)
    # The side towards the camera shows the front, the other the inside of the back.
    np.testing.assert_array_equal(np.isfinite(kept.distance), hit)
    assert_same_distance(kept.distance[hit], whole.distance[hit])
    back = np.isfinite(cut.distance) & hit
    assert back.sum() > 10
    assert (cut.distance[back] > whole.distance[back]).all()


@pytest.mark.parametrize("mode", ["mip", "isosurface"])
def test_modes_are_the_same_from_other_processes_and_against_the_clock(mode):
    more = {"isovalue": 0.6} if mode == "isosurface" else {}
    scene = dataclasses.replace(rough_scene(48, 40), mode=mode, **more)
    alone = vr.render(scene, threads=1)
    with ProcessPoolExecutor(1) as pool:
        others = vr.render(scene, executor=pool)
    timed = vr.render(scene, max_seconds=1e6)
    for other in (others, timed):
        np.testing.assert_array_equal(other.rgba, alone.rgba)
        np.testing.assert_array_equal(other.distance, alone.distance)


def test_a_march_of_a_mode_and_what_does_not_suit_one_are_refused():
    scene = dataclasses.replace(rough_scene(), mode="mip")
    with pytest.raises(vr.SceneError, match=r"method must be 'exact' or 'auto' in mode 'mip', got 'march'"):
        vr.plan(scene, method="march")
    with pytest.raises(vr.SceneError, match=r"scene.classification must suit mode 'mip'"):
        dataclasses.replace(scene, classification="pre")
    edges = dataclasses.replace(scene.transfer, gradient_opacity=([0, 1], [0, 1]))
    with pytest.raises(vr.SceneError, match=r"scene.transfer must suit mode 'mip', got one of the gradient"):
        dataclasses.replace(scene, transfer=edges)


def radar_scene(mode, **more):
    """Sweeps whose values rise with range, evenly, so that along a ray they are known."""
    ranges = 500 + 1000 * np.arange(30.0)
    sweeps = [
        vr.Sweep(np.arange(2.5, 360, 5), e, np.tile(ranges / 500, (72, 1)), 500, 1000)
        for e in np.arange(0.0, 90.0, 5.0)
    ]
    camera = vr.Camera.orthographic((0, -50e3, 8e3), (0, 0, 8e3), (0, 0, 1), 20e3, 0, 1e6)
    transfer = vr.TransferFunction([-40, 60], [(0, 0, 0), (1, 1, 1)], opacity=[1, 1])
    return vr.Scene(vr.RadarVolume(sweeps), transfer, camera, 8, 6, mode=mode, **more)


def test_modes_of_a_radar_are_sampled_and_their_estimate_holds():
    """The value at a distance r of the antenna is r / 500; a ray passes it at a known distance."""
    scene = radar_scene("minip")
    rays = pixel_rays(scene.camera, 8, 6, np.arange(48))
    nearest = np.hypot(rays.origins[:, 0], rays.origins[:, 2])  # the rays run along y
    out = vr.render(scene)
    value = out.rgba.reshape(-1, 4)[:, 0] * 100 - 40
    assert out.bound_kind == "estimate"
    seen = out.rgba.reshape(-1, 4)[:, 3] > 0
    # Where the nearest point is seen: below the cone of silence, above the ground.
    inside = seen & (np.degrees(np.arctan2(rays.origins[:, 2], np.abs(rays.origins[:, 0]))) < 84)
    inside &= (rays.origins[:, 2] > 0) & (nearest > 1000)
    assert inside.sum() > 20
    error = np.abs(value - nearest / 500)[inside] / 100
    assert (error <= out.bound.reshape(-1)[inside] + 1e-9).all()
    surface = vr.render(radar_scene("isosurface", isovalue=40.0))
    hit = np.isfinite(surface.distance).reshape(-1) & inside
    assert hit.sum() > 20
    expected = 50e3 - np.sqrt(20e3**2 - nearest[hit] ** 2)
    # Linear between samples of a distance that is bent: half a gate apart, 250^2 / (2 * 1e4).
    assert np.abs(surface.distance.reshape(-1)[hit] - expected).max() < 10
    level = vr.render(radar_scene("slice", slice_plane=vr.Plane((0, 0, 0), (0, 1, 0)))).rgba.reshape(-1, 4)
    assert np.abs(level[inside, 0] * 100 - 40 - nearest[inside] / 500).max() < 1e-9


def test_the_bound_of_a_lit_isosurface_is_small_where_it_is_certain():
    """Also where the isovalue lies between the knots of the table, whose colour is then rounded."""
    lights = {"lights": [vr.Light.headlight()], "material": vr.Material("phong", diffuse=0.9)}
    out = vr.render(ball_scene("isosurface", isovalue=-0.6123, **lights))
    hit = np.isfinite(out.distance)
    assert np.quantile(out.bound[hit], 0.9) < 1e-5
    assert out.bound[~hit].max() == 0


def test_offsets_are_for_composite_scenes():
    scene = radar_scene("mip")
    with pytest.raises(vr.SceneError, match=r"scene.mode must be 'composite' to be jittered, got 'mip'"):
        vr.render_jittered(scene, 2)


def test_the_plan_of_a_radar_mode_says_that_it_is_sampled():
    names = {stage.name: stage for stage in vr.plan(radar_scene("mip")).stages}
    assert "empty space" not in names or not names["empty space"].included
    marched = {stage.name: stage for stage in vr.plan(radar_scene("mip"), method="march").stages}
    assert not marched["early termination"].included
