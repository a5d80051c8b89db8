"""Stage: the colour of lit points.

n points; positions, normals, directions and colours are (3, n), in the world and the working space.  The
formulas are at the head of `volref.scene.lights`.
"""

from collections.abc import Sequence

import numpy as np

from volref.arrays import Floats
from volref.scene.lights import Light, Material


def lit_colors(
    lights: Sequence[Light],
    material: Material,
    points: Floats,
    normals: Floats,
    towards_viewer: Floats,
    colors: Floats,
) -> Floats:
    """Return the colours of points whose material has the straight `colors` under `lights`.

    Normals have length 1, or 0 where there is none: such points get ambient light only.  `towards_viewer`
    has length 1.

    Examples
    --------
    >>> lights = [Light.ambient((0.5, 0.5, 0.5)), Light.directional((0, 0, -1))]
    >>> material = Material("lambert", ambient=1.0, diffuse=1.0)
    >>> up, side = np.array([[0.0], [0.0], [1.0]]), np.array([[1.0], [0.0], [0.0]])
    >>> [lit_colors(lights, material, up, n, up, np.ones((3, 1)))[0, 0].item() for n in (up, side, 0 * up)]
    [1.5, 0.5, 0.5]
    """
    if material.two_sided:
        normals = np.where(_dot(normals, towards_viewer) < 0, -normals, normals)
    shade, shine = np.zeros_like(colors), np.zeros_like(colors)
    for light in lights:
        color = np.array(light.color)[:, None]
        if light.kind == "ambient":
            shade += material.ambient * color
            continue
        towards_light, strength = _arriving(light, points, towards_viewer)
        facing = _dot(normals, towards_light)
        lit = np.where(facing > 0, strength, 0.0)
        shade += material.diffuse * color * (lit * np.maximum(facing, 0.0))
        if material.model != "lambert" and material.specular > 0:
            aligned = _aligned(material.model, normals, towards_light, towards_viewer, facing)
            shine += material.specular * color * (lit * aligned**material.shininess)
    shade *= colors
    return np.add(shade, shine, out=shade)


def brightest_lit(lights: Sequence[Light], material: Material, color: float) -> float:
    """Return a bound on the channels of `lit_colors` for colours of at most `color`.

    Examples
    --------
    >>> round(brightest_lit([Light.ambient(), Light.headlight((2, 1, 1))], Material(), 0.5), 12)
    1.15
    """
    ambient = sum(max(light.color) for light in lights if light.kind == "ambient")
    shining = sum(max(light.color) / light.attenuation[0] for light in lights if light.kind != "ambient")
    return color * (material.ambient * ambient + material.diffuse * shining) + material.specular * shining


def _arriving(light: Light, points: Floats, towards_viewer: Floats) -> tuple[Floats, Floats | float]:
    """Return the unit directions (3, n) to a light and how much of it arrives, (n,) or everywhere 1."""
    if light.kind == "headlight":
        return towards_viewer, 1.0
    if light.direction is not None:
        return np.broadcast_to(-light.direction[:, None], points.shape), 1.0
    assert light.position is not None
    way = light.position[:, None] - points
    distance = np.sqrt(_dot(way, way))
    c0, c1, c2 = light.attenuation
    # At the light itself there is no direction, and no side that faces it.
    way /= np.where(distance > 0, distance, 1.0)
    return way, 1.0 / (c0 + distance * (c1 + distance * c2))


def _aligned(
    model: str, normals: Floats, towards_light: Floats, towards_viewer: Floats, facing: Floats
) -> Floats:
    """Return how well the reflection meets the viewer (n,), in 0..1: an ulp more to a high power is much."""
    if model == "phong":
        mirrored = 2.0 * facing * normals - towards_light
        return np.asarray(np.clip(_dot(mirrored, towards_viewer), 0.0, 1.0))
    halfway = towards_light + towards_viewer
    length = np.sqrt(_dot(halfway, halfway))
    return np.asarray(np.clip(_dot(normals, halfway) / np.where(length > 0, length, 1.0), 0.0, 1.0))


def _dot(a: Floats, b: Floats) -> Floats:
    """Return the products (n,) of vectors (3, n)."""
    return np.asarray(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])
