"""Transparent meshes in a volume, against a loop over all triangles with closed forms between them."""

import dataclasses
from concurrent.futures import ProcessPoolExecutor
from itertools import pairwise
from multiprocessing import get_context

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import volref as vr
from tests.oracles.layered import faceted_truth, slab
from tests.oracles.moller_trumbore import first_hits
from tests.scenes import rough_scene
from volref.phantoms.meshes import box_mesh, sphere_mesh
from volref.records import Layers
from volref.stages.rays import pixel_rays
from volref.truth.canvas import Canvas
from volref.truth.integration import Integration
from volref.truth.meshes.layered import _shared_out, integrate_layered
from volref.truth.meshes.surfaces import visible_surface

EXTINCTION, COLOR = 0.35, (0.9, 0.5, 0.25)
BACKGROUND = np.array([0.05, 0.02, 0.1, 0.4])
WIDTH, HEIGHT = 20, 14
BOX = (-0.5, -0.5, -0.5), (6.5, 5.5, 4.5)
MIDDLE = (3.0, 2.5, 2.0)
OUTSIDE = vr.Camera.look_at((14.0, 9.0, 11.0), MIDDLE, (0, 0, 1), 30.0, 0.1, 100.0)
INSIDE = vr.Camera.look_at((3.1, 2.4, 2.2), (5.0, 3.0, 2.5), (0, 0, 1), 80.0, 1e-3, 100.0)
PARALLEL = vr.Camera.orthographic((14.0, 9.0, 11.0), MIDDLE, (0, 0, 1), 7.0, 0.0, 100.0)


def spheres(radii, centers):
    """Return transparent spheres, each with its own colour and opacity."""
    rng = np.random.default_rng(len(radii))
    meshes = []
    for radius, center in zip(radii, centers, strict=True):
        ball = sphere_mesh(radius, center, subdivisions=2)
        meshes.append(vr.Mesh(ball.vertices, ball.faces, rng.random(3), opacity=rng.uniform(0.05, 0.6)))
    return meshes


def nested(count):
    return spheres(np.linspace(0.5, 2.8, count), [MIDDLE] * count)


SCENES = {
    "one sphere": (nested(1), OUTSIDE),
    "three nested spheres": (nested(3), OUTSIDE),
    "eight nested spheres": (nested(8), OUTSIDE),
    "eight nested spheres, parallel": (nested(8), PARALLEL),
    "seen from the innermost": (nested(8), INSIDE),
    "overlapping, and out of the box": (
        spheres([1.5, 1.8, 1.2, 3.5], [(2, 2, 2), (3.5, 3, 2.2), (6.5, 2.5, 2), (2, 3, 3.5)]),
        OUTSIDE,
    ),
}


def box_scene(meshes, camera=OUTSIDE, width=WIDTH, height=HEIGHT):
    volume = vr.Volume(np.zeros((5, 6, 7), np.uint8))
    transfer = vr.TransferFunction([0.0], [COLOR], [EXTINCTION])
    return vr.Scene(volume, transfer, camera, width, height, meshes=meshes, background=BACKGROUND)


def truth_of(scene):
    """Return the faceted truth at all pixels not within 2^-16 of an edge, and which these are."""
    triangles = np.concatenate([mesh.vertices[mesh.faces] for mesh in scene.meshes])
    look = [(mesh.colors, mesh.opacity) for mesh in scene.meshes for _ in mesh.faces]
    pixels = np.arange(scene.width * scene.height)
    clear = first_hits(scene.camera, scene.width, scene.height, triangles, pixels).margin > 2.0**-16
    rays = pixel_rays(scene.camera, scene.width, scene.height, pixels[clear])
    medium = COLOR, 0.0 if scene.volume is None else EXTINCTION
    truth = [
        faceted_truth(ray, triangles, look, BOX, medium, BACKGROUND)
        for ray in zip(rays.origins, rays.directions, strict=True)
    ]
    return np.array(truth), pixels[clear]


