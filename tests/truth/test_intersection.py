"""Opaque meshes in, before, behind and at the border of a volume, against closed forms.

In a homogeneous box a ray that meets the surface at distance d has the image c (1 - exp(-sigma L)) + T B
with L = min(d, t_far) - t_near.  d is that of the faceted sphere, by brute force over all its triangles.
"""

import dataclasses
import math

import numpy as np
import pytest

import volref as vr
from tests.oracles import scalar
from tests.oracles.moller_trumbore import first_hits
from volref.phantoms.meshes import box_mesh, sphere_mesh
from volref.scene.camera import look_at_matrix

EXTINCTION, COLOR, SURFACE = 0.35, np.array([0.9, 0.5, 0.25]), np.array([0.1, 0.8, 0.3])
BACKGROUND = np.array([0.05, 0.02, 0.1, 0.4])
WIDTH, HEIGHT = 40, 30
EYE, TARGET = (14.0, 9.0, 11.0), (3.0, 2.5, 2.0)

# Box: voxel centres 0..6, 0..5, 0..4, so it reaches from -0.5 to 6.5, 5.5 and 4.5.
PLACES = {
    "inside": (3.0, 2.5, 2.0, 1.5),
    "in front": (9.0, 6.3, 7.0, 1.0),
    "behind": (-4.0, -2.0, -2.5, 2.0),
    "half out": (6.5, 2.5, 2.0, 1.7),
    "touching a face": (3.0, 2.5, 4.5 - 1.5, 1.5),
    "around the box": (3.0, 2.5, 2.0, 12.0),
}


def box_scene(meshes):
    volume = vr.Volume(np.zeros((5, 6, 7), np.uint8))
    transfer = vr.TransferFunction([0.0], [COLOR], [EXTINCTION])
    camera = vr.Camera.look_at(EYE, TARGET, (0, 0, 1), 40.0, 0.1, 100.0)
    return vr.Scene(volume, transfer, camera, WIDTH, HEIGHT, meshes=meshes, background=BACKGROUND)


def closed_form(scene, distance, x, y):
    """The image of pixel (x, y) whose surface is `distance` away, +inf for none."""
    origin, direction = scalar.look_at_ray(EYE, TARGET, (0, 0, 1), 40.0, WIDTH, HEIGHT, x, y)
    low, high = ([float(number) for number in bound] for bound in scene.volume.index_bounds)
    span = scalar.box_span(origin, direction, low, high)
    length = max(min(span[1], distance) - span[0], 0.0) if span else 0.0
    behind = BACKGROUND if math.isinf(distance) else np.array([*SURFACE, 1.0])
    opacity = -math.expm1(-EXTINCTION * length)
    return np.array([*(COLOR * opacity), opacity]) + math.exp(-EXTINCTION * length) * behind


def ball(place):
    x, y, z, radius = PLACES[place]
    return sphere_mesh(radius, (x, y, z), colors=SURFACE, subdivisions=3)


def largest_error(scene, out):
    """Against the closed form over all pixels but those within 2^-16 of an edge, and how many these are."""
    mesh = scene.meshes[0]
    pixels = np.arange(WIDTH * HEIGHT)
    hits = first_hits(scene.camera, WIDTH, HEIGHT, mesh.vertices[mesh.faces], pixels)
    near_an_edge = hits.margin < 2.0**-16
    errors = [
        np.abs(out.rgba[y, x] - closed_form(scene, hits.distance[y * WIDTH + x], x, y)).max()
        for y in range(HEIGHT)
        for x in range(WIDTH)
        if not near_an_edge[y * WIDTH + x]
    ]
    return max(errors), int(near_an_edge.sum()), int(np.isfinite(hits.distance).sum())


@pytest.mark.parametrize("method", ["exact", "march"])
@pytest.mark.parametrize("place", PLACES)
def test_a_sphere_meets_a_homogeneous_box_as_the_closed_form_says(place, method):
    scene = box_scene([ball(place)])
    error, near_an_edge, hits = largest_error(scene, vr.render(scene, method=method, tolerance=1e-12))
    # The surface: a few ulp of a distance of 20 over the cosine at the silhouette, 1e-12; the integral: an
    # ulp for each of some 30 segments.
    assert error <= 1e-11
    assert near_an_edge <= 2
    assert hits >= 15


