"""From what samples may find to what they may add: opacities at both ends of the chord, and beside it.

n samples of rays; ends are (2, n) or (2, 3, n).
"""

from typing import NamedTuple

import numpy as np

from volref.arrays import Floats, Indices
from volref.emulation.loop.opacity import OpacityRule
from volref.oracle.intervals.finding import Finder, Reach
from volref.oracle.intervals.walking import Course, Pair

# A share of a step that is off by more than this share of itself is not one that roundings have moved.
UNSURE = 1e-5


class Share(NamedTuple):
    """What samples add: opacity (2, n) and straight colour (2, C, n) at the ends of the chord.

    opacity_off (n,), color_off (C, n): how far beside the chord they may lie.  C is 3, or 4 with the sample's
    own alpha as the last, for programs that write its weighted sum.
    """

    opacity: Floats
    color: Floats
    opacity_off: Floats
    color_off: Floats

    def part(self, some: slice) -> "Share":
        """Return those of some samples."""
        return Share(*(one[..., some] for one in self))


def share_of(course: Course, reach: Reach, ray: Indices, part: Pair | None) -> Share:
    """Return what samples of rays `ray` (n,) that stand for `part` of a whole step may add."""
    pipeline, rule = course.drawing.pipeline, course.drawing.rule
    table, beside = reach.ends[:, 3], reach.spread[3]
    if rule.source == "value":
        table = np.stack([reach.value - reach.radius, reach.value + reach.radius])
        beside = np.full_like(reach.radius, 2 * course.finder.slack.values)
    opacity, off = _by_step(course.finder, rule, table, beside, ray, part, course.walks.relative)
    if rule.times != 1.0:
        opacity, off = opacity * rule.times, off * rule.times
    if rule.by_gradient:
        assert reach.magnitude is not None
        assert reach.gradient_radius is not None
        steep = reach.magnitude * rule.by_gradient
        off = off * (steep + reach.gradient_radius * rule.by_gradient)
        off = off + np.abs(opacity).max(axis=0) * reach.gradient_radius * rule.by_gradient
        opacity = opacity * steep
    color, color_off = reach.ends[:, :3], reach.spread[:3]
    light = pipeline.lighting.factor
    if light != 1.0:
        color, color_off = color * light, color_off * light
    if pipeline.accumulation.alpha == "weighted":
        own, own_off = table, beside
        color = np.concatenate([color, own[:, None]], axis=1)
        color_off = np.concatenate([color_off, own_off[None]])
    return Share(opacity, color, off, color_off)


def _by_step(
    finder: Finder,
    rule: OpacityRule,
    table: Floats,
    beside: Floats,
    ray: Indices,
    part: Pair | None,
    relative: Floats,
) -> tuple[Floats, Floats]:
    """Return opacities (2, n) of table opacities (2, n), and how far beside them they may lie (n,)."""
    scale = rule.scale if len(rule.scale) == 1 else rule.scale[ray].astype(np.float64)
    off = 8 * finder.slack.values + (relative[ray] if len(rule.scale) > 1 else 0.0)
    low, high = scale * (1 - off), scale * (1 + off)
    if part is not None:
        low, high = low * part.low, high * part.high
    middle, half = (low + high) / 2, (high - low) / 2
    if not rule.corrected:
        return table * middle, beside * high + np.abs(table).max(axis=0) * half
    clear = np.clip(1 - table, 0.0, None)
    left = clear**middle
    # d (x^s) / dx = s x^s / x, which is largest at the smaller x for s < 1 and at most s for s >= 1.
    least = clear.min(axis=0)
    steep = np.where(least > 2 * beside, left.max(axis=0) / np.maximum(least - beside, 1e-300), 0.0)
    spread = np.minimum(high * beside * np.maximum(steep, 1.0), 1.0)
    dark = np.flatnonzero((least <= 2 * beside) & (high < 1))
    if len(dark):
        spread[dark] = (
            (least[dark] + beside[dark]) ** middle[dark]
            if middle.size > 1
            else (least[dark] + beside[dark]) ** middle
        )
    # s d (x^s) / ds = T ln T with T = x^s, at most 1 / e and at most 1 - T (and a thousandth more for a share
    # that is off by as much); where a share of a step is not known, both are computed.
    steepest = np.minimum(0.3679, 1.002 * (1 - left.min(axis=0)) + UNSURE * half)
    spread = spread + np.minimum(steepest * half / np.maximum(low, 1e-300), 1.0) * (half < UNSURE * middle)
    unsure = np.flatnonzero(np.broadcast_to(half >= UNSURE * middle, beside.shape))
    if len(unsure):
        base, (least_share, most_share) = clear[:, unsure], np.broadcast_arrays(low, high, beside)[:2]
        wide = np.abs(base ** least_share[unsure] - base ** most_share[unsure]).max(axis=0)
        spread[unsure] += wide
    bend = np.abs(table[1] - table[0]) * np.abs(middle - 1)
    curved = np.abs(left[1] - left[0]) * np.minimum(bend / np.maximum(4 * least, 1e-300), 1.0)
    return 1 - left, spread + curved + finder.slack.power(float(np.max(high, initial=0.0)))
