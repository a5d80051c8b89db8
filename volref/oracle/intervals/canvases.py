"""What pixels hold before rays are drawn on them, and what rays do to that: from rays to the canvas.

R rays, P pixels; canvases are pairs of (P, 4).
"""

from typing import NamedTuple

import numpy as np

from volref.arrays import Booleans, Floats, Indices
from volref.emulation.drawing import Approach, Drawing
from volref.emulation.surfaces.composition import with_object
from volref.emulation.surfaces.depths import surface_colors
from volref.emulation.targets.canvas import store
from volref.oracle.intervals.casting import Cast
from volref.oracle.intervals.compositing import Behind, Outcome, brightest, composited
from volref.oracle.intervals.finishing import blends_as_last_sample, finished, fragments_of
from volref.oracle.intervals.gradients import Lit
from volref.oracle.intervals.slack import Slack
from volref.oracle.intervals.sums import summed
from volref.oracle.intervals.walking import Course, Pair

# What hangs on a comparison by more than this is said to.
VISIBLE = 0.5 / 255

# Roundings of an interpolated colour.
COLOR_ROUNDINGS = 32


class Frame(NamedTuple):
    """What a frame may hold before it rounds, and which pixels (P,) hang on a comparison."""

    canvas: Pair
    ambiguous: Booleans
    branch: Floats


def frame_of(course: Course, lit: Lit | None, cast: Cast, clear: Floats) -> Frame:
    """Return what a machine may draw of the rays of one frame, on a canvas that holds `clear` (P, 4)."""
    drawing, slack = course.drawing, course.finder.slack
    base = bases(drawing, cast, clear, slack)
    rays = course.rays
    before = canvas_before(drawing, cast, clear, slack)
    upon = Pair(before.low[rays.pixel], before.high[rays.pixel])
    fragments, branch = _fragments(course, lit, upon)
    return _together(cast, rays.pixel, fragments, branch, base)


def _fragments(course: Course, lit: Lit | None, upon: Pair) -> tuple[Pair, Floats]:
    """Return what rays may leave on the canvas (R, 4), and what of it ends decide (R,)."""
    drawing, slack, rays = course.drawing, course.finder.slack, course.rays
    accumulation, meshes = drawing.pipeline.accumulation, drawing.pipeline.meshes
    channels = 3 + (accumulation.alpha == "weighted")
    objects = _objects(course, channels)
    last = blends_as_last_sample(drawing)
    cut = rays.cut is not None
    if accumulation.rule == "over" and not (cut and meshes.composition == "printed"):
        end = (
            _as_channels(upon, channels) if last else Pair(*(np.zeros((channels + 1, len(rays.pixel))),) * 2)
        )
        if not cut:
            end = Pair(*(np.where(rays.covered, mesh, one) for mesh, one in zip(objects, end, strict=True)))
        outcome = composited(course, lit, Behind(end, objects))
        if last:
            return Pair(outcome.low.T, outcome.high.T), outcome.branch
    else:
        outcome = summed(course, lit, channels, (lambda *one: _met(course, *one)) if cut else None)
        if not cut and rays.covered.any():
            outcome = _upon_meshes(course, outcome)
    colors = fragments_of(outcome.low, outcome.high, accumulation, brightest(course))
    alpha = Pair(outcome.low[-1], outcome.high[-1])
    mapped = drawing.pipeline.output.mean_format is None
    both = [finished(drawing, colors, alpha, side, slack, mapped=mapped) for side in upon]
    done = Pair(np.minimum(both[0].low, both[1].low), np.maximum(both[0].high, both[1].high))
    return done, outcome.branch


def _objects(course: Course, channels: int) -> Pair:
    """Return the colours of the meshes behind rays (channels + 1, R), opaque; they may be a byte off."""
    rays, drawing = course.rays, course.drawing
    sides = []
    for way in (-1, 1):
        off = way * COLOR_ROUNDINGS * course.finder.slack.values
        color = rays.behind[:, :3] + off * rays.covered[:, None]
        stored = (
            store(color, drawing.pipeline.meshes.format, drawing.device) if drawing.scene.meshes else color
        )
        extra = np.ones((len(color), channels - 3))
        sides.append(np.concatenate([stored, extra, np.ones((len(color), 1))], axis=1).T)
    return Pair(*sides)


def _as_channels(canvas: Pair, channels: int) -> Pair:
    assert channels == 3
    return Pair(canvas.low.T.copy(), canvas.high.T.copy())


def _met(course: Course, low: Floats, high: Floats, ray: Indices) -> tuple[Floats, Floats]:
    """Return what is left of rays `ray` that have met their mesh, by the program's rule."""
    rule = course.drawing.pipeline.meshes.composition
    objects = course.rays.behind[ray]
    corners = []
    for color in (low, high):
        for alpha in (low, high):
            front = np.concatenate([color[:3], np.clip(alpha[-1:], 0, 1)]).T
            corners.append(with_object(front, objects, rule).T)
    stacked = np.array(corners)
    least, most = stacked.min(axis=0), stacked.max(axis=0)
    if rule == "printed":
        # A A + (1 - A) is least at A = 1/2.
        inside = (low[-1] < 0.5) & (high[-1] > 0.5)
        least[3] = np.where(inside, 0.75, least[3])
    new_low, new_high = low.copy(), high.copy()
    new_low[:3], new_high[:3] = least[:3], most[:3]
    new_low[-1], new_high[-1] = least[3], most[3]
    return new_low, new_high


