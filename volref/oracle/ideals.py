"""What makes a program's image differ from an ideal one, source by source, and the program without it."""

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

from volref.emulation.device import Device
from volref.emulation.limit import refined
from volref.emulation.pipeline import Pipeline
from volref.emulation.rays.paths import world_step_of
from volref.emulation.textures.uploads import domain_of
from volref.errors import SceneError
from volref.scene.scene import Scene

# How many times finer a step is, and how many entries a table has, that count as ideal.
FINER, ENTRIES = 8, 1 << 12

BITS = {"unorm8": "8 bits", "unorm16": "16 bits", "unorm16-split": "twice 8 bits", "half": "16-bit floats"}


class Drawn(NamedTuple):
    """What is drawn: a scene with a program on a machine."""

    scene: Scene
    pipeline: Pipeline
    device: Device


@dataclass(frozen=True)
class Cause:
    """A source of differences.

    now: what it is in what is drawn, "" where there is none.  without: what is drawn where it is ideal.
    needs: sources without which it would make no difference.
    """

    name: str
    now: Callable[[Drawn], str]
    without: Callable[[Drawn], Drawn]
    needs: tuple[str, ...] = ()


def machine_of(device: Device) -> Device:
    """Return a machine of a set: float32, with a filter and a grid as coarse as the set allows.

    Examples
    --------
    >>> machine = machine_of(Device.named("webgl-highp"))
    >>> machine.values, machine.weight_bits, machine.subpixel_bits
    ('float32', 8, 8)
    """
    changes: dict[str, Any] = {}
    if device.freedom != "none" and device.values == "float64":
        changes["values"] = "float32"
    for slack, bits in (("weight_slack", "weight_bits"), ("snap_slack", "subpixel_bits")):
        off = getattr(device, slack)
        if off and getattr(device, bits) is None:
            changes[bits] = max(1, round(-math.log2(2 * off)))
    return dataclasses.replace(device, **changes)


def _switched(**groups: dict[str, Any]) -> Callable[[Drawn], Drawn]:
    return lambda drawn: drawn._replace(pipeline=drawn.pipeline.with_switches(None, **groups))


def _on(**switches: str | int | None) -> Callable[[Drawn], Drawn]:
    changes: dict[str, Any] = dict(switches)
    return lambda drawn: drawn._replace(device=dataclasses.replace(drawn.device, **changes))


def _finer(drawn: Drawn) -> Drawn:
    """Return a step `FINER` times shorter, its opacity corrected, with the same early end."""
    before = drawn.pipeline
    pipeline = refined(drawn.scene, before, FINER)
    stepping: dict[str, Any] = {"opaque_at": before.stepping.opaque_at}
    if before.stepping.rule == "voxel-count":
        stepping["length"] = (before.stepping.length or 1.0) / FINER
    return drawn._replace(pipeline=pipeline.with_switches(stepping=stepping))


def _step(drawn: Drawn) -> str:
    stepping = drawn.pipeline.stepping
    if stepping.rule == "count":
        return f"{stepping.steps} steps"
    if stepping.rule == "world-length":
        return f"{world_step_of(stepping, drawn.scene):g} in the world"
    if stepping.rule == "voxel-count":
        return f"{stepping.length or 1.0:g} of a voxel"
    return f"{stepping.length or 1.0 / stepping.steps:g} in texture space"


def _floats_in_table(drawn: Drawn) -> Drawn:
    own = None if drawn.pipeline.table.opacity_format is None else "float"
    return _switched(table={"format": "float", "opacity_format": own})(drawn)


def _filter(drawn: Drawn) -> str:
    device = drawn.device
    words = []
    if device.weight_bits is not None:
        words.append(f"weights of {device.weight_bits} bit{'s' * (device.weight_bits > 1)}")
    if device.result_bits is not None:
        words.append(f"results of {device.result_bits} bits")
    return " and ".join(words)


def _arithmetic(drawn: Drawn) -> str:
    kinds = {drawn.device.values, drawn.device.control}
    return " and ".join(sorted(kinds)) if kinds != {"float64"} else ""


def _canvas(drawn: Drawn) -> str:
    output = drawn.pipeline.output
    kinds = [output.format] + [output.mean_format] * (output.mean_format is not None)
    return ", ".join(sorted({BITS[kind] for kind in kinds if kind in BITS}))


def _exact_canvas(drawn: Drawn) -> Drawn:
    mean = None if drawn.pipeline.output.mean_format is None else "exact"
    exact = _switched(output={"format": "exact", "mean_format": mean, "precision": "highp"})(drawn)
    return _on(blend="float")(exact)


def _mesh_targets(drawn: Drawn) -> str:
    meshes = drawn.pipeline.meshes
    if not drawn.scene.meshes:
        return ""
    colors = BITS.get(meshes.format, "")
    depths = "depths in bytes" if meshes.kind == "depth" and meshes.packing != "exact" else ""
    return ", ".join(filter(None, (colors, depths)))


def _coordinates(drawn: Drawn) -> str:
    rays = drawn.pipeline.rays
    return BITS.get(rays.format, "") if rays.kind == "coordinates" else ""


def _volume(drawn: Drawn) -> str:
    """Return what the volume's texture holds; a byte also cuts off what lies outside its domain."""
    bits = BITS.get(drawn.pipeline.volume.format, "")
    if not bits or bits.endswith("floats"):
        return bits
    low, high = domain_of(drawn.scene, drawn.pipeline)
    return f"{bits} of {low:g} to {high:g}"


def _early_end(drawn: Drawn) -> str:
    """Return what alpha ends a ray; of sums that are no *over* it is a part of the formula."""
    threshold = drawn.pipeline.stepping.opaque_at
    ends = threshold is not None and drawn.pipeline.accumulation.rule == "over"
    return f"at an alpha of {threshold:g}" if ends else ""


def _grid(drawn: Drawn) -> str:
    bits = drawn.device.subpixel_bits
    return "" if bits is None else f"1/{2**bits} of a pixel"


CAUSES = (
    Cause("step length", _step, _finer),
    Cause(
        "table size", lambda drawn: f"{drawn.pipeline.table.size} entries", _switched(table={"size": ENTRIES})
    ),
    Cause("table format", lambda drawn: BITS.get(drawn.pipeline.table.format, ""), _floats_in_table),
    Cause(
        "volume format",
        _volume,
        _switched(volume={"format": "float"}),
    ),
    Cause("coordinate format", _coordinates, _switched(rays={"format": "float"})),
    Cause("mesh format", _mesh_targets, _switched(meshes={"format": "float", "packing": "exact"})),
    # Textures of floats are filtered as they should be on every machine that is known.
    Cause(
        "filter", _filter, _on(weight_bits=None, result_bits=None), needs=("table format", "volume format")
    ),
    Cause("window grid", _grid, _on(subpixel_bits=None)),
    Cause(
        "arithmetic",
        _arithmetic,
        _on(values="float64", control="float64", fragment_color="float32", angles="rounded", srgb="curve"),
    ),
    Cause("canvas format", _canvas, _exact_canvas),
    Cause("early end", _early_end, _switched(stepping={"opaque_at": None})),
)


def without(drawn: Drawn, causes: tuple[Cause, ...]) -> Drawn:
    """Return what is drawn with several sources ideal; one that cannot be is left.

    Raises
    ------
    SceneError
        If one alone is asked for, and cannot be ideal.
    """
    for cause in causes:
        try:
            drawn = cause.without(drawn)
        except SceneError:
            if len(causes) == 1:
                raise
    return drawn
