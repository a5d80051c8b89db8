"""What a faulty page does before its shaders run: wrong uploads, filters, matrices and blend states."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from tests.webgl.engine import Job, Pass, Texture
from tests.webgl.systems.common import IMAGE, float32
from volref import Scene, Volume
from volref.emulation.rays.box import box_of

Page = Callable[[Job, Scene, float], Job]

# The texture that holds the volume, by system; the table.
VOLUMES, TABLES = ("volume", "atlas"), ("table", "colors")


def with_passes(job: Job, change: Callable[[Pass], Pass]) -> Job:
    passes = tuple(change(one) for one in job.passes)
    return job if passes == job.passes else replace(job, passes=passes)


def with_textures(job: Job, names: tuple[str, ...], change: Callable[[Texture], Texture]) -> Job:
    """Upload other textures; names are their beginnings."""
    changed = {name: change(one) for name, one in job.textures.items() if name.startswith(names)}
    return replace(job, textures={**job.textures, **changed}) if changed else job


def with_values(names: tuple[str, ...], change: Callable[[np.ndarray, float], np.ndarray]) -> Page:
    """Page that uploads other values."""

    def faulty(job: Job, _: Scene, strength: float) -> Job:
        return with_textures(
            job, names, lambda one: replace(one, values=change(np.asarray(one.values), strength))
        )

    return faulty


def _uploaded_as(kind: str) -> Page:
    """Volume of floats in another number format."""

    def change(one: Texture) -> Texture:
        values = np.asarray(one.values)
        texels = np.rint(255 * np.clip(values, 0, 1)).astype(np.uint8) if kind == "r8" else values
        return replace(one, values=texels.astype(np.float16) if kind == "r16f" else texels, format=kind)

    return lambda job, _, __: with_textures(job, VOLUMES, change)


def _nearest(job: Job, _: Scene, __: float) -> Job:
    return with_textures(job, VOLUMES, lambda one: replace(one, filter="nearest"))


def _as_srgb(job: Job, _: Scene, __: float) -> Job:
    """Volume in an image that the texture decodes from sRGB."""

    def change(one: Texture) -> Texture:
        values = np.asarray(one.values)
        opaque = np.full_like(values, 255)
        return replace(one, values=np.stack([values, values, values, opaque], axis=-1), format="srgb8_alpha8")

    return with_textures(job, VOLUMES, change)


def _stop_at(job: Job, _: Scene, strength: float) -> Job:
    """Rays end at another alpha."""

    def change(one: Pass) -> Pass:
        program = one.program
        if "opaque_at" in one.uniforms:
            return replace(one, uniforms={**one.uniforms, "opaque_at": strength})
        if "OPAQUE_AT" in program.defines:
            defines = {**program.defines, "OPAQUE_AT": float(strength)}
            return replace(one, program=replace(program, defines=defines))
        return one

    return with_passes(job, change)


def _hole_as(job: Job, scene: Scene, share: float) -> Job:
    """Voxels without data hold a share of what a texel can hold."""
    assert isinstance(scene.volume, Volume)
    hole = scene.volume.values == scene.volume.values.min()
    change = with_values(VOLUMES, lambda values, _: np.where(hole, np.uint8(round(255 * share)), values))
    return change(job, scene, share)


def _biased(job: Job, _: Scene, mean: float) -> Job:
    """Samples lie at another place in their steps, all of them or the mean of them."""

    def change(one: Pass) -> Pass:
        return replace(one, uniforms={**one.uniforms, "offset": mean}) if "offset" in one.uniforms else one

    moved = with_textures(
        job, ("jitter",), lambda one: replace(one, values=one.values * np.float32(2 * mean))
    )
    return with_passes(moved, change)


def _placed(job: Job, texture_from_texture: np.ndarray) -> Job:
    """Baseline whose box lies elsewhere: texture coordinates as a function of what they should be."""

    def change(one: Pass) -> Pass:
        if "texture_from_view" not in one.uniforms:
            return one
        inverse = np.linalg.inv(texture_from_texture)
        placed = {
            "texture_from_view": float32(texture_from_texture @ one.uniforms["texture_from_view"]),
            "world_from_texture": float32(one.uniforms["world_from_texture"] @ inverse[:3, :3]),
        }
        return replace(one, uniforms={**one.uniforms, **placed})

    return with_passes(job, change)


def _moved(job: Job, scene: Scene, voxels: float) -> Job:
    """A box so many voxels beside its place, with all that is in it."""
    assert isinstance(scene.volume, Volume)
    matrix = np.eye(4)
    matrix[:3, 3] = -voxels / np.array(scene.volume.size)
    return _placed(job, matrix)


def _narrower(job: Job, scene: Scene, _: float) -> Job:
    """A box from the first voxel's centre to the last one's, filled with all of the texture."""
    assert isinstance(scene.volume, Volume)
    sizes = np.array(scene.volume.size)
    scale = sizes / (sizes - 1)
    matrix = np.diag([*scale, 1.0])
    matrix[:3, 3] = 0.5 - 0.5 * scale
    return _placed(job, matrix)


def _unturned(job: Job, scene: Scene, _: float) -> Job:
    """A box along the axes of the world, from the same first voxel."""
    volume = scene.volume
    assert isinstance(volume, Volume)
    straight = np.eye(4)
    straight[:3, :3] = np.diag(volume.spacing)
    straight[:3, 3] = volume.origin
    texture_from_index = np.diag([*(1 / np.array(volume.size)), 1.0])
    texture_from_index[:3, 3] = 0.5 / np.array(volume.size)
    right = box_of(scene).world_from_texture
    return _placed(job, texture_from_index @ np.linalg.inv(straight) @ right)


def _blended_twice(job: Job, _: Scene, __: float) -> Job:
    """Premultiplied colours, blended as if they were straight."""
    straight = ("src_alpha", "one_minus_src_alpha", "src_alpha", "one_minus_src_alpha")
    return with_passes(
        job, lambda one: replace(one, blend=straight) if one.target == IMAGE and one.blend else one
    )


def _premultiplied(values: np.ndarray, _: float) -> np.ndarray:
    """As UNPACK_PREMULTIPLY_ALPHA_WEBGL leaves texels."""
    opacities = values[..., 3:]
    if values.dtype == np.uint8:
        colors = np.rint(values[..., :3] * (opacities / 255)).astype(np.uint8)
    else:
        colors = values[..., :3] * opacities
    return np.concatenate([colors, opacities], axis=-1)


def _squared(values: np.ndarray, _: float) -> np.ndarray:
    """Values that are in colour and alpha of an image, premultiplied."""
    return np.rint(values * (values / 255)).astype(np.uint8)


def _short(table: np.ndarray, entries: float) -> np.ndarray:
    """Of a table (rows, n, 4), so many entries, read where their centres are."""
    n = table.shape[1]
    at = (np.arange(int(entries)) + 0.5) / entries * n - 0.5
    knots = np.arange(n)
    rows = [[np.interp(at, knots, channel) for channel in row.T] for row in table.astype(float)]
    taken = np.moveaxis(np.array(rows), 1, -1)
    return np.rint(taken).astype(np.uint8) if table.dtype == np.uint8 else taken.astype(table.dtype)


def _quantised(table: np.ndarray, bits: float) -> np.ndarray:
    """Entries of so many bits."""
    codes = 2**bits - 1
    return np.rint(np.rint(table / 255 * codes) / codes * 255).astype(np.uint8)


def _classified(job: Job, _: Scene, __: float) -> Job:
    """A volume of colours and opacities: each voxel's value in the table."""
    if "volume" not in job.textures or np.ndim(job.textures["volume"].values) != 3:
        return job
    table = np.asarray(job.textures["table"].values)[0]

    def change(one: Texture) -> Texture:
        places = np.asarray(one.values) / 255 * len(table) - 0.5
        channels = [np.interp(places, np.arange(len(table)), channel) for channel in table.T]
        return replace(one, values=np.rint(np.stack(channels, axis=-1)).astype(np.uint8), format="rgba8")

    return with_textures(job, ("volume",), change)


