"""Every number of one ray of a program: what `trace` returns for a pipeline.

The passes before the last are those of the whole image.  The loop is the image's own, walked for one ray
with an observer, so the last row leads to the very pixel of the canvas.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import Floats, Indices, Numbers, whole_number
from volref.emulation.catalogue import named
from volref.emulation.device import Device
from volref.emulation.drawing import Drawing, prepare
from volref.emulation.frames import lanes_of_rays, last_targets, march_frame
from volref.emulation.loop.endings import quad_of, why_ended
from volref.emulation.loop.marching import Program, Sample, march
from volref.emulation.loop.offsets import start_offsets
from volref.emulation.pipeline import Pipeline
from volref.emulation.targets.canvas import cleared, fragment_colors
from volref.emulation.textures.lookup import Textures, look_up
from volref.emulation.textures.slices import slice_pair
from volref.emulation.textures.spherical import sweep_pair
from volref.emulation.textures.uploads import table_place
from volref.formats import codes_of
from volref.scene.scene import Scene
from volref.stages.textures import footprint
from volref.traces import Column, Trace, checked_pixel, plain
from volref.workspace import Workspace

# What a row of the table holds.
COLUMNS = {
    "frame": Column(1, "number of the frame, from 1"),
    "iteration": Column(1, "number of the iteration in its frame, from 0"),
    "position": Column(3, "place of the sample in texture space, 0..1 edge to edge"),
    "step_share": Column(1, "share of a whole step that the sample stands for"),
    "slices": Column(2, "the two slices of an atlas, s1 and s2"),
    "slice_share": Column(1, "weight of the second slice"),
    "seen": Column(1, "whether the radar has seen it; elsewhere the value is 0"),
    "slice_uv": Column(4, "where the two slices are looked up: u1, v1, u2, v2"),
    "texels": Column(0, "texels that the fetch mixes, as x, y(, z); of an atlas for each slice", shown=False),
    "texel_weights": Column(0, "their weights in the filter", shown=False),
    "texel_values": Column(0, "their channels", shown=False),
    "value": Column(1, "the value, 0..1 of the domain"),
    "gradient": Column(3, "the gradient that the texture holds"),
    "table_uv": Column(2, "where the table is looked up: by the value, and by the gradient or in the middle"),
    "slice_values": Column(2, "the values of the two slices, each of which is looked up in the table"),
    "color": Column(4, "what the table gives: straight colour and alpha"),
    "lit": Column(3, "the colour after light"),
    "opacity": Column(1, "opacity of the sample, after the rule for the step"),
    "accumulated": Column(4, "colour and alpha of the ray after the sample"),
}

MISSED = "no ray: the box is missed"
LEFT = "its exit has x and y of 0: left without a ray"


def trace_program(
    scene: Scene,
    pixel: Sequence[int],
    pipeline: str | Pipeline,
    device: str | Device | None = None,
    jitter: ArrayLike | None = None,
    frames: int = 1,
) -> Trace:
    """Return every iteration of a program's loop at `pixel` (x, y), row 0 at the top; arguments as `emulate`.

    Raises
    ------
    SceneError
        If the pixel lies outside the image, or `emulate` refuses the scene or an argument.

    Examples
    --------
    >>> import volref as vr
    >>> volume = vr.Volume(np.full((4, 4, 4), 255, np.uint8))
    >>> transfer = vr.TransferFunction.from_opacity([0, 255], [(1, 1, 1)] * 2, [0, 0.5])
    >>> camera = vr.Camera.look_at((1.5, 1.5, 9), (1.5, 1.5, 1.5), (0, 1, 0), 30, 1, 20)
    >>> found = trace_program(vr.Scene(volume, transfer, camera, 3, 3), (1, 1), "texture3d")
    >>> found.head["ended"], found.head["rgba8"]
    ('the length 4 is walked in steps of 0.5, after 8 samples', [239, 239, 239, 239])
    >>> found.table["accumulated"][:2, 3].round(3).tolist()  # 1 - sqrt(128 / 255), 127 / 255
    [0.292, 0.498]
    """
    x, y = checked_pixel(pixel, scene.width, scene.height)
    program = named(pipeline) if isinstance(pipeline, str) else pipeline
    machine = Device.named(device) if isinstance(device, str) else device or Device()
    count = whole_number("frames", frames, low=1, high=1 << 20)
    offsets = start_offsets(scene, program, jitter, count)
    drawing, flat = prepare(scene, program, machine), y * scene.width + x
    head: dict[str, Any] = {"pixel": [x, y], "pipeline": program.name, "device": machine.name}
    here = np.flatnonzero(drawing.ends.pixel == flat)
    # Walked with its neighbours where the table has mip levels; the observer sees lanes then.
    lanes, lane = (drawing, here) if not drawing.textures.levels else _lane(drawing, here)
    mean, rows = cleared(scene, program.output, machine), []
    for number, offset in enumerate(offsets, start=1):
        seen = _Seen(number, lane)
        marched = march_frame(drawing, offset, seen.look, here)
        rows += seen.rows[: int(marched.samples[here].sum())]
        last, mean = last_targets(drawing, marched, number, mean)
    head |= {"targets": _at(dict(drawing.targets) | last, flat, scene)}
    if len(here):
        head |= _ray(lanes, lanes.program(offset), int(lane[0]))
        fragment = fragment_colors(marched, program.accumulation)[here[0]]
        head |= {"fragment": plain(fragment)}
    else:
        blank = flat in drawing.ends.blank
        head |= {"ended": LEFT if blank else MISSED}
    canvas = last["canvas"].reshape(-1, 4)[flat]
    nan = 1.0 if machine.nan_stored == "one" else 0.0
    head |= {"rgba": plain(canvas), "rgba8": codes_of(canvas, 8, nan=nan).tolist()}
    return Trace(head, _table(drawing, rows, count) if rows else {}, COLUMNS, "iterations")


def _lane(drawing: Drawing, here: Indices) -> tuple[Drawing, Indices]:
    lanes, lane_of = lanes_of_rays(drawing)
    return lanes, lane_of[here]


class _Seen:
    """An observer that keeps what it sees of one ray in one frame; the loop goes on to change its arrays."""

    def __init__(self, frame: int, ray: Indices) -> None:
        self.frame = frame
        self.ray = ray
        self.rows: list[dict[str, Numbers]] = []

    def look(self, sample: Sample) -> None:
        """Keep one iteration."""
        found, at = sample.found, int(np.flatnonzero(sample.ray == self.ray)[0])
        row = {"frame": np.array(self.frame), "iteration": np.array(sample.number)}
        row |= {"position": sample.position[:, at].copy(), "value": found.value[at].copy()}
        row |= {"found": found.color[:, at].copy(), "opacity": sample.opacity[at].copy()}
        row["accumulated"] = np.append(sample.color[:, at], sample.alpha[at])
        if sample.share is not None:
            row["step_share"] = sample.share[at].copy()
        if found.gradient is not None:
            row["gradient"] = found.gradient[:, at].copy()
        if found.magnitude is not None:
            row["magnitude"] = found.magnitude[at].copy()
        self.rows.append(row)


def _at(targets: dict[str, Floats], flat: int, scene: Scene) -> dict[str, Any]:
    """Return what 2-D targets hold at a pixel."""
    size = scene.width * scene.height
    return {
        name: plain(target.reshape(size, -1)[flat])
        for name, target in targets.items()
        if target.ndim == 2 or target.shape[:2] == (scene.height, scene.width)
    }


def _ray(drawing: Drawing, loop: Program, ray: int) -> dict[str, Any]:
    """Return what there is one of along a ray."""
    paths, cut = drawing.paths, drawing.cut
    marched = march(loop, rays=quad_of(loop, ray))
    found: dict[str, Any] = {"entry": plain(paths.entry[:, ray]), "exit": plain(paths.exit[:, ray])}
    found |= {"step": plain(paths.delta[:, ray]), "steps": int(paths.count[ray])}
    lengths = {"texture": paths.texture_step[ray], "world": paths.world_step[ray]}
    found["step_length"] = {name: _plain(length) for name, length in lengths.items()}
    found["start"] = _plain(loop.offset[ray])
    if cut is not None:
        depths = {"entry": cut.depth[ray], "step": cut.step[ray], "surface": cut.surface[ray]}
        found["depth"] = {name: _plain(depth) for name, depth in depths.items()}
    return found | {"samples": int(marched.samples[ray]), "ended": why_ended(loop, marched, ray)}


def _plain(number: np.floating[Any]) -> float | None:
    return float(number) if np.isfinite(number) else None


def _table(drawing: Drawing, rows: list[dict[str, Numbers]], frames: int) -> dict[str, Numbers]:
    columns = {name: np.stack([row[name] for row in rows]) for name in rows[0]}
    textures, position = drawing.textures, np.ascontiguousarray(columns["position"].T)
    table = textures.pipeline.table
    with np.errstate(invalid="ignore"):
        columns |= _fetched(textures, position)
        if table.order == "post":
            beside = columns.get("magnitude", np.full_like(columns["value"], 0.5))
            columns["table_uv"] = np.stack([table_place(table, columns["value"]), beside], axis=-1)
        columns["color"] = columns["found"]
        if drawing.shade is not None:
            columns["color"] = look_up(textures, position, Workspace()).color.T
            columns["lit"] = columns["found"][:, :3]
    if frames == 1:
        del columns["frame"]
    return {name: columns[name] for name in COLUMNS if name in columns}


def _fetched(textures: Textures, position: Floats) -> dict[str, Numbers]:
    """Return the columns that say how the values at positions (3, S) came about."""
    volume = textures.pipeline.volume
    if textures.grid is None and volume.layout == "3d":
        found = footprint(textures.volume, position)
        return {"texels": found.texel, "texel_weights": found.weight, "texel_values": found.value}
    columns: dict[str, Numbers] = {}
    if textures.grid is None:
        pair = slice_pair(volume, textures.size, textures.tiles, position)
    else:
        pair, columns["seen"] = sweep_pair(volume, textures.grid, position, textures.device)
    both = footprint(textures.volume, (pair.u1, pair.v1)), footprint(textures.volume, (pair.u2, pair.v2))
    columns |= {
        "slices": np.stack([pair.first, pair.second], axis=-1),
        "slice_share": pair.share,
        "slice_uv": np.stack(pair[3:], axis=-1),
        "texels": np.stack([one.texel for one in both], axis=1),
        "texel_weights": np.stack([one.weight for one in both], axis=1),
        "texel_values": np.stack([one.value for one in both], axis=1),
    }
    if textures.pipeline.table.order == "per-slice":
        mixed = [(one.weight[..., None] * one.value).sum(axis=1)[:, 0] for one in both]
        columns["slice_values"] = np.stack(mixed, axis=-1)
    return columns
