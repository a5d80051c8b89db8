"""Gradients that are known up to a radius, and what lights make of colours then."""

from typing import NamedTuple

import numpy as np

from volref.arrays import Floats, Indices
from volref.emulation.drawing import Drawing
from volref.emulation.loop.shading import FLAT, Lights, Place, alignment, answered, lights_of, place_of
from volref.emulation.pipeline import Pipeline
from volref.emulation.textures.gradient_volume import has_gradient_volume, unpacked
from volref.oracle.intervals.finding import Finder, Reach, classified, classified_2d
from volref.oracle.intervals.values import value_at
from volref.scene.lights import Material
from volref.scene.transform import transform_points
from volref.stages.gradients import in_world, length_and_direction
from volref.stages.lighting import lit_colors
from volref.workspace import Workspace

# Operations between a normal and the light that it sends: some thirty, each of numbers about 1.
OPERATIONS = 40


def has_texture(pipeline: Pipeline) -> bool:
    """Whether the texture of the volume holds gradients."""
    return has_gradient_volume(pipeline.lighting)


def with_gradient(
    finder: Finder, value: Floats, radius: Floats, channels: Floats, off: Floats, work: Workspace
) -> Reach:
    """Return what may be found of values (n,) and gradients that are fetched as channels (3, n)."""
    lighting = finder.textures.pipeline.lighting
    gradient, magnitude = unpacked(channels, lighting)
    scale = 2.0 if lighting.zero == "half" else 255 / 127
    gradient_off = scale * off.max(axis=0) + 6 * finder.slack.values
    reach = 1.7321 * gradient_off + 4 * finder.slack.values * magnitude
    if finder.textures.pipeline.table.rows > 1:
        ends, spread = classified_2d(finder, value, radius, magnitude, reach, work)
    else:
        ends, spread = classified(finder, value, radius, work)
    return Reach(ends, spread, value, radius, gradient, magnitude, reach)


class Lit(NamedTuple):
    """How lights meet the samples of a drawing's rays."""

    drawing: Drawing
    place: Place | None
    lights: Lights | None


def lit_of(drawing: Drawing) -> Lit | None:
    """Return how lights meet a drawing's samples, None where they do nothing."""
    if drawing.shade is None:
        return None
    lighting = drawing.pipeline.lighting
    if lighting.model == "none" or not drawing.scene.lights_volume:
        return Lit(drawing, None, None)
    place = place_of(drawing.scene, drawing.textures, drawing.box, drawing.ends)
    return Lit(drawing, place, lights_of(drawing.scene, place) if lighting.model == "cej" else None)


def shaded(lit: Lit, finder: Finder, position: Floats, reach: Reach, ray: Indices, radius: Floats) -> Reach:
    """Return what lights may make of what was found."""
    lighting = finder.textures.pipeline.lighting
    ends, spread = reach.ends.copy(), reach.spread.copy()
    if reach.magnitude is not None and lighting.flat == "skipped":
        assert reach.gradient_radius is not None
        maybe = reach.magnitude <= reach.gradient_radius
        sure = (reach.magnitude == 0) & (finder.slack.values == 0)
        most = np.abs(ends[:, 3]).max(axis=0)
        spread[3] = np.where(maybe, spread[3] + most, spread[3])
        ends[:, 3] = np.where(sure, 0.0, ends[:, 3])
    if lit.place is None:
        return reach._replace(ends=ends, spread=spread)
    light, shine, off = _light(lit, lit.place, finder, position, reach, ray, radius)
    top = np.maximum(np.abs(ends[:, :3]).max(axis=0), 1.0 if np.any(shine) else 0.0)
    spread[:3] = spread[:3] * (np.abs(light) + off) + top * off
    ends[:, :3] = ends[:, :3] * light + shine
    return reach._replace(ends=ends, spread=spread)


