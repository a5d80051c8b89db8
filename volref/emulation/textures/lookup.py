"""From positions in the box to colours and opacities: the textures of a program, sampled.

n points; positions are (3, n), values (n,), colours (4, n): straight red, green, blue, and the table's alpha.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from volref.arrays import Floats
from volref.emulation.device import Device
from volref.emulation.groups import VolumeTexture
from volref.emulation.pipeline import Pipeline
from volref.emulation.textures.gradient_volume import has_gradient_volume, unpacked
from volref.emulation.textures.mipmaps import classified_in_quads, levels_of
from volref.emulation.textures.radar_image import PolarGrid
from volref.emulation.textures.slices import SlicePair, slice_pair
from volref.emulation.textures.spherical import sweep_pair
from volref.emulation.textures.uploads import Uploads, table_place, table_texture, volume_texture
from volref.stages.textures import Texture, fetch, fetch_slices
from volref.workspace import Workspace


class Found(NamedTuple):
    """What samples have found: values (n,), colours (4, n), and gradients (3, n) with their lengths (n,).

    Gradients are those of a gradient volume: minus the gradient per voxel, see there.
    """

    value: Floats
    color: Floats
    gradient: Floats | None = None
    magnitude: Floats | None = None


@dataclass(frozen=True, eq=False)
class Textures:
    """The textures of a program on a device, and how it samples them."""

    pipeline: Pipeline
    device: Device
    volume: Texture
    table: Texture
    size: tuple[int, int, int]
    tiles: tuple[int, int]
    grid: PolarGrid | None = None
    levels: tuple[Texture, ...] = ()


def textures_of(uploads: Uploads, pipeline: Pipeline, device: Device) -> Textures:
    """Return the textures of a program as a device samples them."""
    volume, table = (make(uploads, pipeline, device) for make in (volume_texture, table_texture))
    levels: tuple[Texture, ...] = ()
    if pipeline.table.filter == "linear-mipmap":
        levels = levels_of(table, narrow=uploads.table.dtype == np.uint8)
    return Textures(pipeline, device, volume, table, uploads.size, uploads.tiles, uploads.grid, levels)


def look_up(textures: Textures, position: Floats, work: Workspace) -> Found:
    """Return what the program finds at positions."""
    order = textures.pipeline.table.order
    if textures.grid is not None:
        return _between_sweeps(textures, textures.grid, position, work)
    position = read_at(textures.pipeline.volume, textures.size, position)
    if textures.pipeline.volume.layout == "3d":
        found = fetch(textures.volume, position, work)
        if order == "pre":
            return Found(found[3], found)
        value = _value_of(textures, found)
        if has_gradient_volume(textures.pipeline.lighting):
            gradient, magnitude = unpacked(found[1:], textures.pipeline.lighting)
            return Found(value, classified(textures, value, work, magnitude), gradient, magnitude)
        return Found(value, classified(textures, value, work))
    pair = slice_pair(textures.pipeline.volume, textures.size, textures.tiles, position)
    if order == "per-slice":
        return _per_slice(textures, pair, work)
    if order == "pre" or textures.volume.texels.shape[-1] > 1:
        one = fetch(textures.volume, (pair.u1, pair.v1), work)
        two = fetch(textures.volume, (pair.u2, pair.v2), work)
        if order == "pre":
            color = _between(textures, one, two, pair)
            return Found(color[3], color)
        value = _between(textures, _value_of(textures, one), _value_of(textures, two), pair)
    else:
        value = _between(textures, *fetch_slices(textures.volume, *pair[3:], work), pair)
    return Found(value, classified(textures, value, work))


def read_at(switches: VolumeTexture, size: tuple[int, int, int], position: Floats) -> Floats:
    """Return where in the texture a program reads for positions (3, n) in the box.

    Examples
    --------
    Bricks of 2 voxels out of 4: at the border between them, the voxel on the other side is not seen.

    >>> border = np.full((3, 1), 0.501)
    >>> read_at(VolumeTexture(brick=2), (4, 4, 4), border).ravel().tolist()
    [0.625, 0.625, 0.625]
    """
    if switches.reach == "faces" and not switches.shift and switches.brick is None:
        return position
    kind, count = position.dtype.type, np.array(size, position.dtype)[:, None]
    if switches.reach == "centers":
        position = (position * (count - kind(1)) + kind(0.5)) / count
    if switches.shift:
        position = position + kind(switches.shift) / count
    if switches.brick is not None:
        side, voxel = kind(switches.brick), position * count
        first = np.clip(np.floor(voxel / side) * side, kind(0), count - kind(1))
        last = np.minimum(first + side, count)
        position = np.clip(voxel, first + kind(0.5), last - kind(0.5)) / count
    return position


def classified(textures: Textures, value: Floats, work: Workspace, magnitude: Floats | None = None) -> Floats:
    """Return the table's colour (4, n) of values (n,), and of |g| (n,) as its v; without it v is 1/2."""
    place = table_place(textures.pipeline.table, value)
    if textures.levels:
        return classified_in_quads(textures.levels, place, textures.device, work)
    if magnitude is not None:
        return fetch(textures.table, (place, magnitude), work)
    half = work.get("half", len(place), place.dtype)
    half.fill(0.5)
    return fetch(textures.table, (place, half), work)


def _value_of(textures: Textures, channels: Floats) -> Floats:
    """Return the value (n,) that fetched channels stand for."""
    if textures.pipeline.volume.format != "unorm16-split":
        return np.asarray(channels[0])
    high, low = channels
    kind = channels.dtype.type
    return np.asarray(high * kind(65280 / 65535) + low * kind(255 / 65535))


def _per_slice(textures: Textures, pair: SlicePair, work: Workspace) -> Found:
    places = (pair.u1, pair.v1), (pair.u2, pair.v2)
    values = [_value_of(textures, fetch(textures.volume, place, work)) for place in places]
    one = classified(textures, values[0], work)
    two = classified(textures, values[1], work)
    return Found(_between(textures, values[0], values[1], pair), _between(textures, one, two, pair))


def _between_sweeps(textures: Textures, grid: PolarGrid, position: Floats, work: Workspace) -> Found:
    pair, seen = sweep_pair(textures.pipeline.volume, grid, position, textures.device)
    values = fetch_slices(textures.volume, *pair[3:], work)
    mixed = _between(textures, *values, pair)
    value = np.where(seen, mixed, mixed.dtype.type(0))
    return Found(value, classified(textures, value, work))


def _between(textures: Textures, one: Floats, two: Floats, pair: SlicePair) -> Floats:
    """Return mix(one, two, share) as the device computes it."""
    if textures.pipeline.volume.between == "none":
        return one
    share = pair.share.astype(one.dtype, copy=False)
    return mix(textures.device, one, two, share)


def mix(device: Device, x: Floats, y: Floats, share: Floats) -> Floats:
    """Return GLSL's mix(x, y, share) as the device computes it."""
    if device.mix == "sum":
        return np.asarray(x * (1 - share) + y * share)
    return np.asarray(x + (y - x) * share)