@pytest.mark.parametrize("name", SCENES)
def test_spheres_in_a_homogeneous_box_are_the_faceted_truth(name):
    scene = box_scene(*SCENES[name])
    truth, pixels = truth_of(scene)
    assert len(pixels) >= WIDTH * HEIGHT - 3
    for method in ("exact", "march"):
        out = vr.render(scene, method=method, tolerance=1e-11, threads=1)
        error = np.abs(out.rgba.reshape(-1, 4)[pixels] - truth).max(axis=1)
        # A distance is off by some ulp of 20 over the cosine at the silhouette, for each of 17 slabs.
        assert error.max() <= 1e-11
    assert np.isinf(out.distance).all()


@pytest.mark.parametrize("name", ["three nested spheres", "overlapping, and out of the box"])
def test_without_a_volume_only_the_layers_are_laid_over_each_other(name):
    meshes, camera = SCENES[name]
    scene = vr.Scene(None, None, camera, WIDTH, HEIGHT, meshes=meshes, background=BACKGROUND)
    out = vr.render(scene)
    truth, pixels = truth_of(scene)
    error = np.abs(out.rgba.reshape(-1, 4)[pixels] - truth).max(axis=1)
    # No distance matters here: what the image promises, and as many roundings of the loop.
    assert (error <= 2 * out.bound.reshape(-1)[pixels] + 1e-16).all()
    assert out.bound_kind == "certified"
    assert out.bound.max() < 1e-13


def test_the_tolerance_is_met_and_shared_out_by_what_arrives():
    scene = box_scene(nested(8))
    for tolerance in (1e-3, 1e-6, 1e-9):
        out = vr.render(scene, tolerance=tolerance)
        assert out.met_tolerance
        assert out.bound_kind == "certified"


def rough(meshes, **options):
    """Return a scene of random values, about which no closed form is known, with meshes in it."""
    scene = rough_scene(40, 32)
    middle = scene.volume.corners.mean(axis=0)
    moved = [
        vr.Mesh(mesh.vertices - MIDDLE + middle, mesh.faces, mesh.colors, opacity=mesh.opacity)
        for mesh in meshes
    ]
    return dataclasses.replace(scene, meshes=moved, **options)


def test_certified_bounds_hold_between_layers():
    """A coarse image against a fine one of the same scene: both know their layers at the same distances."""
    fine = vr.render(rough(nested(3)), tolerance=1e-12)
    assert fine.bound.max() < 1e-11
    for tolerance in (1e-2, 1e-4, 1e-7):
        coarse = vr.render(rough(nested(3)), tolerance=tolerance)
        error = np.abs(coarse.rgba - fine.rgba).max(axis=2)
        assert (error <= coarse.bound + fine.bound).all()
        assert error.max() > 0
        assert coarse.bound.max() <= tolerance


def test_estimates_of_a_march_hold_between_layers():
    fine = vr.render(rough(nested(3)), tolerance=1e-10)
    out = vr.render(rough(nested(3)), method="march", step=0.05)
    error = np.abs(out.rgba - fine.rgba).max(axis=2)
    assert (error <= out.bound + fine.bound).mean() >= 0.999
    assert out.bound_kind == "estimate"


def images_agree(first, second):
    """Both images are within their bounds of one truth."""
    error = np.abs(first.rgba - second.rgba).max(axis=2)
    assert (error <= first.bound + second.bound).all()


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=10, deadline=None)
def test_neither_the_order_of_meshes_nor_splitting_them_changes_the_image(seed):
    rng = np.random.default_rng(seed)
    meshes = spheres([1.5, 1.8, 1.2], rng.uniform(1, 4, (3, 3)))
    first = meshes[0]
    halves = [
        vr.Mesh(first.vertices, first.faces[some], first.colors, opacity=first.opacity)
        for some in (slice(0, 100), slice(100, None))
    ]
    image, *others = (
        vr.render(box_scene(some, width=12, height=9), tolerance=1e-10)
        for some in (meshes, meshes[::-1], [halves[1], meshes[2], halves[0], meshes[1]])
    )
    for other in others:
        np.testing.assert_array_equal(other.rgba, image.rgba)