def _light(
    lit: Lit, place: Place, finder: Finder, position: Floats, reach: Reach, ray: Indices, radius: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return what colours are multiplied by and what is added (3, n), and how far both may be off (n,)."""
    scene, lighting = lit.drawing.scene, finder.textures.pipeline.lighting
    points = transform_points(place.points, position.T.astype(np.float64)).T
    gradient, gradient_off, _ = _gradient(finder, position, radius, reach)
    turns = lighting.normals != "untransformed"
    length, normals = length_and_direction(in_world(gradient, place.normals) if turns else gradient)
    if lighting.normals == "inward":
        normals = -normals
    steepest = float(np.linalg.norm(place.normals[:3, :3], 2)) if turns else 1.0
    turned = _turned(steepest * gradient_off, length)
    if reach.magnitude is not None and lighting.flat == "ambient":
        flat = reach.magnitude < FLAT
        normals = np.where(flat, 0, normals)
        turned = np.where(flat, 0.0, turned)
        turned = np.where(np.abs(reach.magnitude - FLAT) <= gradient_off, 2.0, turned)
    turned = np.minimum(turned + OPERATIONS * finder.slack.values, 2.0)
    viewer = place.viewer[:, ray]
    off = np.zeros(points.shape[1])
    shine_on = np.zeros_like(points)
    if lit.lights is None:
        # Highlights have the colour of the light, whatever they lie on: black shows them alone.
        lights, matter = scene.lights, scene.material or Material()
        shine_on = lit_colors(lights, matter, points, normals, viewer, np.zeros_like(points))
        light = lit_colors(lights, matter, points, normals, viewer, np.ones_like(points)) - shine_on
        strongest = sum(float(np.max(one.color)) for one in scene.lights if one.kind != "ambient")
        power = matter.shininess * (4 if matter.model == "phong" else 1)
        off = strongest * (matter.diffuse * turned + _steep(matter) * np.minimum(power * turned, 1))
    else:
        light = np.zeros_like(points) + lit.lights.uniform
        for lamp in lit.lights.lamps:
            towards, arriving = lamp.arriving(points)
            matter = lit.lights.material
            light = light + arriving * answered(matter, normals, towards, viewer)
            off = off + np.max(arriving, axis=0) * _answer_off(matter, normals, towards, viewer, turned)
    largest = np.abs(light).max(axis=0) + np.abs(shine_on).max(axis=0)
    return light, shine_on, off + OPERATIONS * finder.slack.values * (1 + largest)


def _turned(off: Floats, length: Floats) -> Floats:
    """Return how far (n,) the ends of unit vectors are apart of vectors of a length that are off by so much.

    |u / |u| - v / |v|| is at most 2 |u - v| / (|u| + |v|) (Dunkl and Williams 1964), 2 at most.
    """
    sum_of_lengths = np.maximum(2 * length - off, off)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.nan_to_num(np.minimum(2 * off / sum_of_lengths, 2.0), nan=2.0)


def _steep(material: Material) -> float:
    return 0.0 if material.model == "lambert" else material.specular


def _answer_off(
    material: Material, normals: Floats, towards: Floats, viewer: Floats, turned: Floats
) -> Floats:
    """Return how far (n,) the answer to a light may be off where normals are turned by so much.

    A highlight c^p lies between (c - d)^p and (c + d)^p; Phong's mirrored ray is off by 4 times the normal.
    """
    off = material.diffuse * np.minimum(turned, 1.0)
    if material.model == "lambert":
        return off
    facing = np.sum(normals * towards, axis=0)
    cosine, power = alignment(material, facing, normals, towards, viewer)
    away = turned * (4.0 if material.model == "phong" else 1.0)
    least, most = np.maximum(cosine - away, 0.0), np.minimum(np.maximum(cosine, 0.0) + away, 1.0)
    return np.asarray(off + material.specular * (most**power - np.minimum(least, most) ** power))


def _gradient(
    finder: Finder, position: Floats, radius: Floats, reach: Reach
) -> tuple[Floats, Floats, Floats]:
    """Return minus the gradient per voxel (3, n), and how far it may be off (n,), twice."""
    if reach.gradient is not None and reach.gradient_radius is not None:
        return reach.gradient, reach.gradient_radius, reach.gradient_radius
    central, kind, work = (
        finder.textures.pipeline.lighting.gradient == "central",
        position.dtype.type,
        Workspace(),
    )
    gradient, off = np.empty(position.shape), np.zeros(position.shape[1])
    for axis, size in enumerate(finder.textures.size):
        sides = []
        for way in (-1, 1) if central else (1,):
            place = position.copy()
            place[axis] += kind(way / size)
            sides.append(value_at(finder, place, radius + 2 * finder.slack.control, work))
        if central:
            gradient[axis] = (sides[0][0] - sides[1][0]) / 2
            off = np.hypot(off, (sides[0][1] + sides[1][1]) / 2)
        else:
            gradient[axis] = reach.value - sides[0][0]
            off = np.hypot(off, reach.radius + sides[0][1])
    return gradient, off, off
