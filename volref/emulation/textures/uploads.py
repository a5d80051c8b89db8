"""What a program hands to the GPU before it draws: the volume and the table as textures.

Arrays are as they are uploaded: codes (uint8) or floats, row 0 at v = 0.  An atlas with 2 tiles across, the
first tile at v0 (left) and at v1 (right):

    v = 1 +---+---+      v = 1 +---+---+
          | 2 | 3 |            | 0 | 1 |      slice s lies in column s mod 2
          +---+---+            +---+---+
          | 0 | 1 |            | 2 | 3 |
    v = 0 +---+---+      v = 0 +---+---+
"""

import math
from dataclasses import dataclass

import numpy as np

from volref.arrays import Floats, Numbers
from volref.emulation.device import Device
from volref.emulation.groups import TableTexture, VolumeTexture
from volref.emulation.pipeline import Pipeline
from volref.emulation.textures.gradient_volume import SOBEL_GAIN, has_gradient_volume, with_gradient
from volref.emulation.textures.radar_image import PolarGrid, polar_grid, polar_image
from volref.formats import codes_of, decoded, stored
from volref.image import decode_srgb, encode_srgb
from volref.scene.radar import RadarVolume
from volref.scene.scene import Scene
from volref.scene.transfer import TransferFunction
from volref.scene.transfer2d import TransferFunction2D
from volref.scene.volume import Volume
from volref.stages.classify import classify, lookup_table, segment_opacity
from volref.stages.lookup2d import gradient_factor, lookup_2d
from volref.stages.textures import Texture, fetch
from volref.workspace import Workspace

# Rows of the canvas on which seed 002 draws its table.
CANVAS_ROWS = 20


@dataclass(frozen=True, eq=False)
class Uploads:
    """The textures of a program, as it uploads them.

    volume: (D, H, W, C) of a 3-D texture, or (H, W, C) of an atlas.  table: straight (rows, n, 4), colours
    encoded where the texture decodes them.  domain: the values that 0 and 1 stand for.  size: voxels
    (nx, ny, nz), of a radar radials, gates and sweeps.  tiles: (across, down) of an atlas.  grid: where the
    texels of a radar lie.
    """

    volume: Numbers
    table: Numbers
    domain: tuple[float, float]
    size: tuple[int, int, int]
    tiles: tuple[int, int]
    grid: PolarGrid | None = None


def uploads_of(scene: Scene, pipeline: Pipeline) -> Uploads:
    """Return what the program uploads for a scene with a volume."""
    assert scene.volume is not None
    assert scene.transfer is not None
    domain = domain_of(scene, pipeline)
    entries = baked_table(scene, pipeline, domain)
    if pipeline.table.premultiplied:
        entries[..., :3] *= entries[..., 3:]
    if pipeline.table.srgb:
        entries[..., :3] = encode_srgb(entries[..., :3])
    table = _table(entries, pipeline.table)
    values, size, grid = _values_of(scene.volume, pipeline)
    unit = (values - domain[0]) / (domain[1] - domain[0])
    channels = unit[..., None]
    if pipeline.table.order == "pre":
        texture = Texture(
            np.asarray(_as_fetched(table, pipeline.table, Device(), np.float64)), pipeline.table.filter
        )
        place = table_place(pipeline.table, unit.reshape(-1))
        found = fetch(texture, (place, np.full_like(place, 0.5)), Workspace())
        channels = np.moveaxis(found, 0, -1).reshape(*unit.shape, 4)
    tiles = tiles_of(pipeline.volume, len(unit))
    texels = _texels(channels, pipeline.volume.format)
    if has_gradient_volume(pipeline.lighting):
        texels = with_gradient(texels, pipeline.lighting, pipeline.volume.format)
    if pipeline.volume.layout == "atlas":
        texels = atlas_of(texels, pipeline.volume, tiles)
    return Uploads(texels, table, domain, size, tiles, grid)


def _values_of(
    volume: Volume | RadarVolume, pipeline: Pipeline
) -> tuple[Floats, tuple[int, int, int], PolarGrid | None]:
    """Return the values (nz, ny, nx) to upload, their numbers along x, y and z, and the grid of a radar.

    They are float64 from the start: the difference of two codes of a narrow type may not fit it.  Gates
    without data are uploaded as the least of all values, for a byte has no other.
    """
    if isinstance(volume, Volume):
        return volume.values.astype(np.float64), volume.size, None
    grid = polar_grid(volume)
    values = polar_image(volume, grid, pipeline.volume.seam)
    low = volume.value_bounds[0] if pipeline.domain is None else pipeline.domain[0]
    values = np.where(np.isnan(values), low, values)
    return values, (grid.columns, grid.gates, len(grid.tilts)), grid