def test_layers_of_opacity_one_hide_what_an_opaque_mesh_hides():
    """An alpha of 0 at a vertex that no triangle uses makes a mesh go through the layers."""
    for mesh in nested(2):
        ball = vr.Mesh(mesh.vertices, mesh.faces, mesh.colors)
        colors = np.append(np.tile([*mesh.colors, 1.0], (len(mesh.vertices), 1)), [(0, 0, 0, 0)], axis=0)
        vertices = np.append(mesh.vertices, [(0, 0, 0)], axis=0)
        layered = vr.Mesh(vertices, mesh.faces, colors, coloring="vertex")
        assert layered.transparent
        images_agree(vr.render(box_scene([ball])), vr.render(box_scene([layered])))


def test_a_mesh_of_nearly_no_opacity_changes_nearly_nothing():
    ball = nested(1)[0]
    faint = vr.Mesh(ball.vertices, ball.faces, opacity=1e-12)
    without, there = vr.render(box_scene([]), tolerance=1e-13), vr.render(box_scene([faint]), tolerance=1e-13)
    error = np.abs(there.rgba - without.rgba).max(axis=2)
    assert (error <= without.bound + there.bound + 2e-12).all()


def test_threads_and_processes_draw_the_same_image():
    scene = rough(nested(3))
    alone = vr.render(scene, tolerance=1e-6, threads=1)
    np.testing.assert_array_equal(vr.render(scene, tolerance=1e-6, threads=2).rgba, alone.rgba)
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        apart = vr.render(scene, tolerance=1e-6, executor=pool)
    np.testing.assert_array_equal(apart.rgba, alone.rgba)
    np.testing.assert_array_equal(apart.bound, alone.bound)


def test_what_is_not_reached_in_time_is_bounded_by_all_that_layers_could_show():
    bright = [vr.Mesh(mesh.vertices, mesh.faces, (5, 4, 3), opacity=0.5) for mesh in nested(3)]
    scene = rough(bright)
    truth = vr.render(scene, tolerance=1e-8)
    hurried = vr.render(scene, tolerance=1e-8, max_seconds=1e-9)
    images_agree(hurried, truth)
    assert hurried.bound.max() > 1


def test_opaque_meshes_among_transparent_ones_end_the_rays():
    outer, inner, core = nested(3)[::-1]
    solid = vr.Mesh(core.vertices, core.faces, core.colors)
    out = vr.render(box_scene([outer, solid, inner]))
    np.testing.assert_array_equal(out.distance, vr.render(box_scene([solid])).distance)
    nearly = vr.Mesh(core.vertices, core.faces, core.colors, opacity=1 - 2.0**-53)
    images_agree(out, vr.render(box_scene([outer, nearly, inner])))


