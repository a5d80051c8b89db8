"""Lit spheres against the closed forms of Lambert, Phong and Blinn-Phong, pixel by pixel.

The vertices of an icosphere lie on the sphere, so unit vertex normals interpolated at the point P of a facet
are P / radius, and of length 1 again P / |P|: the normal of the smooth sphere through P.
"""

import math

import numpy as np
import pytest

from volref.phantoms.meshes import sphere_mesh
from volref.scene.camera import Camera
from volref.scene.lights import Light, Material
from volref.scene.mesh import Mesh
from volref.scene.scene import Scene
from volref.stages.rays import pixel_rays
from volref.truth.meshes.layers import visible_layers
from volref.truth.meshes.surfaces import visible_surface

SIDE, RADIUS, COLOR = 24, 1.3, (0.9, 0.5, 0.2)
VIEWS = {
    "front": ((0, -5, 0.5), (0, 0, 1)),
    "side": ((4, 3, -1), (0, 0, 1)),
    "top": ((0.1, 0.2, 5), (0, 1, 0)),
    "below": ((-2, 1, -4), (1, 0, 0)),
}
AMBIENT, SUN = (0.4, 0.3, 0.2), ((-1.0, 2.0, -3.0), (0.9, 0.8, 1.0))
LAMP = ((2.0, -3.0, 2.5), (0.7, 1.0, 0.6), (0.5, 0.1, 0.02))
LIGHTS = [
    Light.ambient(AMBIENT),
    Light.directional(*SUN),
    Light.point(*LAMP),
    Light.headlight((0.1, 0.2, 0.1)),
]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b, strict=True))


def unit(a):
    length = math.sqrt(dot(a, a))
    return [x / length for x in a]


def closed_form(material, point, normal, viewer):
    """Return the colour of one lit point with scalars alone; the formulas are those of the textbooks."""
    away = [lamp - p for lamp, p in zip(LAMP[0], point, strict=True)]
    d = math.sqrt(dot(away, away))
    c0, c1, c2 = LAMP[2]
    arriving = [
        (unit([-x for x in SUN[0]]), 1.0, SUN[1]),
        (unit(away), 1 / (c0 + c1 * d + c2 * d * d), LAMP[1]),
        (viewer, 1.0, (0.1, 0.2, 0.1)),
    ]
    result = [material.ambient * light * c for light, c in zip(AMBIENT, COLOR, strict=True)]
    for to_light, strength, light in arriving:
        facing = dot(normal, to_light)
        if facing <= 0:
            continue
        if material.model == "phong":
            mirrored = [2 * facing * n - t for n, t in zip(normal, to_light, strict=True)]
            shine = max(dot(mirrored, viewer), 0.0) ** material.shininess
        else:
            half = unit([t + v for t, v in zip(to_light, viewer, strict=True)])
            shine = max(dot(normal, half), 0.0) ** material.shininess
        shine *= material.specular * (material.model != "lambert")
        for k in range(3):
            result[k] += strength * light[k] * (material.diffuse * facing * COLOR[k] + shine)
    return result


def ball(**options):
    sphere = sphere_mesh(RADIUS, subdivisions=3)
    return Mesh(sphere.vertices, sphere.faces, COLOR, lit=True, **options)


def scene_of(mesh, view, material=None, lights=LIGHTS):
    eye, up = VIEWS[view]
    camera = Camera.look_at(eye, (0, 0, 0), up, 36.0, 0.1, 20.0)
    return Scene(None, None, camera, SIDE, SIDE, meshes=[mesh], lights=lights, material=material)


def hit_points(scene, surface):
    """Return pixels, points and directions towards the viewer of all that was hit."""
    pixels = np.flatnonzero(surface.mesh.ravel() >= 0)
    rays = pixel_rays(scene.camera, SIDE, SIDE, pixels)
    return pixels, rays.origins + surface.distance.ravel()[pixels, None] * rays.directions, -rays.directions


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("model", ["lambert", "phong", "blinn-phong"])
def test_a_lit_sphere_has_the_closed_form_of_its_model(model, view):
    material = Material(model, ambient=0.3, diffuse=0.8, specular=0.5, shininess=12.0)
    mesh = ball(normals=sphere_mesh(2.0, subdivisions=3).vertices)  # of any length
    scene = scene_of(mesh, view, material)
    surface = visible_surface(scene)
    pixels, points, viewers = hit_points(scene, surface)
    assert len(pixels) > 150
    expected = [
        closed_form(material, p, unit(p), v) for p, v in zip(points.tolist(), viewers.tolist(), strict=True)
    ]
    # A point to some 20 eps of 5, the same over a radius of 1.3 in the normal, times the shininess.
    np.testing.assert_allclose(
        surface.color.reshape(-1, 3)[pixels], expected, rtol=0, atol=12 * 100 * 2.0**-52
    )


@pytest.mark.parametrize("view", VIEWS)
def test_without_normals_every_triangle_is_flat(view):
    material = Material("phong", specular=0.5)
    scene = scene_of(ball(), view, material)
    surface, mesh = visible_surface(scene), scene.meshes[0]
    pixels, points, viewers = hit_points(scene, surface)
    corners = mesh.vertices[mesh.faces[surface.face.ravel()[pixels]]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    expected = [
        closed_form(material, p, unit(n), v)
        for p, n, v in zip(points.tolist(), normals.tolist(), viewers.tolist(), strict=True)
    ]
    # As above; edges of 0.2 out of corners of 1.3 make the normal 6 times as sensitive.
    np.testing.assert_allclose(
        surface.color.reshape(-1, 3)[pixels], expected, rtol=0, atol=10 * 600 * 2.0**-52
    )


def test_transparent_lit_meshes_are_lit_layer_by_layer():
    """The nearer layers are those of the opaque mesh; the farther ones turn their normals away."""
    normals = sphere_mesh(2.0, subdivisions=3).vertices
    scene = scene_of(ball(normals=normals, opacity=0.5), "side")
    layers = visible_layers(scene, visible_surface(scene))
    opaque = visible_surface(scene_of(ball(normals=normals), "side"))
    np.testing.assert_array_equal(layers.color[0::2], opaque.color.reshape(-1, 3)[opaque.mesh.ravel() == 0])
    pixel = np.repeat(np.arange(SIDE**2), layers.counts)[1::2]
    rays = pixel_rays(scene.camera, SIDE, SIDE, pixel)
    points = rays.origins + layers.distance[1::2, None] * rays.directions
    expected = [
        closed_form(Material(), p, unit(p), (-d).tolist())
        for p, d in zip(points.tolist(), rays.directions, strict=True)
    ]
    np.testing.assert_allclose(layers.color[1::2], expected, rtol=0, atol=10 * 100 * 2.0**-52)  # as above


def test_meshes_answer_lights_where_the_volume_does_not():
    unlit, plain = (
        visible_surface(scene_of(ball(), "top", given)).color for given in (Material("unlit"), None)
    )
    np.testing.assert_array_equal(unlit, plain)


def test_without_lights_or_without_being_lit_colours_stay_as_they_are():
    sphere = sphere_mesh(RADIUS)
    plain = Mesh(sphere.vertices, sphere.faces, COLOR)
    for scene in (scene_of(ball(), "top", lights=()), scene_of(plain, "top")):
        surface = visible_surface(scene)
        assert (surface.color[surface.mesh == 0] == COLOR).all()
