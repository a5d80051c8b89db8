"""The loop of a fragment shader: sample, accumulate, advance, one iteration for all rays at a time.

R rays, n of them in the arrays of a walk.  Positions, lengths and counts are in the control type of the
device, colours in its values type.  Rays that have ended are dropped from the arrays now and then; what is
computed for them until then is not used.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np

from volref.arrays import Booleans, Floats, Indices, Integers
from volref.emulation.groups import Stepping
from volref.emulation.loop.opacity import OpacityRule
from volref.emulation.rays.paths import Paths
from volref.emulation.textures.lookup import Found, Textures, look_up, mix
from volref.emulation.textures.mipmaps import LANES
from volref.errors import SceneError
from volref.workspace import Workspace

# Rays walked together: fewer cost more calls than arithmetic, more leave the second-level cache.
CHUNK = 1 << 14

# Rays that have ended are dropped when they are more than this share.
MOST_OVER = 0.2

# A ray of a program without a cap ends here all the same: one whose length is NaN would walk for ever.
LONGEST_LOOP = 1 << 16

# Colours (4, n) of samples at positions (3, n) of rays (n,), in place of what the table found.
Shader: TypeAlias = Callable[[Floats, Found, Indices], Floats]


class Cut(NamedTuple):
    """Opaque meshes as the loop sees them: depth at the entry, per step and of the surface, all (R,).

    `early`: the ray ends where its depth comes within a step of the surface's, not where it reaches it.
    """

    depth: Floats
    step: Floats
    surface: Floats
    early: bool


@dataclass(frozen=True, eq=False)
class Program:
    """All that a loop needs: textures, opacity, paths, the place (R,) of the first sample in its step."""

    textures: Textures
    rule: OpacityRule
    paths: Paths
    offset: Floats
    cut: Cut | None = None
    shade: Shader | None = None


class Marched(NamedTuple):
    """Colour (3, R), alpha, weighted sum of the samples' own alpha, samples taken, which rays met a mesh."""

    color: Floats
    alpha: Floats
    weighted: Floats
    samples: Integers
    hit: Booleans


@dataclass(frozen=True, eq=False)
class Sample:
    """One iteration, for those who look on: its number, its rays (n,), what they found and became.

    position (3, n); opacity (n,), share (n,) of a whole step or None; color (3, n) and alpha (n,) after it.
    """

    number: int
    ray: Indices
    position: Floats
    found: Found
    opacity: Floats
    share: Floats | None
    color: Floats
    alpha: Floats


Observer: TypeAlias = Callable[[Sample], None]


@dataclass(eq=False)
class _Walk:
    """What changes from iteration to iteration, of rays `ray` (n,); walked counts down for "length-left"."""

    ray: Indices
    paths: Paths
    offset: Floats
    position: Floats
    walked: Floats
    color: Floats
    alpha: Floats
    weighted: Floats
    depth: Floats
    over: Booleans
    quads: bool


def march(program: Program, observe: Observer | None = None, rays: Indices | None = None) -> Marched:
    """Return what the loop accumulates along all rays, or along some: that of the others stays 0.

    Raises
    ------
    SceneError
        If the table has mip levels, for which a ray needs its neighbours, and not whole quads are chosen.
    """
    if rays is not None and program.textures.levels and len(rays) % LANES:
        message = "pipeline.table.filter must be 'linear' or 'nearest' for single rays, got 'linear-mipmap'; "
        raise SceneError(message + "walk whole quads")
    chosen = np.arange(len(program.offset)) if rays is None else rays
    count, kind = len(program.offset), program.textures.device.values_type
    color, alpha, weighted = np.zeros((3, count), kind), np.zeros(count, kind), np.zeros(count, kind)
    result = Marched(color, alpha, weighted, np.zeros(count, np.int64), np.zeros(count, np.bool_))
    work = Workspace()
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for first in range(0, len(chosen), CHUNK):
            _run(program, chosen[first : first + CHUNK], result, work, observe)
    stepping = program.textures.pipeline.stepping
    if stepping.stopped == "opaque" and stepping.opaque_at is not None:
        result.alpha[_is_opaque(stepping, result.alpha)] = 1
    return result