def test_layers_begin_and_end_slabs_whatever_the_tolerance_of_each():
    """Panes by hand: two layers before a surface, with the volume's part known between them."""
    scene = box_scene([])
    integration = Integration(scene, vr.plan(scene, method="exact", tolerance=1e-12))
    pixels = np.array([WIDTH * (HEIGHT // 2) + WIDTH // 2] * 2)
    ray = pixel_rays(scene.camera, WIDTH, HEIGHT, pixels[:1])
    near, _ = slab(ray.origins[0], ray.directions[0], *BOX)
    at = near + np.array([1.0, 2.5])
    layers = Layers(
        np.array([0, 2, 2]),
        at,
        np.array([(1.0, 0, 0), (0, 1, 0)]),
        np.array([0.25, 0.5]),
        *np.zeros((2, 2), int),
    )
    ends, behind = np.array([near + 3.0] * 2), np.array([(0, 0, 1.0, 1.0)] * 2)
    done = integrate_layered(integration, layers, pixels, ends, behind, 1e-12)
    expected = []
    for opacities in ((0.25, 0.5), (0.0, 0.0)):
        image = behind[0]
        for length, color, opacity in zip(
            (0.5, 1.5, 1.0), [(0, 1, 0), (1, 0, 0), (0, 0, 0)], (*opacities[::-1], 0.0), strict=True
        ):
            clear = np.exp(-EXTINCTION * length)
            image = (1 - clear) * np.array([*COLOR, 1.0]) + clear * image
            image = opacity * np.array([*color, 1.0]) + (1 - opacity) * image
        expected.append(image)
    # Lengths are differences of distances of 16: some ulp of that.
    np.testing.assert_allclose(done.rgba, expected, rtol=0, atol=1e-14)
    assert (done.bound <= 1e-12).all()


def test_what_arrives_of_the_slabs_tolerances_is_the_tolerance():
    """And no slab has to be better than it would with all slabs at that pixel."""
    rng = np.random.default_rng(4)
    counts = rng.integers(0, 6, 50)
    starts = np.append(0, np.cumsum(counts))
    opacity = rng.uniform(0.05, 0.95, starts[-1])
    empty = np.zeros(starts[-1])
    layers = Layers(starts, empty, np.zeros((starts[-1], 3)), opacity, empty.astype(int), empty.astype(int))
    shares = _shared_out(layers, 1e-6)
    assert len(shares) == counts.max() + 1
    worst = []
    for first, last in pairwise(starts.tolist()):
        arriving = np.cumprod(np.append(1.0, 1 - opacity[first:last]))
        worst.append((arriving * shares[: len(arriving)]).sum())
    assert max(worst) <= 1e-6
    assert min(shares) >= 0.99e-6 / 6 * (1 - 1e-15)
    assert shares[-1] > 2 * shares[0]


@pytest.mark.parametrize("camera", [OUTSIDE, PARALLEL], ids=["perspective", "parallel"])
def test_clipping_planes_cut_volume_and_meshes_where_they_leave_a_smaller_box(camera):
    """A glass box in a homogeneous one, both cut: they look like smaller boxes, caps and all."""
    planes = [vr.Plane((2.0, 0, 0), (1, 0, 0)), vr.Plane((0, 3.5, 0), (0, -1, 0))]
    low, high = np.array([1.0, 1.0, 1.0]), np.array([5.0, 4.5, 3.0])
    glass = box_mesh(high - low, (low + high) / 2, colors=(0.2, 0.5, 0.9))
    glass = dataclasses.replace(glass, opacity=0.4)
    out = vr.render(dataclasses.replace(box_scene([glass], camera), clip=planes), tolerance=1e-12)
    low[0], high[1] = 2.0, 3.5
    smaller = box_mesh(high - low, (low + high) / 2)
    triangles = smaller.vertices[smaller.faces]
    pixels = np.arange(WIDTH * HEIGHT)
    clear = first_hits(camera, WIDTH, HEIGHT, triangles, pixels).margin > 2.0**-16
    assert clear.sum() >= len(pixels) - 2
    rays = pixel_rays(camera, WIDTH, HEIGHT, pixels[clear])
    box = (2.0, -0.5, -0.5), (6.5, 3.5, 4.5)
    look = [((0.2, 0.5, 0.9), 0.4)] * len(triangles)
    expected = [
        faceted_truth(ray, triangles, look, box, (COLOR, EXTINCTION), BACKGROUND)
        for ray in zip(rays.origins, rays.directions, strict=True)
    ]
    # Distances of 20, off by some ulp over a cosine of 1 : 10.
    np.testing.assert_allclose(out.rgba.reshape(-1, 4)[clear], expected, rtol=0, atol=1e-13)


def test_a_canvas_has_layers_only_of_transparent_meshes():
    ball = sphere_mesh(1.0, MIDDLE)
    for meshes, expected in (([ball], False), ([ball, nested(1)[0]], True)):
        scene = box_scene(meshes)
        assert (Canvas(scene, visible_surface(scene)).layers is not None) == expected