def domain_of(scene: Scene, pipeline: Pipeline) -> tuple[float, float]:
    """Return the values that the textures hold as 0 and 1.

    The pipeline's; else those of the outer knots of the transfer function, where they differ; else the least
    and the greatest of the volume; where it has one value only, that and 1 more, or the next float64.
    """
    if pipeline.domain is not None:
        return pipeline.domain
    if isinstance(scene.transfer, TransferFunction2D):
        return scene.transfer.value_domain
    assert isinstance(scene.transfer, TransferFunction)
    assert scene.volume is not None
    for low, high in ((scene.transfer.values[0], scene.transfer.values[-1]), scene.volume.value_bounds):
        if low < high:
            return float(low), float(high)
    return float(low), float(max(low + 1.0, np.nextafter(low, np.inf)))


def baked_table(scene: Scene, pipeline: Pipeline, domain: tuple[float, float]) -> Floats:
    """Return the transfer function as entries (rows, n, 4): straight colour, opacity of a unit distance.

    Of a function of the value alone all rows are equal.
    """
    table, transfer = pipeline.table, scene.transfer
    along = domain[0] + (domain[1] - domain[0]) * baked_at(table)
    up = (np.arange(table.rows) + 0.5) / table.rows * steepest(scene, table, domain)
    magnitudes = np.repeat(up, table.size)
    if isinstance(transfer, TransferFunction2D):
        colors, opacity = lookup_2d(transfer, np.tile(along, table.rows), magnitudes)
    else:
        assert transfer is not None
        work = Workspace()
        row, strength = classify(lookup_table(transfer, domain), along, work)
        if transfer.interpolation == "extinction":
            strength = segment_opacity(transfer, strength, transfer.unit_distance)
        colors = np.tile(row, table.rows)
        opacity = np.tile(strength, table.rows) * gradient_factor(transfer, magnitudes)
    entries = np.concatenate([colors, opacity[None]]).T.reshape(table.rows, table.size, 4)
    if table.last_column == "empty":
        entries[:, -1] = 0.0
    return np.ascontiguousarray(entries)


def steepest(scene: Scene, table: TableTexture, domain: tuple[float, float]) -> float:
    """Return the magnitude, in value units per world unit, that v = 1 of a table stands for.

    The table's own; else that of |g| = 1 in a gradient volume: a field that grows by 27 / 32 of the domain
    per voxel, of mean spacing.  A radar has neither: its table has one row, where any will do.

    Examples
    --------
    >>> import volref as vr
    >>> transfer = vr.TransferFunction([0, 64], [(1, 1, 1)] * 2, [0, 1])
    >>> camera = vr.Camera.look_at((0, 0, 9), (0, 0, 0), (0, 1, 0), 30, 1, 20)
    >>> volume = vr.Volume(np.zeros((4, 4, 4)), spacing=(1, 2, 3))
    >>> steepest(vr.Scene(volume, transfer, camera, 1, 1), TableTexture(rows=4), (0, 64))
    27.0
    """
    if table.steepest is not None:
        return table.steepest
    if not isinstance(scene.volume, Volume):
        return domain[1] - domain[0]
    return (domain[1] - domain[0]) / SOBEL_GAIN / float(np.mean(scene.volume.spacing))


def baked_at(table: TableTexture) -> Floats:
    """Return the shares (n,) of the domain that the entries along the value stand for.

    A canvas's gradient runs from corner (0, 0) to (n - 1, 19); a pixel has the share of its centre's foot on
    that line.

    Examples
    --------
    >>> baked_at(TableTexture(size=4)).tolist(), baked_at(TableTexture(size=3, baked="ends")).tolist()
    ([0.125, 0.375, 0.625, 0.875], [0.0, 0.5, 1.0])
    """
    n = table.size
    if table.baked == "ends":
        return np.arange(n) / (n - 1)
    if table.baked == "canvas":
        along, down = n - 1, CANVAS_ROWS - 1
        return ((np.arange(n) + 0.5) * along + 0.5 * down) / (along**2 + down**2)
    return (np.arange(n) + 0.5) / n