# What is wrong in the page and not in a shader.
PAGE: Mapping[str, Page] = {
    "G4-flip-x": with_values(VOLUMES, lambda values, _: np.flip(values, 2)),
    "G4-flip-y": with_values(VOLUMES, lambda values, _: np.flip(values, 1)),
    "G4-flip-z": with_values(VOLUMES, lambda values, _: np.flip(values, 0)),
    "G4-swapped-axes": with_values(VOLUMES, lambda values, _: np.swapaxes(values, 1, 2)),
    "G1-moved-box": _moved,
    "G2-node-box": _narrower,
    "G5-transform-ignored": _unturned,
    "O5-premultiplied-twice": with_values(TABLES, _premultiplied),
    "T1-early-stop": _stop_at,
    "T1-never-reached": lambda job, scene, _: _stop_at(job, scene, 2.0),
    "J1-biased-jitter": _biased,
    "J1-wood-grain": with_values(("jitter",), lambda values, _: np.zeros_like(values)),
    "L2-short-table": with_values(TABLES, _short),
    "L2-quantised-table": with_values(TABLES, _quantised),
    "L3-pre-classified": _classified,
    "F1-nearest": _nearest,
    "F2-half-float": _uploaded_as("r16f"),
    "F2-eight-bit": _uploaded_as("r8"),
    "F3-srgb-upload": _as_srgb,
    "F3-premultiplied-upload": with_values(VOLUMES, _squared),
    "F4-no-data": _hole_as,
    "B1-blended-twice": _blended_twice,
}
