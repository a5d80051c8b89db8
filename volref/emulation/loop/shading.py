"""What lights make of the colours of samples: shaders for the loop of `volref.emulation.loop.marching`.

n samples, R rays; positions, gradients and colours are (3, n) or (4, n) in the device's type of values.

Model "lit" is that of `volref.stages.lighting`, in the world.  Model "cej" (seed 004) multiplies a colour by

    sum of the ambient lights' L + sum over the others of a L (k_a + k_d |n . l|+ + k_s s)

with s = (|r . v|+)^shininess (Phong) or (|n . h|+)^(4 shininess) (Blinn-Phong), |x|+ = max(x, 0), or |x| for
two-sided materials, and a = 1 / (1 + k d^2): ambient lights know no material, and every other light brings
the ambient part along.  There is no test for a light behind the surface: Phong's highlights shine there too.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np

from volref.arrays import Floats, Indices
from volref.emulation.loop.marching import Shader
from volref.emulation.pipeline import Pipeline
from volref.emulation.rays.box import Box
from volref.emulation.rays.paths import Ends
from volref.emulation.textures.gradient_volume import has_gradient_volume
from volref.emulation.textures.lookup import Found, Textures, look_up
from volref.errors import SceneError
from volref.scene.lights import Light, Material
from volref.scene.scene import Scene
from volref.scene.transfer2d import TransferFunction2D
from volref.scene.transform import transform_directions, transform_points
from volref.scene.volume import Volume
from volref.stages.gradients import in_world, length_and_direction
from volref.stages.lighting import lit_colors
from volref.stages.rays import pixel_rays
from volref.workspace import Workspace

# Below this length a gradient has no direction: the noise of float32 in it is 1e-7.
FLAT = 1e-3


@dataclass(frozen=True, eq=False)
class Place:
    """The space in which lights, normals and viewing directions are: the world or texture space.

    points, vectors: 4x4 matrices to it from texture space, and from the world.  normals: 4x4 matrix whose
    transpose takes gradients per voxel to it.  unit: world length of one unit of it.  viewer (3, R): unit
    vectors towards the viewer.
    """

    points: Floats
    vectors: Floats
    normals: Floats
    unit: float
    viewer: Floats


@dataclass(frozen=True, eq=False)
class Lamp:
    """A light with a direction: `vector` (3, 1) is the way to it, or where it is if `falloff` is not None.

    color (3, 1); falloff: k of 1 / (1 + k d^2).
    """

    color: Floats
    vector: Floats
    falloff: float | None

    def arriving(self, points: Floats) -> tuple[Floats, Floats]:
        """Return unit vectors (3, n) towards the light, and the colour, (3, n) or (3, 1), that arrives."""
        if self.falloff is None:
            return np.broadcast_to(self.vector.astype(points.dtype), points.shape), self.color
        way = self.vector.astype(points.dtype) - points
        square = np.sum(way * way, axis=0)
        return way / np.sqrt(square), self.color / (1 + self.falloff * square)


@dataclass(frozen=True, eq=False)
class Lights:
    """The lights of model "cej": what comes from everywhere (3, 1), and the others."""

    uniform: Floats
    lamps: tuple[Lamp, ...]
    material: Material


def check_gradients(scene: Scene, pipeline: Pipeline) -> None:
    """Refuse switches that do not go together, and scenes that need gradients where there are none.

    Raises
    ------
    SceneError
        If there are such.
    """
    lighting, table = pipeline.lighting, pipeline.table
    if has_gradient_volume(lighting):
        plain = pipeline.volume.layout == "3d" and pipeline.volume.format != "unorm16-split"
        if not plain or table.order != "post":
            message = f"pipeline.lighting.gradient must suit the volume, got {lighting.gradient!r}; "
            raise SceneError(message + "use a '3d' texture of one channel, classified 'post'")
        return
    if lighting.model != "none" and (lighting.gradient == "none" or table.order == "pre"):
        message = f"pipeline.lighting.gradient must be had for model {lighting.model!r}, got "
        message += f"{lighting.gradient!r} of values classified {table.order!r}; "
        raise SceneError(message + "use 'central', 'forward' or 'sobel-bytes', and 'post'")
    if pipeline.opacity.by_gradient or table.rows > 1:
        message = "pipeline.opacity.by_gradient and pipeline.table.rows must be 0 and 1 without a texture of "
        message += f"gradients, got {pipeline.opacity.by_gradient:g} and {table.rows}; "
        raise SceneError(message + "set pipeline.lighting.gradient to 'sobel-bytes'")
    transfer = scene.transfer
    if isinstance(transfer, TransferFunction2D) or (transfer and transfer.gradient_opacity is not None):
        message = f"scene.transfer must be one of the value alone for pipeline {pipeline.name!r}, got one of "
        raise SceneError(message + "the gradient too; use a pipeline with a texture of gradients")


def shader_of(scene: Scene, textures: Textures, box: Box, ends: Ends) -> Shader | None:
    """Return what lights do to samples of rays, None where they do nothing.

    Raises
    ------
    SceneError
        If the program has no such lights.
    """
    lighting = textures.pipeline.lighting
    if lighting.model == "none" or not scene.lights_volume:
        skips = has_gradient_volume(lighting) and lighting.flat == "skipped"
        return _left_out if skips else None
    place = place_of(scene, textures, box, ends)
    if lighting.model == "lit":
        return partial(_lit, textures, place, scene.lights, scene.material or Material())
    return partial(_cej, textures, place, lights_of(scene, place))


def place_of(scene: Scene, textures: Textures, box: Box, ends: Ends) -> Place:
    """Return the space in which a program lights the samples of rays."""
    lighting = textures.pipeline.lighting
    in_texture_space = lighting.model == "cej" and lighting.space == "texture"
    return (_texture_space if in_texture_space else _world)(scene, textures, box, ends)


def lights_of(scene: Scene, place: Place) -> Lights:
    """Return the lights of a scene as those of model "cej".

    Raises
    ------
    SceneError
        If that model has no such light.
    """
    ambient = [light.color for light in scene.lights if light.kind == "ambient"]
    uniform = np.sum(ambient, axis=0) if ambient else np.zeros(3)
    lamps = tuple(lamp_of(light, place) for light in scene.lights if light.kind != "ambient")
    return Lights(uniform[:, None], lamps, scene.material or Material())


def lamp_of(light: Light, place: Place) -> Lamp:
    """Return a light of the scene as one of model "cej".

    Raises
    ------
    SceneError
        If that model has no such light.
    """
    c0, c1, c2 = light.attenuation
    if light.kind == "headlight" or c1:
        got = "a headlight" if light.kind == "headlight" else f"the attenuation {list(light.attenuation)}"
        message = f"scene.lights must suit lighting model 'cej', got {got}; "
        raise SceneError(message + "use ambient, directional and point lights, attenuation (c0, 0, c2)")
    color = np.array(light.color)[:, None]
    if light.direction is not None:
        towards = transform_directions(place.vectors, -light.direction)
        return Lamp(color, (towards / np.linalg.norm(towards))[:, None], None)
    assert light.position is not None
    position = transform_points(place.vectors, light.position)
    return Lamp(color / c0, position[:, None], c2 / c0 * place.unit**2)


def _world(scene: Scene, textures: Textures, box: Box, ends: Ends) -> Place:
    assert isinstance(scene.volume, Volume)
    viewer = _towards_viewer(scene, ends).T.astype(textures.device.values_type)
    return Place(box.world_from_texture, np.eye(4), scene.volume.index_from_world, 1.0, viewer)


def _texture_space(scene: Scene, textures: Textures, box: Box, ends: Ends) -> Place:
    towards = transform_directions(box.texture_from_world, _towards_viewer(scene, ends))
    viewer = length_and_direction(towards.T)[1].astype(textures.device.values_type)
    return Place(np.eye(4), box.texture_from_world, np.eye(4), float(box.sides.mean()), viewer)


def _towards_viewer(scene: Scene, ends: Ends) -> Floats:
    """Return the world's unit vectors (R, 3) from where rays are towards the viewer."""
    return -pixel_rays(scene.camera, scene.width, scene.height, ends.pixel).directions