def tiles_of(volume: VolumeTexture, slices: int) -> tuple[int, int]:
    """Return how many tiles an atlas has across and down.

    Examples
    --------
    >>> tiles_of(VolumeTexture(), 10), tiles_of(VolumeTexture(tiles_across=2), 5)
    ((4, 3), (2, 3))
    """
    across = volume.tiles_across or math.isqrt(slices - 1) + 1
    return across, -(-slices // across)


def atlas_of(slices: Numbers, volume: VolumeTexture, tiles: tuple[int, int]) -> Numbers:
    """Return slices (nz, ny, nx, C) as an atlas (H, W, C); tiles without a slice are 0."""
    across, down = tiles
    pad = ((0, 0), (volume.padding,) * 2, (volume.padding,) * 2, (0, 0))
    padded = np.pad(slices, pad, mode="edge")
    if volume.rows == "against-v":
        padded = padded[:, ::-1]
    count, height, width, channels = padded.shape
    grid = np.zeros((down, across, height, width, channels), padded.dtype)
    grid.reshape(-1, height, width, channels)[:count] = padded
    if volume.first_tile == "v1":
        grid = grid[::-1]
    return np.ascontiguousarray(grid.swapaxes(1, 2)).reshape(down * height, across * width, channels)


def volume_texture(uploads: Uploads, pipeline: Pipeline, device: Device) -> Texture:
    """Return the volume's texture as a device samples it."""
    texels = decoded_or(uploads.volume, device.values_type)
    return _texture(texels, pipeline.volume.filter, device, narrow=uploads.volume.dtype == np.uint8)


def table_texture(uploads: Uploads, pipeline: Pipeline, device: Device) -> Texture:
    """Return the table's texture as a device samples it, without mip levels."""
    texels = _as_fetched(uploads.table, pipeline.table, device, device.values_type)
    kind = "nearest" if pipeline.table.filter == "nearest" else "linear"
    return _texture(texels, kind, device, narrow=uploads.table.dtype == np.uint8 and not pipeline.table.srgb)


def _texture(texels: Floats, kind: str, device: Device, *, narrow: bool) -> Texture:
    if not narrow:
        return Texture(texels, kind)
    return Texture(
        texels,
        kind,
        weight_bits=device.weight_bits,
        result_bits=device.result_bits,
        nearest_bits=device.nearest_bits,
    )


def table_place(table: TableTexture, values: Floats) -> Floats:
    """Return where values of 0..1 are looked up, in their own type.

    A table of n texels holds entry k at (k + 1/2) / n: looked up "direct", 0 and 1 lie half a texel outside
    the outer entries; "centered", upon them.

    Examples
    --------
    >>> table_place(TableTexture(size=4, coordinate="centered"), np.array([0.0, 1.0])).tolist()
    [0.125, 0.875]
    """
    if table.shift:
        values = values + values.dtype.type(table.shift / table.size)
    if table.coordinate == "direct":
        return values
    kind = values.dtype.type
    return np.asarray((values * kind(table.size - 1) + kind(0.5)) / kind(table.size))


def decoded_or(texels: Numbers, kind: np.typing.DTypeLike) -> Floats:
    """Return texels as numbers of a type: codes decoded, floats as they are."""
    return decoded(texels, kind) if texels.dtype.kind == "u" else texels.astype(kind, copy=False)


def _as_fetched(table: Numbers, switches: TableTexture, device: Device, kind: np.typing.DTypeLike) -> Floats:
    """Return a table's texels (1 or more rows, n, 4) as a fetch gives them."""
    texels = decoded_or(table, kind)
    if switches.srgb:
        texels = texels.copy()
        codes = texels[..., :3].astype(np.float64)
        texels[..., :3] = (decode_srgb if device.srgb == "curve" else mesa_srgb)(codes)
    return texels


def mesa_srgb(codes: Floats) -> Floats:
    """Return the light that Mesa makes of sRGB codes 0..1 (lp_bld_format_srgb.c): a line, then a cubic.

    Examples
    --------
    >>> codes = np.array([0.5, 1.0])
    >>> mesa_srgb(codes).round(4).tolist(), decode_srgb(codes).round(4).tolist()
    ([0.2148, 1.0], [0.214, 1.0])
    """
    cubic = 0.0023 + codes * (0.0030 + codes * (0.6935 + codes * 0.3012))
    return np.where(codes <= 15 / 255, codes / 12.6, cubic)


def _table(entries: Floats, table: TableTexture) -> Numbers:
    """Return a table's entries as they are uploaded: numbers where colours and opacities are two textures."""
    if table.opacity_format is None:
        return _as_uploaded(entries, table.format)
    colors, opacities = stored(entries[..., :3], table.format), stored(entries[..., 3:], table.opacity_format)
    return np.concatenate([colors, opacities], axis=-1)


def _as_uploaded(entries: Floats, kind: str) -> Numbers:
    return codes_of(entries, 8) if kind == "unorm8" else stored(entries, kind)


def _texels(channels: Floats, kind: str) -> Numbers:
    """Return channels (nz, ny, nx, C) as texels; 16 bits in two channels: first the high byte."""
    if kind != "unorm16-split":
        return _as_uploaded(channels, kind)
    codes = codes_of(channels, 16)
    return np.concatenate([codes >> 8, codes & 255], axis=-1).astype(np.uint8)