def _run(program: Program, rays: Indices, result: Marched, work: Workspace, observe: Observer | None) -> None:
    stepping = program.textures.pipeline.stepping
    walk = _start(program, rays)
    for number in range(stepping.cap or LONGEST_LOOP):
        if not _left(walk, _ended_before(stepping, walk, number), number, result):
            return
        if program.cut is not None and not _left(walk, _met(program.cut, walk, result), number, result):
            return
        position, share = _place(program, walk, number)
        found = look_up(program.textures, position, work)
        if program.shade is not None:
            found = found._replace(color=program.shade(position, found, walk.ray))
        opacity = program.rule.opacity(found, walk.ray, share)
        if number >= stepping.skipped:
            _accumulate(program, walk, found, opacity)
        if observe is not None:
            seen = Sample(number, walk.ray, position, found, opacity, share, walk.color, walk.alpha)
            observe(seen)
        _advance(stepping, walk)
        if not _left(walk, _ended_after(stepping, walk, position), number + 1, result):
            return
        if walk.quads:
            walk.position = np.where(walk.over, position, walk.position)
    _left(walk, np.ones_like(walk.over), stepping.cap or LONGEST_LOOP, result)


def _start(program: Program, rays: Indices) -> _Walk:
    paths, offset = program.paths.take(rays), program.offset[rays]
    kind = program.textures.device.values_type
    stepping = program.textures.pipeline.stepping
    count = len(rays)
    position, walked = paths.entry, np.zeros_like(paths.length)
    if stepping.advance == "parameter":
        walked = paths.step * offset
    elif stepping.advance == "add":
        position = paths.entry + paths.delta * offset
    if stepping.end == "length-left":
        walked = paths.length
    zeros = (np.zeros((3, count), kind), np.zeros(count, kind), np.zeros(count, kind))
    depth = walked if program.cut is None else program.cut.depth[rays]
    over, quads = np.zeros(count, np.bool_), bool(program.textures.levels)
    return _Walk(rays, paths, offset, position, walked, *zeros, depth, over, quads)


def _left(walk: _Walk, ended: Booleans, samples: int, result: Marched) -> bool:
    """Put down the rays that have just ended, and tell whether any are left."""
    new = ended & ~walk.over
    if new.any():
        _put_down(walk, new, samples, result)
        walk.over |= new
        share = np.count_nonzero(walk.over) / len(walk.over)
        if share == 1.0:
            return False
        if share > MOST_OVER and not walk.quads:
            _drop(walk)
    return True


def _put_down(walk: _Walk, which: Booleans, samples: int, result: Marched) -> None:
    ray = walk.ray[which]
    result.color[:, ray] = walk.color[:, which]
    result.alpha[ray], result.weighted[ray] = walk.alpha[which], walk.weighted[which]
    result.samples[ray] = samples


def _drop(walk: _Walk) -> None:
    """Drop the rays that are over from the arrays."""
    kept = np.flatnonzero(~walk.over)
    walk.paths = walk.paths.take(kept)
    for name in ("ray", "offset", "position", "walked", "color", "alpha", "weighted", "depth", "over"):
        setattr(walk, name, np.take(getattr(walk, name), kept, axis=-1))


def _ended_before(stepping: Stepping, walk: _Walk, number: int) -> Booleans:
    """Tell which rays end before iteration `number`."""
    paths, kind = walk.paths, walk.walked.dtype.type
    if stepping.end == "count":
        return np.asarray(number >= paths.count)
    if stepping.end == "parameter":
        return ~(walk.walked < 1)
    if stepping.end == "length-left":
        return ~(walk.walked > 0)
    if stepping.end == "length-before":
        begin = kind(number) * paths.step
        if stepping.last_step == "dropped":
            return np.asarray(begin + paths.step > paths.length)
        return ~(begin < paths.length)
    return np.zeros(len(walk.ray), np.bool_)


def _place(program: Program, walk: _Walk, number: int) -> tuple[Floats, Floats | None]:
    """Return where the sample lies, and what share (n,) of a whole step it stands for; None: all of it."""
    stepping, paths = program.textures.pipeline.stepping, walk.paths
    kind = walk.walked.dtype.type
    if stepping.advance == "add":
        return walk.position, None
    if stepping.advance == "parameter":
        return mix(program.textures.device, paths.entry, paths.exit, walk.walked), None
    share = None
    if stepping.last_step in ("partial", "doubled") and stepping.end == "length-before":
        left = paths.length - kind(number) * paths.step
        share = np.minimum(left, paths.step) / paths.step
    place = walk.offset if share is None else walk.offset * share
    position = paths.entry + paths.delta * (kind(number) + place)
    if share is not None and stepping.last_step == "doubled":
        share = np.where(left <= paths.step, share + share, share)
    return position, share


