"""`accept`: what any correct machine may draw of a scene with a program.

    drawing --> rays with radii --> samples as chords --> back to front --> tone map, blend, store --> lo, hi

See `volref/oracle/intervals`, and the guide to judging for what is counted.
"""

import dataclasses
import time

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import Booleans, Floats, whole_number
from volref.emulation.agreement import check_kinds
from volref.emulation.catalogue import named
from volref.emulation.device import Device
from volref.emulation.drawing import Drawing, prepare
from volref.emulation.loop.offsets import start_offsets
from volref.emulation.loop.opacity import OpacityRule, opacity_rule
from volref.emulation.passes import emulate
from volref.emulation.pipeline import Pipeline
from volref.emulation.targets.canvas import cleared
from volref.oracle.acceptance import Acceptance
from volref.oracle.intervals.advice import advice_for, check_bounded, low_quality_of
from volref.oracle.intervals.canvases import frame_of
from volref.oracle.intervals.casting import Cast, cast
from volref.oracle.intervals.finding import Finder
from volref.oracle.intervals.finishing import averaged, rounded, shown
from volref.oracle.intervals.gradients import lit_of
from volref.oracle.intervals.slack import slack_of
from volref.oracle.intervals.walking import Course, Pair
from volref.oracle.intervals.walks import walks_of
from volref.scene.scene import Scene

# How far a texture's decoding from sRGB may be off: SwiftShader's is 8e-6, measured in tests/webgl.
SRGB_ERROR = 1e-5


def accept(
    scene: Scene,
    pipeline: str | Pipeline,
    device: str | Device | None = None,
    jitter: ArrayLike | None = None,
    frames: int = 1,
) -> Acceptance:
    """Return the interval of every pixel in which a correct machine's image lies.

    Parameters
    ----------
    pipeline
        The name of a system in the catalogue, or a `Pipeline`.
    device
        The machine, or a set of machines such as "webgl-highp"; see `Device`.
    jitter
        For programs with a start offset: numbers 0..1 of a step, (frames, H, W).  None is any of them.
    frames
        Frames of which the running mean is shown.

    Raises
    ------
    SceneError
        If `emulate` refuses the scene or an argument, or the program does what nothing bounds; see
        `check_bounded`.
    """
    began = time.perf_counter()
    program = named(pipeline) if isinstance(pipeline, str) else pipeline
    machine = Device.named(device) if isinstance(device, str) else Device() if device is None else device
    check_kinds(scene, program, machine)
    check_bounded(scene, program)
    count = whole_number("frames", frames, low=1, high=1 << 20)
    nominal = emulate(scene, program, machine, jitter, count)
    offsets = start_offsets(scene, program, jitter, count)
    free = 1.0 if program.stepping.jitter and jitter is None else 0.0
    drawing = prepare(scene, program, machine)
    canvas, raw, cast_, ambiguous, branch = _canvas(drawing, offsets, free)
    shape = scene.height, scene.width
    low, high, raw_low, raw_high = (
        np.asarray(side, np.float64).reshape(*shape, 4) for side in (*canvas, *raw)
    )
    marked = ambiguous.reshape(shape)
    drawn = _drawn(cast_, shape)
    causes = _causes(Pair(low, high), Pair(raw_low, raw_high), branch.reshape(shape))
    return Acceptance(
        low,
        high,
        nominal.rgba.astype(np.float64),
        raw_low,
        raw_high,
        marked,
        drawn,
        causes,
        advice_for(program, machine, _typical(raw_high - raw_low, drawn)),
        program,
        machine,
        count,
        time.perf_counter() - began,
        low_quality_of(accept, scene, program, machine, jitter, count),
    )


def _canvas(drawing: Drawing, offsets: Floats, free: float) -> tuple[Pair, Pair, Cast, Booleans, Floats]:
    """Return the canvas, also before it rounds, the rays, which pixels hang on ends, and by how much."""
    output, device, scene = drawing.pipeline.output, drawing.device, drawing.scene
    slack = slack_of(device)
    srgb = SRGB_ERROR if drawing.pipeline.table.srgb and slack.values else 0.0
    finder = Finder(drawing.textures, slack, srgb)
    cast_ = cast(drawing, slack)
    rays = cast_.rays
    walks = walks_of(rays, drawing, slack)
    with_paths = dataclasses.replace(drawing, ends=rays.ends, paths=walks.paths)
    with_paths = dataclasses.replace(with_paths, rule=_rule(with_paths))
    lit = lit_of(with_paths)
    clear = cleared(scene, output, device)
    mean = Pair(clear, clear)
    ambiguous = np.zeros(len(clear), np.bool_)
    # Of a ray as short as its ends may be off, nobody knows the direction.
    ambiguous[rays.pixel[(walks.relative >= 0.5) & (slack.control > 0)]] = True
    branch = np.zeros(len(clear))
    for number, offset in enumerate(offsets, start=1):
        start = offset[rays.pixel].astype(device.control_type)
        course = Course(with_paths, finder, rays, walks, Pair(start, start + start.dtype.type(free)))
        frame = frame_of(course, lit, cast_, clear)
        ambiguous |= frame.ambiguous
        branch = np.maximum(branch, frame.branch)
        canvas = rounded(frame.canvas, output.format, device, blends=output.blend not in ("none", "shader"))
        if output.mean_format is not None:
            mean = averaged(mean, canvas, number, output, device)
    if output.mean_format is None:
        return canvas, frame.canvas, cast_, ambiguous, branch
    last = shown(drawing, mean, slack, scene)
    return rounded(last, output.format, device, blends=False), last, cast_, ambiguous, branch


def _typical(width: Floats, drawn: Booleans) -> float:
    """Return the median width of intervals (H, W, 4), of the widest channel of drawn pixels."""
    return float(np.median(width.max(axis=-1)[drawn])) if drawn.any() else 0.0


def _causes(canvas: Pair, raw: Pair, branch: Floats) -> dict[str, Floats]:
    """Return how wide intervals (H, W, 4) are by what ends decide, by all else, and by the number format."""
    with np.errstate(invalid="ignore"):
        stored, before = ((side.high - side.low).max(axis=-1) for side in (canvas, raw))
        decided = np.minimum(branch, before)
        rest = np.nan_to_num(before - decided)
        return {
            "branches": decided,
            "arithmetic and filters": rest,
            "number format": np.maximum(np.nan_to_num(stored - before), 0.0),
        }


def _rule(drawing: Drawing) -> OpacityRule:
    """Return the rule of opacity for the rays of a drawing."""
    return opacity_rule(drawing.scene, drawing.pipeline, drawing.box, drawing.paths, drawing.device)


def _drawn(cast_: Cast, shape: tuple[int, int]) -> Booleans:
    """Return which pixels (H, W) may have a ray or a mesh."""
    drawn = np.zeros(shape[0] * shape[1], np.bool_)
    drawn[cast_.rays.pixel] = True
    for one in cast_.approaches:
        drawn[one.surfaces.pixel] = True
    return drawn.reshape(shape)
