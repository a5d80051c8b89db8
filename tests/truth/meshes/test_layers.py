"""Layers against a loop over all triangles, and the laws they keep."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.oracles.layered import all_hits
from tests.oracles.meshes import bumpy_sphere
from tests.oracles.moller_trumbore import first_hits
from volref.phantoms.meshes import box_mesh, sphere_mesh, torus_mesh
from volref.scene.camera import Camera
from volref.scene.lights import Light, Material
from volref.scene.mesh import Mesh
from volref.scene.plane import Plane
from volref.scene.scene import Scene
from volref.stages.rays import pixel_rays
from volref.truth.meshes.layers import visible_layers
from volref.truth.meshes.surfaces import visible_surface

VIEW = {"eye": (2.4, 1.7, 1.6), "target": (0, 0, 0), "up": (0, 0, 1)}
CAMERAS = {
    "perspective": Camera.look_at(**VIEW, fov_y=40.0, near=0.1, far=100.0),
    "parallel": Camera.orthographic(**VIEW, height=2.6, near=0.0, far=20.0),
    "inside": Camera.look_at((0.3, 0.2, -0.1), (1, 0.4, 0.2), (0, 0, 1), 75.0, 1e-3, 100.0),
}
WIDTH, HEIGHT = 48, 40


def layers_of(scene):
    return visible_layers(scene, visible_surface(scene))


def scene_of(meshes, camera="perspective", width=WIDTH, height=HEIGHT, **options):
    return Scene(None, None, CAMERAS[camera], width, height, meshes=meshes, **options)


def glass():
    """Three bodies that pass through each other, one of them concave."""
    return [
        bumpy_sphere(400, colors=(1, 0, 0), opacity=0.3),
        torus_mesh(0.9, 0.35, (0.2, 0.1, 0.3), segments=20, sides=10),
        bumpy_sphere(300, bump=0.3, center=(0.5, 0.4, 0.2), radius=0.8, opacity=0.9),
    ]


def transparent(mesh, opacity=0.5, **options):
    return Mesh(mesh.vertices, mesh.faces, mesh.colors, opacity=opacity, **options)


@pytest.mark.parametrize("camera", CAMERAS)
def test_layers_are_all_hits_of_a_loop_over_the_triangles(camera):
    scene = scene_of([transparent(mesh) for mesh in glass()], camera)
    layers = layers_of(scene)
    triangles = np.concatenate([mesh.vertices[mesh.faces] for mesh in scene.meshes])
    starts = np.cumsum([0] + [len(mesh.faces) for mesh in scene.meshes])
    pixels = np.random.default_rng(1).choice(WIDTH * HEIGHT, 300, replace=False)
    # Nearer to an edge than a vertex is rounded, the z-buffer's grid of 2^-16 pixel decides.
    clear = first_hits(scene.camera, WIDTH, HEIGHT, triangles, pixels).margin > 2.0**-16
    assert clear.sum() >= 295
    rays = pixel_rays(scene.camera, WIDTH, HEIGHT, pixels[clear])
    total = 0
    for pixel, origin, direction in zip(pixels[clear], rays.origins, rays.directions, strict=True):
        mine = slice(*layers.starts[[pixel, pixel + 1]])
        hits = all_hits(origin, direction, triangles)
        assert (starts[layers.mesh[mine]] + layers.face[mine]).tolist() == [k for _, k in hits]
        # Distances of 4 and triangles of 0.1 at up to 1 : 1000: 40 eps x 4 x 1000.
        np.testing.assert_allclose(layers.distance[mine], [t for t, _ in hits], rtol=0, atol=4e-11)
        total += len(hits)
    assert total > 500


@pytest.mark.parametrize("camera", ["perspective", "parallel"])
def test_every_ray_through_closed_bodies_meets_an_even_number_of_layers(camera):
    """A crack or a doubled edge anywhere in 240 x 200 pixels would make the number odd."""
    scene = scene_of([transparent(mesh) for mesh in glass()], camera, 240, 200)
    counts = layers_of(scene).counts
    assert (counts % 2 == 0).all()
    assert set(np.unique(counts)) >= {0, 2, 4, 6, 8}


def test_with_the_camera_in_a_closed_body_the_number_is_odd():
    counts = layers_of(scene_of([transparent(sphere_mesh(2.0, (0.3, 0.2, -0.1)))], "inside")).counts
    assert (counts == 1).all()


def test_layers_are_sorted_and_end_at_the_opaque_surface():
    red, ring, green = glass()
    scene = scene_of([red, ring, green])
    surface, layers = visible_surface(scene), layers_of(scene)
    pixel = np.repeat(np.arange(WIDTH * HEIGHT), layers.counts)
    inner = pixel[1:] == pixel[:-1]
    assert (np.diff(layers.distance)[inner] >= 0).all()
    assert (layers.distance <= surface.distance.reshape(-1)[pixel]).all()
    assert set(np.unique(surface.mesh)) == {-1, 1}
    assert set(np.unique(layers.mesh)) == {0, 2}
    hidden = layers_of(scene_of([red, green])).counts - layers.counts
    assert (hidden >= 0).all()
    assert (hidden[surface.mesh.reshape(-1) == -1] == 0).all()
    assert hidden.max() >= 2


def test_coincident_surfaces_are_in_the_order_of_mesh_and_face():
    corners = [(-1, -1, 0), (1, -1, 0), (0, 1, 0)]
    pane, wall = Mesh(corners, [(0, 1, 2), (0, 1, 2)], opacity=0.5), Mesh(corners, [(0, 1, 2)])
    layers = layers_of(scene_of([pane, wall, pane]))
    assert set(layers.counts.tolist()) == {0, 2}
    assert set(layers.mesh.tolist()) == {0}
    assert layers.face.reshape(-1, 2).tolist() == [[0, 1]] * (len(layers.face) // 2)
    layers = layers_of(scene_of([pane, pane]))
    assert layers.mesh.reshape(-1, 4).tolist() == [[0, 0, 1, 1]] * (len(layers.face) // 4)
    assert layers.face.reshape(-1, 4).tolist() == [[0, 1, 0, 1]] * (len(layers.face) // 4)


def sorted_look(layers):
    """Return layers without the names of their meshes."""
    return np.column_stack([layers.distance, layers.color, layers.opacity])


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=25, deadline=None)
def test_neither_the_order_of_meshes_nor_splitting_them_changes_anything(seed):
    rng = np.random.default_rng(seed)
    vertices, faces = rng.uniform(-1, 1, (45, 3)), np.arange(45).reshape(-1, 3)
    opacity = rng.uniform(0.1, 1, 3)
    opacity[rng.integers(3)] = 1.0
    parts = [
        Mesh(vertices, some, colors=rng.random((len(some), 3)), coloring="face", opacity=opacity[i])
        for i, some in enumerate((faces[:4], faces[4:9], faces[9:]))
    ]
    first, last = (
        Mesh(
            parts[2].vertices,
            parts[2].faces[some],
            parts[2].colors[some],
            coloring="face",
            opacity=opacity[2],
        )
        for some in (slice(0, 2), slice(2, None))
    )
    whole = scene_of(parts, width=24, height=20)
    expected, behind = layers_of(whole), visible_surface(whole)
    for meshes in (parts[::-1], [parts[1], last, parts[0], first]):
        scene = scene_of(meshes, width=24, height=20)
        layers = layers_of(scene)
        np.testing.assert_array_equal(layers.starts, expected.starts)
        np.testing.assert_array_equal(sorted_look(layers), sorted_look(expected))
        np.testing.assert_array_equal(visible_surface(scene).color, behind.color)


def test_a_layer_shows_colour_and_alpha_of_its_mesh():
    camera = Camera.orthographic((0, 0, 1), (0, 0, 0), (0, 1, 0), 8.0, 0.0, 2.0)
    texture = np.random.default_rng(2).random((8, 8, 4))
    square = [(-4, -4, 0), (4, -4, 0), (4, 4, 0), (-4, 4, 0)]
    uv = [(0, 0), (1, 0), (1, 1), (0, 1)]
    mesh = Mesh(square, [(0, 1, 2), (0, 2, 3)], uv=uv, texture=texture, opacity=0.5)
    layers = layers_of(Scene(None, None, camera, 8, 8, meshes=[mesh]))
    assert (layers.counts == 1).all()
    # Weights to a few eps, times 8 texels.
    np.testing.assert_allclose(layers.color, texture[..., :3].reshape(-1, 3), rtol=0, atol=64 * 2.0**-52)
    np.testing.assert_allclose(layers.opacity, texture[..., 3].ravel() / 2, rtol=0, atol=64 * 2.0**-52)


@pytest.mark.parametrize("camera", ["perspective", "parallel"])
def test_front_and_back_sides_are_the_nearer_and_the_farther_half_of_a_convex_body(camera):
    ball = sphere_mesh(0.8, (0.1, 0.2, 0.0))
    both = layers_of(scene_of([transparent(ball)], camera))
    front, back = (layers_of(scene_of([transparent(ball, sides=side)], camera)) for side in ("front", "back"))
    assert set(both.counts.tolist()) == {0, 2}
    np.testing.assert_array_equal(front.distance, both.distance[0::2])
    np.testing.assert_array_equal(back.distance, both.distance[1::2])


def test_back_sides_have_their_own_colour():
    ball = sphere_mesh(0.8, colors=(1, 0, 0))
    layers = layers_of(scene_of([transparent(ball, back_color=(0, 0, 1))]))
    assert (layers.color[0::2] == (1, 0, 0)).all()
    assert (layers.color[1::2] == (0, 0, 1)).all()
    seen = visible_surface(scene_of([Mesh(ball.vertices, ball.faces, back_color=(0, 0, 1), sides="back")]))
    assert (seen.color[seen.mesh == 0] == (0, 0, 1)).all()
    assert (seen.distance[seen.mesh == 0] == layers.distance[1::2]).all()


def test_layers_of_some_pixels_are_theirs():
    layers = layers_of(scene_of([transparent(mesh) for mesh in glass()]))
    pixels = np.array([900, 3, 960, 960])
    some = layers.of_pixels(pixels)
    assert some.counts.tolist() == layers.counts[pixels].tolist()
    expected = [layers.distance[layers.starts[p] : layers.starts[p + 1]] for p in pixels]
    np.testing.assert_array_equal(some.distance, np.concatenate(expected))
    assert layers.of_pixels(np.array([], int)).starts.tolist() == [0]


CUTS = {
    "one plane": [Plane((0.1, 0, 0), (1, 0, 0))],
    "away from the viewer": [Plane((0.1, 0, 0), (-1, 0, 0))],
    "before a camera inside": [Plane((0.6, 0, 0), (-1, 0, 0))],
    "a wedge": [Plane((0, 0.1, 0), (0, -1, 0)), Plane((0, 0, 0.2), (0, 0, 1))],
}


def cut_box(cut):
    """Return what planes across the axes leave of the box from -0.8 to 0.8."""
    low, high = np.full(3, -0.8), np.full(3, 0.8)
    for plane in cut:
        axis = int(np.abs(plane.normal).argmax())
        (low if plane.normal[axis] > 0 else high)[axis] = plane.point[axis]
    return box_mesh(high - low, (low + high) / 2, colors=(0.2, 0.5, 0.9))


@pytest.mark.parametrize("camera", ["perspective", "parallel", "inside"])
@pytest.mark.parametrize("cut", CUTS)
@pytest.mark.parametrize("opacity", [0.4, 1.0])
@pytest.mark.parametrize("sides", ["both", "front", "back"])
def test_a_box_that_is_cut_open_looks_like_the_smaller_box(cut, camera, opacity, sides):
    whole = box_mesh((1.6, 1.6, 1.6), colors=(0.2, 0.5, 0.9))
    style = {"opacity": opacity, "sides": sides, "back_color": (0.9, 0.1, 0.1)}
    found, expected = (
        scene_of([Mesh(mesh.vertices, mesh.faces, mesh.colors, **style)], camera, clip=clip)
        for mesh, clip in ((whole, CUTS[cut]), (cut_box(CUTS[cut]), ()))
    )
    layers, wanted = layers_of(found), layers_of(expected)
    surface, plain = visible_surface(found), visible_surface(expected)
    # A pixel whose ray passes within rounding of an edge of the cut may go either way.
    same = (layers.counts == wanted.counts) & ((surface.mesh == plain.mesh).ravel())
    assert (~same).sum() <= 2
    pixels = np.flatnonzero(same)
    some, want = layers.of_pixels(pixels), wanted.of_pixels(pixels)
    # Distances of 4 off by some 40 eps, over a cosine of 1 : 100.
    np.testing.assert_allclose(some.distance, want.distance, rtol=0, atol=4e-12)
    np.testing.assert_array_equal(some.color, want.color)
    np.testing.assert_array_equal(some.opacity, want.opacity)
    at, there = surface.distance.ravel()[pixels], plain.distance.ravel()[pixels]
    np.testing.assert_allclose(at, there, rtol=0, atol=4e-12)
    np.testing.assert_array_equal(surface.color.reshape(-1, 3)[pixels], plain.color.reshape(-1, 3)[pixels])
    # From inside, some cuts leave nothing to be seen.
    assert camera == "inside" or len(want.distance) + np.isfinite(there).sum() > 100


def test_a_surface_that_is_not_closed_is_cut_without_a_cap():
    ball = sphere_mesh(0.8)
    for faces, capped in ((ball.faces, True), (ball.faces[1:], False)):
        mesh = Mesh(ball.vertices, faces, opacity=0.5)
        layers = layers_of(scene_of([mesh], clip=[Plane((0.1, 0, 0), (-1, 0, 0))]))
        assert (-1 in layers.face) == capped


def test_a_cap_has_the_colour_of_the_nearest_hit_in_front_that_was_cut_away():
    ball = sphere_mesh(0.8)
    paint = np.random.default_rng(3).random((len(ball.faces), 3))
    mesh = Mesh(ball.vertices, ball.faces, paint, coloring="face")
    whole = visible_surface(scene_of([mesh]))
    cut = visible_surface(scene_of([mesh], clip=[Plane((0.3, 0.2, 0.1), (-3, -2, -2))]))
    caps = (cut.mesh == 0) & (cut.face == -1)
    assert caps.sum() > 100
    np.testing.assert_array_equal(cut.color[caps], whole.color[caps])
    assert (cut.distance[caps] > whole.distance[caps]).all()


def test_a_cap_lit_by_a_headlight_faces_the_viewer():
    ball = sphere_mesh(0.8, colors=(1, 1, 1))
    mesh = Mesh(ball.vertices, ball.faces, (1, 1, 1), lit=True)
    eye = np.array(VIEW["eye"])
    options = {
        "lights": [Light.headlight()],
        "material": Material("lambert", ambient=0.0, diffuse=1.0),
        "clip": [Plane((0.1, 0.1, 0), -eye)],
    }
    seen = visible_surface(scene_of([mesh], **options))
    caps = np.flatnonzero((seen.mesh == 0).ravel() & (seen.face == -1).ravel())
    rays = pixel_rays(CAMERAS["perspective"], WIDTH, HEIGHT, caps)
    cosine = -(rays.directions * (eye / np.linalg.norm(eye))).sum(axis=1)
    assert len(caps) > 100
    # A few roundings of numbers below 1.
    np.testing.assert_allclose(seen.color.reshape(-1, 3)[caps, 0], cosine, rtol=0, atol=8 * 2.0**-52)