def _left_out(_: Floats, found: Found, __: Indices) -> Floats:
    """Return colours with an alpha of 0 where there is no gradient."""
    color = found.color.copy()
    color[3] = np.where(found.magnitude == 0, 0, color[3])
    return color


def _lit(
    textures: Textures,
    place: Place,
    lights: tuple[Light, ...],
    material: Material,
    position: Floats,
    found: Found,
    ray: Indices,
) -> Floats:
    """Return colours lit as volref's own volumes are."""
    points, normals = _surface(textures, place, position, found)
    color = found.color.copy()
    color[:3] = lit_colors(lights, material, points, normals, place.viewer[:, ray], color[:3])
    return color


def _cej(
    textures: Textures, place: Place, lights: Lights, position: Floats, found: Found, ray: Indices
) -> Floats:
    """Return colours times the illumination of seed 004."""
    points, normals = _surface(textures, place, position, found)
    viewer = place.viewer[:, ray]
    color = found.color.copy()
    if has_gradient_volume(textures.pipeline.lighting) and textures.pipeline.lighting.flat == "skipped":
        color = _left_out(position, found, ray)
    illumination = np.zeros_like(color[:3]) + lights.uniform
    for lamp in lights.lamps:
        towards, arriving = lamp.arriving(points)
        illumination += arriving * answered(lights.material, normals, towards, viewer)
    color[:3] *= illumination
    return color