def _advance(stepping: Stepping, walk: _Walk) -> None:
    if stepping.advance == "add":
        walk.position = walk.position + walk.paths.delta
    if stepping.end == "length-left":
        walk.walked = walk.walked - walk.paths.step
    elif stepping.advance == "parameter" or stepping.end == "length-after":
        walk.walked = walk.walked + walk.paths.step


def _ended_after(stepping: Stepping, walk: _Walk, sampled: Floats) -> Booleans:
    """Tell which rays end after an iteration at `sampled`, by where they have got to or by their alpha."""
    if stepping.end == "length-after":
        ended: Booleans = np.asarray(walk.walked >= walk.paths.length)
    elif stepping.end == "outside":
        x, y, z = walk.position  # row by row: a reduction over three rows is slow
        ended = (x > 1) | (x < 0) | (y > 1) | (y < 0) | (z > 1) | (z < 0)
    elif stepping.end == "outside-above":
        ended = np.any(sampled > 1, axis=0)
    else:
        ended = np.zeros(len(walk.ray), np.bool_)
    if stepping.opaque_at is not None:
        ended = np.logical_or(ended, _is_opaque(stepping, walk.alpha))
    return ended


def _is_opaque(stepping: Stepping, alpha: Floats) -> Booleans:
    assert stepping.opaque_at is not None
    threshold = alpha.dtype.type(stepping.opaque_at)
    return np.asarray(alpha > threshold if stepping.opaque_test == "above" else alpha >= threshold)


def _met(cut: Cut, walk: _Walk, result: Marched) -> Booleans:
    """Tell which rays have reached a surface before the sample that they would take now, and go a step on."""
    step, surface = cut.step[walk.ray], cut.surface[walk.ray]
    reached = walk.depth - surface > -step if cut.early else walk.depth >= surface
    result.hit[walk.ray[reached & ~walk.over]] = True
    walk.depth = walk.depth + step
    return np.asarray(reached)


def _accumulate(program: Program, walk: _Walk, found: Found, opacity: Floats) -> None:
    """Add samples of straight colour and opacity (n,) to the walk."""
    pipeline, color = program.textures.pipeline, found.color
    light, rule = pipeline.lighting.factor, pipeline.accumulation.rule
    kind = opacity.dtype.type
    if rule == "reversed-over":
        # Which sample is the last, and so in front, is decided by alpha's rounding to 1: control arithmetic.
        walk.color = color[:3] * opacity * kind(light) + walk.color * ((kind(1) - opacity) * walk.alpha)
        share = opacity.astype(walk.walked.dtype)
        walk.alpha = share + (share.dtype.type(1) - share) * walk.alpha.astype(share.dtype)
        return
    if rule in ("mean", "greatest"):
        _gather(program, walk, color, opacity)
        return
    weight = (kind(1) - walk.alpha) * opacity
    shown = kind(1) - walk.alpha if pipeline.accumulation.color == "premultiplied" else weight
    shining = shown if light == 1.0 else shown * kind(light)
    walk.color += color[:3] * shining
    if pipeline.accumulation.alpha == "weighted":
        own = found.value if pipeline.opacity.source == "value" else color[3]
        walk.weighted += own * weight
    walk.alpha = walk.alpha + (weight if rule == "over" else opacity)
    if rule == "add-clamped":
        np.minimum(walk.alpha, kind(1), out=walk.alpha)


def _gather(program: Program, walk: _Walk, color: Floats, opacity: Floats) -> None:
    """Add samples to a walk whose result does not hang on their order: the mean, or the most opaque."""
    kind = opacity.dtype.type
    lit = color[:3] * (opacity * kind(program.textures.pipeline.lighting.factor))
    if program.textures.pipeline.accumulation.rule == "mean":
        share = (walk.paths.step / walk.paths.length).astype(kind)
        walk.color, walk.alpha = walk.color + lit * share, walk.alpha + opacity * share
        return
    greater = opacity > walk.alpha
    walk.color, walk.alpha = np.where(greater, lit, walk.color), np.where(greater, opacity, walk.alpha)
