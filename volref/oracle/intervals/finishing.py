"""From what rays may leave to what a canvas may hold: tone map, blending, number formats, the mean of frames.

F fragments, P pixels; colours are (F, 4) or (P, 4), least and greatest.  All that happens to a fragment grows
or falls with each of its channels, so that least and greatest are found at the corners of what it may be.
"""

from itertools import product

import numpy as np

from volref.arrays import Floats
from volref.emulation.device import Device
from volref.emulation.drawing import Drawing
from volref.emulation.groups import Accumulation, Output
from volref.emulation.loop.marching import Marched
from volref.emulation.targets.blending import REPLACING, blended, blended_codes
from volref.emulation.targets.canvas import fragment_colors, over_environment, store, tone_mapped
from volref.formats import codes_of, decoded, stored
from volref.oracle.intervals.slack import UNIT, Slack
from volref.oracle.intervals.walking import Pair
from volref.scene.scene import Scene

STEP = 1.0 / 255


def blends_as_last_sample(drawing: Drawing) -> bool:
    """Whether what the canvas holds is put behind a fragment just as another sample would be."""
    output, device = drawing.pipeline.output, drawing.device
    narrow = output.precision == "mediump" and device.fragment_color == "float16"
    plain = output.tone_map == "none" and output.gamma == 1.0 and output.discard_below is None
    rule = drawing.pipeline.accumulation
    simple = rule.alpha == "accumulated" and rule.normalize == "none" and not narrow and plain
    whole = output.format == "unorm8" and device.blend == "integer"
    return simple and output.blend == "premultiplied" and not whole


def fragments_of(low: Floats, high: Floats, accumulation: Accumulation, brightest: float) -> Pair:
    """Return what shaders have after their loops (F, 4), of colours, own alpha if written, and alpha.

    brightest: the brightest colour of samples, which no colour divided by alpha exceeds.
    """
    bounds = []
    for picks in product((0, 1), repeat=2):
        color, alpha = ((low, high)[side] for side in picks)
        weighted = color[3] if len(color) > 4 else alpha[-1]
        nothing = np.zeros(len(alpha[-1]), np.int64)
        marched = Marched(color[:3], alpha[-1], weighted, nothing, nothing.astype(np.bool_))
        bounds.append(fragment_colors(marched, accumulation))
    if accumulation.normalize == "above-one":
        # Just above 1 a colour is divided, just below it is not: in between it is what it is at 1.
        crossing = (low[-1] <= 1) & (high[-1] >= 1)
        bounds += [np.where(crossing[:, None], bounds[side], bounds[0]) for side in (0, 3)]
        for side, color in ((0, low), (1, high)):
            extra = bounds[0].copy()
            extra[crossing, :3] = color[:3, crossing].T
            bounds.append(extra if side == 0 else np.where(crossing[:, None], extra, bounds[0]))
    stacked = np.array(bounds)
    if accumulation.normalize == "always":
        # A quotient of two numbers that may both be 0 is any colour between black and the brightest.
        stacked = np.concatenate([stacked, stacked[:1], stacked[:1]])
        nothing = low[-1] <= 0
        stacked[-2, nothing, :3], stacked[-1, nothing, :3] = 0.0, brightest
        stacked[..., :3] = np.clip(stacked[..., :3], 0.0, brightest)
    return Pair(stacked.min(axis=0), stacked.max(axis=0))


def finished(
    drawing: Drawing, fragments: Pair, alpha: Pair, behind: Floats, slack: Slack, *, mapped: bool
) -> Pair:
    """Return what fragments (F, 4) may leave on a canvas that holds `behind` (F, 4), before it rounds.

    alpha (F,): what was accumulated, for shaders that add an environment.  mapped: whether this is the last
    target, whose tone map is applied here.
    """
    output, device = drawing.pipeline.output, drawing.device
    outcomes, alphas = [], []
    for corner in _corners(fragments, output, slack):
        colors = [corner]
        if output.blend == "environment":
            rule = drawing.pipeline.accumulation
            colors = [over_environment(corner, one, behind, rule) for one in alpha]
        for color in colors:
            done = tone_mapped(color, output, drawing.scene.background) if mapped else color
            alphas.append(done[:, 3])
            outcomes.append(_blended(done, behind, output, device))
    if output.blend == "straight":
        outcomes.append(_least_straight(outcomes[0], fragments, behind, integer=device.blend == "integer"))
    stacked = np.array(outcomes)
    low, high = np.fmin.reduce(stacked), np.fmax.reduce(stacked)
    # Of what is not squeezed yet nothing is off by more than its own size, and that of what lies behind.
    size = np.maximum(np.abs(low), np.abs(high)) + np.abs(behind)
    off = 24 * slack.values * (np.maximum(size, 1.0) if mapped else size)
    if mapped and (output.gamma != 1.0 or output.tone_map != "none"):
        off = off + slack.power(1.0)
    if device.blend == "integer" and output.format == "unorm8":
        off = off + STEP * _between_alphas(np.array(alphas), output.blend)
    if output.discard_below is None:
        return Pair(low - off, high + off)
    written, seen = np.array(alphas), output.discard_below
    kept, left = (written.max(axis=0) >= seen)[:, None], (written.min(axis=0) < seen)[:, None]
    low, high = (np.where(kept, side, behind) for side in (low - off, high + off))
    return Pair(np.where(left, np.minimum(low, behind), low), np.where(left, np.maximum(high, behind), high))