def answered(material: Material, normals: Floats, towards_light: Floats, viewer: Floats) -> Floats:
    """Return k_a + k_d |n . l|+ + k_s s (n,), see the head of this module; k_a where there is no normal.

    Examples
    --------
    >>> up = np.array([[0.0], [0.0], [1.0]])
    >>> shiny = Material("blinn-phong", ambient=0.25, diffuse=0.5, specular=1.0, shininess=1)
    >>> [answered(shiny, n, up, up).tolist() for n in (up, -up, 0 * up)]
    [[1.75], [0.25], [0.25]]
    """
    facing = np.sum(normals * towards_light, axis=0)
    answer = material.ambient + material.diffuse * _cosine(facing, material)
    if material.model != "lambert":
        aligned, power = alignment(material, facing, normals, towards_light, viewer)
        shine = material.specular * aligned**power
        answer = answer + np.where(np.any(normals != 0, axis=0), shine, 0)
    return np.asarray(answer)


def alignment(
    material: Material, facing: Floats, normals: Floats, towards_light: Floats, viewer: Floats
) -> tuple[Floats, float]:
    """Return the cosine (n,) of a highlight, of those that face the light by n . l (n,), and its power."""
    if material.model == "phong":
        aligned = np.sum((2 * facing * normals - towards_light) * viewer, axis=0)
        return _cosine(aligned, material), material.shininess
    halfway = towards_light + viewer
    aligned = np.sum(normals * halfway, axis=0) / np.sqrt(np.sum(halfway * halfway, axis=0))
    return _cosine(aligned, material), 4 * material.shininess


def _cosine(cosine: Floats, material: Material) -> Floats:
    return np.abs(cosine) if material.two_sided else np.maximum(cosine, 0)


def _surface(textures: Textures, place: Place, position: Floats, found: Found) -> tuple[Floats, Floats]:
    """Return points and unit normals (3, n), towards lesser values; 0 where there is no gradient."""
    points = transform_points(place.points, position.T.astype(textures.device.values_type)).T
    gradient = found.gradient if found.gradient is not None else _differences(textures, position, found)
    rule = textures.pipeline.lighting.normals
    turned = gradient if rule == "untransformed" else in_world(gradient, place.normals)
    length, normals = length_and_direction(turned)
    if rule == "inward":
        normals = -normals
    if rule == "unguarded":
        normals = np.where(length > 0, normals, np.nan)
    elif found.magnitude is not None and textures.pipeline.lighting.flat == "ambient":
        normals = np.where(found.magnitude < FLAT, 0, normals)
    return points, normals


def _differences(textures: Textures, position: Floats, found: Found) -> Floats:
    """Return minus the gradient per voxel (3, n), by differences of what the program finds.

    "central": half the difference one voxel before and behind.  "forward": the one to the voxel behind.
    """
    work, kind = Workspace(), position.dtype.type
    central = textures.pipeline.lighting.gradient == "central"
    gradient = np.empty(position.shape, textures.device.values_type)
    for axis, size in enumerate(textures.size):
        sides = []
        for way in (-1, 1) if central else (1,):
            place = position.copy()
            place[axis] += kind(way / size)
            sides.append(look_up(textures, place, work).value)
        gradient[axis] = (sides[0] - sides[1]) / 2 if central else found.value - sides[0]
    return gradient
