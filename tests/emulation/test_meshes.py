"""Meshes in emulations: what is drawn of them, where, how far away, and which are refused."""

import numpy as np
import pytest

from volref import Camera, Mesh, Scene, SceneError, TransferFunction, Volume, emulate, render
from volref.emulation.catalogue import named
from volref.emulation.device import Device
from volref.emulation.surfaces.meshes import NOWHERE, distances, surfaces_of
from volref.phantoms.meshes import box_mesh, sphere_mesh

CAMERA = Camera.look_at((1, 2, 20), (0, 0, 0), (0, 1, 0), 35, 5, 60)
PARALLEL = Camera.orthographic((3, 2, 20), (0, 0, 0), (0, 1, 0), 12, 5, 60)
EXACT = Device.named("exact")
RED, GREEN, BLUE = np.eye(3)


def square(z, side=4.0, colors=(0.2, 0.4, 0.6), **look):
    corners = [(x * side / 2, y * side / 2, z) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    return Mesh(corners, [(0, 1, 2), (0, 2, 3)], colors, **look)


def scene(*meshes, camera=CAMERA, size=(30, 24), alpha=0.3, background=(0.0, 0.0, 0.0, 0.0)):
    """A box of side 6 around the origin, all of one value."""
    volume = Volume(np.full((6, 6, 6), 200, np.uint8), origin=(-2.5, -2.5, -2.5))
    look = TransferFunction.from_opacity([0, 255], [(1, 1, 1)] * 2, [0.0, alpha], unit_distance=4.0)
    return Scene(volume, look, camera, *size, meshes, background=background)


@pytest.mark.parametrize("camera", [CAMERA, PARALLEL])
def test_distances_and_pixels_are_those_of_the_truth(camera):
    shown = scene(sphere_mesh(2.0, (0.5, 0.3, 0.2), RED, subdivisions=2), square(-4.0), camera=camera)
    ours, truth = emulate(shown, "texture3d"), render(shown)
    np.testing.assert_array_equal(np.isfinite(ours.distance), np.isfinite(truth.distance))
    there = np.isfinite(truth.distance)
    assert there.sum() > 40
    # Float64 on both sides, along different ways.
    np.testing.assert_allclose(ours.distance[there], truth.distance[there], rtol=1e-12)


def test_a_volume_of_one_value_with_meshes_is_the_truths_at_any_step():
    shown = scene(box_mesh((3.0, 2.0, 2.5), (0.5, 0.2, 0.7), (0.9, 0.5, 0.1)), square(-5.0, 9.0))
    floats = {"format": "exact"}
    coarse = named("texture3d").with_switches(
        stepping={"length": 0.3, "opaque_at": None}, table=floats, volume=floats, meshes=floats, output=floats
    )
    # The last step is as short as the way to the mesh, and powers of one transmittance multiply exactly.
    np.testing.assert_allclose(emulate(shown, coarse, EXACT).rgba, render(shown).rgba, rtol=0, atol=1e-13)


def test_targets_of_distance_are_cleared_to_nowhere():
    passes = emulate(scene(square(0.0)), "texture3d").passes
    empty = passes["mesh_color"][..., 3] == 0
    assert (passes["mesh_distance"][empty] == NOWHERE).all()
    assert (passes["mesh_distance"][~empty] < 30).all()
    assert 0 < empty.sum() < empty.size


def test_without_meshes_the_baseline_draws_no_targets_for_them():
    assert list(emulate(scene(), "texture3d").passes) == ["canvas"]


@pytest.mark.parametrize("name", ["texture3d", "arbelaz2016"])
def test_a_mesh_in_front_hides_the_volume_and_one_behind_shows_through(name):
    middle = 12, 15
    near, far = (square(z, 20.0, GREEN) for z in (6.0, -6.0))
    in_front, behind, alone = (emulate(scene(*given), name) for given in ([near], [far], []))
    assert in_front.rgba8[middle].tolist() == [0, 255, 0, 255]
    volume = alone.rgba[middle]
    assert 0.1 < volume[3] < 0.9
    over = volume + (1 - volume[3]) * np.array([0.0, 1.0, 0.0, 1.0])
    # The canvas has bytes, and the volume alone was rounded to one too.
    np.testing.assert_allclose(behind.rgba[middle], over, rtol=0, atol=1 / 255)
    assert in_front.samples[middle] == 0
    assert behind.samples[middle] == alone.samples[middle]
    assert in_front.distance[middle] < 16 < behind.distance[middle]


@pytest.mark.parametrize("name", ["texture3d", "arbelaz2016"])
def test_meshes_beside_the_volume_are_shown_alone(name):
    shown = scene(square(0.0, 60.0, (0.2, 0.4, 0.6)), camera=CAMERA)
    found = emulate(shown, name)
    corner = found.rgba8[0, 0]
    assert corner.tolist() == [51, 102, 153, 255]
    assert found.samples[0, 0] == 0
    assert np.isfinite(found.distance).all()


def test_the_first_of_two_equally_deep_meshes_stays():
    both = surfaces_of(scene(square(1.0, colors=RED), square(1.0, colors=BLUE)), EXACT)
    np.testing.assert_array_equal(both.color, np.tile(RED, (len(both.pixel), 1)))
    nearer = surfaces_of(scene(square(1.0, colors=RED), square(1.5, 1.0, colors=BLUE)), EXACT)
    assert {tuple(color) for color in nearer.color.tolist()} == {tuple(RED), tuple(BLUE)}


def test_colors_are_of_the_mesh_its_faces_its_vertices_or_its_texture():
    faces = surfaces_of(scene(square(0.0, colors=[RED, BLUE])), EXACT)
    assert {tuple(color) for color in faces.color.tolist()} == {tuple(RED), tuple(BLUE)}
    # Across the vertices a colour that is the place, x / 4 + 1/2 and y / 4 + 1/2.
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    vertices = surfaces_of(scene(square(0.0, colors=corners)), EXACT)
    world = CAMERA.world_from_view[:3, :3] @ vertices.view + CAMERA.world_from_view[:3, 3:]
    np.testing.assert_allclose(vertices.color[:, :2].T, world[:2] / 4 + 0.5, rtol=0, atol=1e-12)
    # A texture of two texels: the left half of the uv range is red at its texel's centre and before.
    uv = [(0, 0), (1, 0), (1, 1), (0, 1)]
    textured = Mesh(
        square(0.0).vertices, [(0, 1, 2), (0, 2, 3)], uv=uv, texture=np.stack([[RED, BLUE]]), wrap="clamp"
    )
    share = np.clip(2 * (world[0] / 4 + 0.5) - 0.5, 0, 1)
    found = surfaces_of(scene(textured), EXACT).color
    np.testing.assert_allclose(found, np.outer(1 - share, RED) + np.outer(share, BLUE), rtol=0, atol=1e-12)


def test_sides_and_the_color_of_the_back_are_kept_to():
    behind = Camera.look_at((1, 2, -20), (0, 0, 0), (0, 1, 0), 35, 5, 60)
    one_sided = square(0.0, sides="front")
    assert len(surfaces_of(scene(one_sided), EXACT).pixel) > 0
    assert len(surfaces_of(scene(one_sided, camera=behind), EXACT).pixel) == 0
    two_colors = square(0.0, colors=RED, back_color=BLUE)
    for camera, color in ((CAMERA, RED), (behind, BLUE)):
        found = surfaces_of(scene(two_colors, camera=camera), EXACT).color
        np.testing.assert_array_equal(found, np.tile(color, (len(found), 1)))


def test_parallel_distances_are_from_the_near_plane():
    level = Camera.orthographic((0, 0, 20), (0, 0, 0), (0, 1, 0), 12, 5, 60)
    surfaces = surfaces_of(scene(square(3.0), camera=level), EXACT)
    np.testing.assert_allclose(distances(surfaces, level), 20 - 5 - 3, rtol=1e-13)


def test_a_mesh_that_the_volume_hides_wholly_has_no_distance():
    shown = scene(square(-6.0, 20.0), alpha=1.0)
    thick = named("arbelaz2016").with_switches(opacity={"factor": 400.0})
    found = emulate(shown, thick)
    assert found.rgba[12, 15, 3] >= 1
    assert found.distance[12, 15] == np.inf
    assert np.isfinite(found.distance[0, 0]) == (found.rgba8[0, 0, 3] > 0)


CASES = {
    "transparent": (square(0.0, opacity=0.5), "texture3d", "must be opaque and unlit"),
    "lit": (square(0.0, lit=True), "arbelaz2016", "must be opaque and unlit"),
    "none drawn": (square(0.0), "congote2012", "must be empty for pipeline 'congote2012'"),
}


@pytest.mark.parametrize("case", CASES)
def test_a_program_refuses_meshes_that_it_cannot_draw(case):
    mesh, name, said = CASES[case]
    with pytest.raises(SceneError, match=said):
        emulate(scene(mesh), name)


def test_programs_that_do_not_go_together_with_meshes_are_refused():
    slab_by_depth = named("texture3d").with_switches(meshes={"kind": "depth"})
    with pytest.raises(SceneError, match="must not be 'depth' for rays of kind 'slab'"):
        emulate(scene(), slab_by_depth)
    passes_by_distance = named("arbelaz2016").with_switches(meshes={"kind": "distance"})
    with pytest.raises(SceneError, match="must be 'depth' or 'none' for rays of kind 'coordinates'"):
        emulate(scene(square(0.0)), passes_by_distance)
    far = np.diag([2.0, 2.5, -1.0, 0.0])
    far[3, 2], far[2, 3] = -1.0, -2.0
    endless = Camera.from_matrices(CAMERA.view_from_world, far)
    assert endless.far == np.inf
    with pytest.raises(SceneError, match=r"camera\.far must be finite"):
        emulate(scene(camera=endless), "arbelaz2016")