def _between_alphas(alphas: Floats, blend: str) -> Floats:
    """Return (F, 1) where whole numbers may blend to one more or less than at both ends of their alpha.

    C a + B (255 - a) is a line in a, but each product is rounded, by up to 0.502: so two sums of two are off
    from the line by less than 2 together, and their difference is a whole number.
    """
    if blend not in ("straight", "additive-alpha"):
        return np.zeros((alphas.shape[1], 1))
    codes = codes_of(np.clip(alphas, 0.0, 1.0), 8).astype(np.int64)
    return np.asarray(np.ptp(codes, axis=0)[:, None] >= 2, np.float64)


def _least_straight(outcome: Floats, fragments: Pair, behind: Floats, *, integer: bool) -> Floats:
    """Return an outcome with the least alpha: a a + (1 - a) b is least at a = b / 2, inside what a may be."""
    middle = behind[:, 3] / 2
    inside = (fragments.low[:, 3] < middle) & (fragments.high[:, 3] > middle)
    # Products of whole numbers are rounded one by one.
    least = behind[:, 3] - middle * middle - 2 * STEP * integer
    lowered = outcome.copy()
    lowered[:, 3] = np.where(inside, least, outcome[:, 3])
    return lowered


def _corners(fragments: Pair, output: Output, slack: Slack) -> list[Floats]:
    """Return the corners of what fragments may be; where channels do not mix, those of colour and alpha.

    They are widened by the roundings before a power, which makes much of little.
    """
    off = 6 * slack.values
    light = abs(output.low) if output.tone_map == "artistic" else 0.0
    sides = (
        fragments.low - off * (np.abs(fragments.low) + light),
        fragments.high + off * (np.abs(fragments.high) + light),
    )
    found = []
    for pick in product((0, 1), repeat=4 if output.tone_map == "artistic" else 2):
        which = pick if len(pick) == 4 else (pick[0],) * 3 + (pick[1],)
        found.append(np.stack([sides[side][:, k] for k, side in enumerate(which)], axis=1))
    return found


def _blended(color: Floats, behind: Floats, output: Output, device: Device) -> Floats:
    """Return what blending makes of fragments (F, 4), before the canvas rounds it."""
    if output.precision == "mediump" and device.fragment_color == "float16":
        color = stored(color, "half")
    if output.format == "unorm8":
        color = np.clip(np.nan_to_num(color, nan=0.0), 0.0, 1.0)
        if device.blend == "integer" and output.blend not in REPLACING:
            codes = blended_codes(codes_of(color, 8), codes_of(behind, 8), output.blend)
            return decoded(codes, np.dtype(np.float64))
    return blended(color, behind, output.blend)


def rounded(canvas: Pair, kind: str, device: Device, *, blends: bool) -> Pair:
    """Return what a target of a number format holds of numbers between those of two (P, 4)."""
    low, high = canvas
    if kind == "unorm8":
        slack = (device.store_slack + (device.blend_slack if blends else 0.0)) * STEP
        low, high = low - slack, high + slack
    return Pair(store(low, kind, device), store(high, kind, device))


def averaged(mean: Pair, frame: Pair, number: int, output: Output, device: Device) -> Pair:
    """Return what the running mean may be after frame `number`, from 1."""
    assert output.mean_format is not None
    share = 1 / number
    unit = UNIT["float32"] if device.freedom != "none" else 0.0
    sides = []
    for side, (before, now) in enumerate(zip(mean, frame, strict=True)):
        mixed = before + (now - before) * share
        off = 4 * unit * (np.abs(before) + np.abs(now)) * (1 if side else -1)
        sides.append(mixed + off)
    return rounded(Pair(*sides), output.mean_format, device, blends=False)


def shown(drawing: Drawing, mean: Pair, slack: Slack, scene: Scene) -> Pair:
    """Return what the canvas may show of a mean (P, 4), before it rounds."""
    output = drawing.pipeline.output
    outcomes = [tone_mapped(corner, output, scene.background) for corner in _corners(mean, output, slack)]
    stacked = np.array(outcomes)
    low, high = stacked.min(axis=0), stacked.max(axis=0)
    off = 24 * slack.values * np.maximum(1.0, np.abs(high)) + slack.power(1.0) * (output.gamma != 1.0)
    return Pair(low - off, high + off)