@pytest.mark.parametrize("step", [0.05, 0.3, 1.7, 30.0])
def test_the_integral_ends_exactly_at_the_surface_whatever_the_step(step):
    # A renderer that ends one step early, or on a whole step, is off by up to 1 - exp(-0.35 step).
    scene = box_scene([ball("inside")])
    error, _, _ = largest_error(scene, vr.render(scene, method="march", step=step, tolerance=1e-12))
    assert error <= 1e-11  # as above


def test_a_mesh_with_the_faces_of_the_box_hides_the_volume_from_outside():
    scene = box_scene([box_mesh((7, 6, 5), (3.0, 2.5, 2.0), colors=SURFACE)])
    out = vr.render(scene)
    hit = np.isfinite(out.distance)
    assert hit.sum() > 100
    # Mesh and box agree to an ulp of the distance, so at most that much of the volume lies before the mesh.
    np.testing.assert_allclose(out.rgba[hit], np.tile([*SURFACE, 1.0], (hit.sum(), 1)), rtol=0, atol=1e-13)


def test_a_plane_in_the_far_face_of_the_box_leaves_the_volume_before_it_whole():
    wall = vr.Mesh(
        [(-0.5, -0.5, -0.5), (6.5, -0.5, -0.5), (6.5, 5.5, -0.5), (-0.5, 5.5, -0.5)],
        [(0, 1, 2), (0, 2, 3)],
        colors=SURFACE,
    )
    scene = box_scene([wall])
    error, near_an_edge, hits = largest_error(scene, vr.render(scene))
    assert error <= 1e-11  # as above
    assert near_an_edge <= 2
    assert hits > 50


def test_oblique_parallel_rays_meet_mesh_and_volume_in_the_same_place():
    # A cabinet projection: the mesh has the faces of the box, so one hides the other wherever either is seen.
    matrix = [[0.15, 0, 0.05, 0], [0, 0.15, 0.04, 0], [0, 0, -0.02, -1], [0, 0, 0, 1]]
    view = look_at_matrix(EYE, TARGET, (0, 0, 1))
    camera = vr.Camera.from_matrices(view, matrix)
    mesh = box_mesh((7, 6, 5), (3.0, 2.5, 2.0), colors=SURFACE)
    volume_alone = vr.Scene(box_scene([]).volume, box_scene([]).transfer, camera, 40, 40)
    both = dataclasses.replace(volume_alone, meshes=(mesh,))
    seen = vr.render(volume_alone).rgba[..., 3] > 0
    out = vr.render(both)
    assert seen.sum() > 100
    assert (np.isfinite(out.distance) == seen).mean() > 0.999  # outlines of one and the other may round apart
    hit = np.isfinite(out.distance)
    np.testing.assert_allclose(out.rgba[hit], np.tile([*SURFACE, 1.0], (hit.sum(), 1)), rtol=0, atol=1e-12)


def test_distance_is_that_of_the_nearest_mesh_of_several():
    scene = box_scene([ball("behind"), ball("inside"), ball("in front")])
    out = vr.render(scene)
    alone = [vr.render(box_scene([mesh])).distance for mesh in scene.meshes]
    np.testing.assert_array_equal(out.distance, np.min(alone, axis=0))


def test_meshes_without_a_volume_are_drawn_over_the_background():
    scene = box_scene([ball("inside")])
    scene = vr.Scene(None, None, scene.camera, WIDTH, HEIGHT, meshes=scene.meshes, background=BACKGROUND)
    out = vr.render(scene)
    hit = np.isfinite(out.distance)
    assert (out.rgba[hit] == [*SURFACE, 1.0]).all()
    assert (out.rgba[~hit] == BACKGROUND).all()
    assert (out.bound == 0).all()