def _upon_meshes(course: Course, outcome: Outcome) -> Outcome:
    """Return what is left of rays that end at a mesh, of programs that do not composite by *over*."""
    at = np.flatnonzero(course.rays.covered)
    low, high = outcome.low.copy(), outcome.high.copy()
    low[:, at], high[:, at] = _met(course, low[:, at], high[:, at], at)
    return outcome._replace(low=low, high=high)


def canvas_before(drawing: Drawing, cast: Cast, clear: Floats, slack: Slack) -> Pair:
    """Return what pixels may hold when rays are drawn upon them: the clear colour, or meshes drawn before."""
    low, high = clear.copy(), clear.copy()
    if drawing.cut is None:
        return Pair(low, high)
    for one in cast.approaches:
        colors = _mesh_canvas(drawing, one, slack)
        at = one.surfaces.pixel
        low[at], high[at] = np.minimum(low[at], colors.low), np.maximum(high[at], colors.high)
    every = _pixels_of_all(cast, len(clear))
    nominal = _mesh_canvas(drawing, cast.approaches[0], slack)
    at = cast.approaches[0].surfaces.pixel
    sure = every[at]
    low[at[sure]], high[at[sure]] = nominal.low[sure], nominal.high[sure]
    return Pair(low, high)


def _pixels_of_all(cast: Cast, pixels: int) -> Booleans:
    """Return which pixels (P,) have a mesh in every way that window positions may lie."""
    count = np.zeros(pixels, np.int64)
    for one in cast.approaches:
        count[one.surfaces.pixel] += 1
    return np.asarray(count == len(cast.approaches))


def _mesh_canvas(drawing: Drawing, one: Approach, slack: Slack) -> Pair:
    colors = surface_colors(one.surfaces, drawing.device)
    off = COLOR_ROUNDINGS * slack.values
    kind = drawing.pipeline.output.format
    return Pair(*(store(colors + way * off, kind, drawing.device) for way in (-1, 1)))


def bases(drawing: Drawing, cast: Cast, clear: Floats, slack: Slack) -> Pair:
    """Return what pixels may hold where no ray is drawn upon them."""
    output = drawing.pipeline.output
    low, high = np.full(clear.shape, np.inf), np.full(clear.shape, -np.inf)
    mapped = output.mean_format is None
    for one in cast.approaches:
        here = Pair(clear.copy(), clear.copy())
        colors = surface_colors(one.surfaces, drawing.device).astype(np.float64)
        at = one.surfaces.pixel
        if len(at) and drawing.cut is not None:
            painted = _mesh_canvas(drawing, one, slack)
            here.low[at], here.high[at] = painted
        elif len(at):
            off = COLOR_ROUNDINGS * slack.values
            kind = drawing.pipeline.meshes.format
            sides = (store(colors + way * off, kind, drawing.device) for way in (-1, 1))
            alpha = Pair(np.ones(len(at)), np.ones(len(at)))
            drawn = finished(drawing, Pair(*sides), alpha, clear[at], slack, mapped=mapped)
            here.low[at], here.high[at] = drawn
        if output.missed != "clear":
            empty = np.ones(len(clear), np.bool_)
            empty[at] = False
            color = (0.0, 0.0, 0.0, 1.0 if output.missed == "black" else 0.0)
            here.low[empty], here.high[empty] = color, color
        blank = one.ends.blank
        if len(blank):
            nothing = Pair(*(np.zeros((len(blank), 4)),) * 2)
            zero = Pair(np.zeros(len(blank)), np.zeros(len(blank)))
            left = finished(drawing, nothing, zero, clear[blank], slack, mapped=mapped)
            here.low[blank], here.high[blank] = left
        low, high = np.minimum(low, here.low), np.maximum(high, here.high)
    return Pair(low, high)


def _together(cast: Cast, pixel: Indices, fragments: Pair, branch: Floats, base: Pair) -> Frame:
    """Return the canvas of what each pixel's rays may leave, and of what it holds without any."""
    count = len(cast.missing)
    low, high = np.full((count, 4), np.inf), np.full((count, 4), -np.inf)
    np.minimum.at(low, pixel, np.nan_to_num(fragments.low, nan=-np.inf))
    np.maximum.at(high, pixel, np.nan_to_num(fragments.high, nan=np.inf))
    without = cast.missing | ~np.isfinite(low).all(axis=1)
    first_low, first_high = np.full((count, 4), np.inf), np.full((count, 4), -np.inf)
    order = np.arange(len(pixel))[::-1]
    first_low[pixel[order]], first_high[pixel[order]] = fragments.low[order], fragments.high[order]
    low, high = np.where(np.isnan(low), -np.inf, low), np.where(np.isnan(high), np.inf, high)
    at = np.flatnonzero(without)
    low[at], high[at] = np.minimum(low[at], base.low[at]), np.maximum(high[at], base.high[at])
    decided = np.zeros(count)
    np.maximum.at(decided, pixel, np.nan_to_num(branch, nan=1.0))
    with np.errstate(invalid="ignore"):
        widened = np.nan_to_num(((high - low) - (first_high - first_low)).max(axis=1), posinf=0.0, neginf=0.0)
    alone = np.ones(count, np.bool_)
    alone[pixel] = False
    base_width = (base.high - base.low).max(axis=1)
    decided = np.maximum(decided, np.where(alone, base_width, widened))
    return Frame(Pair(low, high), decided > VISIBLE, decided)
