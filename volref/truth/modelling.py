"""Pieces of rays to integrals of their models: the exact integrator's pass.

n pieces; see `stages.models`, `stages.quadrature` and `stages.curved`.
"""

from dataclasses import dataclass

import numpy as np

from volref.arrays import Booleans, Floats, Indices
from volref.cubics import value_range
from volref.records import Pieces
from volref.stages.curved import LOGARITHM_LOSS, CurvedEmission, curved_emission
from volref.stages.models import Models, rows_of
from volref.stages.models import columns as column
from volref.stages.quadrature import REACH, moments
from volref.stages.radiance import Layout, Modelled, layout_of, sums_in_front

ROUNDOFF = 2.0**-53

# The part of the tolerance that the quadrature of one piece may take.
QUADRATURE_SHARE = 1 / 512

# No ray has more than this optical depth in front of anything that is seen: exp(-800) is 0.
OPAQUE = 800.0


@dataclass(frozen=True, eq=False)
class Solved:
    """Pieces of a pass, what their models are and integrate to, and what may be done about their errors.

    row (n,): the model's row.  quadrature (n,): what the quadrature adds to the bound.  steepest (n,): length
    times greatest extinction.  unsettled (n,): no quadrature served; the piece must be cut.
    """

    pieces: Pieces
    layout: Layout
    integrals: Modelled
    row: Indices
    quadrature: Floats
    steepest: Floats
    unsettled: Booleans


def modelled(models: Models, pieces: Pieces, astray: float, tolerance: float) -> Solved:
    """Return the integrals of the pieces' models, with quadrature good enough for `tolerance` per ray.

    `astray` is how far the value of a neighbouring cell may be where a piece is astray.
    """
    row = _rows(models, pieces)
    seen = np.flatnonzero(models.rows[column.SEEN].take(row))
    if len(seen) < len(row):
        pieces, row = pieces.take(seen), row.take(seen)
    layout = layout_of(pieces.ray)
    # There, what is seen may differ by a jump, or by as much as the value.
    astray_sigma = min(models.most_sigma, models.most_jump + models.most_slope * astray)
    if models.opaque:
        astray_sigma = models.most_sigma
    if astray == 0:  # all cells are alike
        astray_sigma = 0.0
    offset, reach, density, depth_error, light_error = _extinction(models, pieces, row, astray_sigma)
    color, slopes, bend, change, steepest_color = _color(models, row, offset, reach, pieces.slack)
    color_error = steepest_color * pieces.slack
    color_error += models.rows[column.COLOR_OFF].take(row)
    _beside(models, pieces, row, depth_error, color_error, light_error)
    depth = density[2] / 12
    depth += density[0]
    np.maximum(depth, 0.0, out=depth)
    steepest = np.abs(density[1:]).T @ np.array([0.5, 0.25, 0.125]) + density[0]
    unsettled = np.zeros(len(row), np.bool_)
    share = tolerance * QUADRATURE_SHARE
    curved = _curved(models, pieces, row, offset, steepest_color, share)
    if curved is not None:
        at, light = curved
        depth[at] = light.depth
        depth_error[at] += light.depth_error
        unsettled[at] = ~light.settled
        steepest[at] = np.where(light.settled & (light.depth >= OPAQUE), 0.0, light.depth)
    if models.opaque:
        unsure = _unsure_of_opacity(models, pieces, row, layout, astray)
        depth_error[unsure] = np.inf
        change[:, unsure] = models.largest.max()
    in_front = np.exp(-sums_in_front(np.minimum(depth, OPAQUE), layout))
    opacity = -np.expm1(-depth)
    steepest_color *= in_front
    np.maximum(steepest_color, 1e-300, out=steepest_color)
    straight = moments(
        cubic=pieces.cubic, density=density, limit=share / steepest_color, second=bend is not None
    )
    if curved is not None:
        straight.first[at], straight.error[at] = light.first, light.error
    shine, error = color * opacity, np.abs(slopes)
    slopes *= straight.first
    shine += slopes
    if bend is not None:
        shine += bend * straight.second
        error += np.abs(bend) * (REACH * reach)
    error *= straight.error
    quadrature = error.max(axis=0)
    quadrature *= in_front
    error += light_error
    integrals = Modelled(depth, opacity, in_front, shine, color, change, depth_error, color_error, error)
    return Solved(pieces, layout, integrals, row, quadrature, np.maximum(steepest, 1e-300), unsettled)


def _extinction(
    models: Models, pieces: Pieces, row: Indices, astray_sigma: float
) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """Return offset, reach, density (4, n), P, and the light that astray parts may add, (n,) each.

    The offset is the middle value less the row's centre, the reach how far the value leaves the middle one.
    """
    rows, length, cubic = models.rows, pieces.length, pieces.cubic
    offset = cubic[0] - rows[column.CENTER].take(row)
    slope, level = rows[column.SIGMA1].take(row), rows[column.SIGMA0].take(row)
    density = np.empty_like(cubic)
    np.multiply(cubic[1:], slope, out=density[1:])
    np.multiply(slope, offset, out=density[0])
    density[0] += level
    np.maximum(density[0], 0.0, out=density[0])
    density *= length
    reach = 0.5 * np.abs(cubic[1])
    reach += 0.25 * np.abs(cubic[2])
    reach += 0.125 * np.abs(cubic[3])
    depth_error = reach * (128 * ROUNDOFF)
    depth_error += pieces.slack
    depth_error *= np.abs(slope, out=slope)
    depth_error += rows[column.SIGMA_OFF].take(row)
    level *= 32 * ROUNDOFF
    depth_error += level
    lost = pieces.astray * astray_sigma
    depth_error += lost
    depth_error *= length
    lost *= length * float(models.largest.max())
    return offset, reach, density, depth_error, lost


def _color(
    models: Models, row: Indices, offset: Floats, reach: Floats, slack: Floats
) -> tuple[Floats, Floats, Floats | None, Floats, Floats]:
    """Return the models' colours at the middle values and their derivatives, (3, n) each.

    Half the second derivatives follow; they are None where all rows are straight.  Then, how far the colour
    leaves that of the middle (3, n), and the steepest it is in any channel within `slack` of a value (n,).
    """
    rows = models.rows
    slopes = rows[column.C1].take(row, axis=1)
    color = rows[column.C0].take(row, axis=1)
    if not models.bent:
        color += slopes * offset
        change = np.abs(slopes)
        steepest = change.max(axis=0)
        change *= reach
        return color, slopes, None, change, steepest
    bend = rows[column.C2].take(row, axis=1)
    step = bend * offset
    slopes += step
    color += slopes * offset
    slopes += step
    change, more = np.abs(slopes), np.abs(bend)
    steepest = (change + more * (2 * (reach + slack))).max(axis=0)
    more *= reach
    change += more
    change *= reach
    return color, slopes, bend, change, steepest


def _rows(models: Models, pieces: Pieces) -> Indices:
    """Return the row of each piece: its own, or that of the run its values lie in."""
    unknown = np.flatnonzero(pieces.row < 0)
    if len(unknown) == 0:
        return pieces.row
    if len(unknown) == len(pieces.row):
        low, high = value_range(pieces.cubic)
        low -= pieces.slack
        high += pieces.slack
        return rows_of(models, low, high)
    row = pieces.row.copy()
    low, high = value_range(pieces.cubic.take(unknown, axis=1))
    slack = pieces.slack.take(unknown)
    row[unknown] = rows_of(models, low - slack, high + slack)
    return row


def _beside(
    models: Models,
    pieces: Pieces,
    row: Indices,
    depth_error: Floats,
    color_error: Floats,
    light_error: Floats,
) -> None:
    """Add what lies within `slack` of a bend may be off, in place: it may belong to the next piece."""
    at = np.flatnonzero(pieces.edge > 0)
    if len(at) == 0:
        return
    rows, row = models.rows, row[at]
    slack, edge = pieces.slack[at], pieces.length[at] * pieces.edge[at]
    depth_error[at] += edge * (rows[column.BESIDE].take(row) * slack + rows[column.JUMP].take(row))
    if models.unit_distance is not None:
        depth_error[at] += _touching(models, pieces, at, edge)
    color_error[at] += rows[column.COLOR_BESIDE].take(row) * slack
    light_error[at] += edge * rows[column.JUMP_LIGHT].take(row)


def _touching(models: Models, pieces: Pieces, at: Indices, edge: Floats) -> Floats:
    """Return the most depth of pieces `at` within `edge` (world length) of where the opacity reaches 1.

    There the clear part g = 1 - opacity is a cubic, at most G somewhere on the piece; on the share w of it,
    it reaches G (w / 4)^3 (Remez), and its mean logarithm is at most 3.84 less (see `stages.curved`).
    """
    assert models.unit_distance is not None
    slope = models.rows[column.TOUCHING].take(pieces.row[at])
    change = np.abs(pieces.cubic[1, at] + 0.25 * pieces.cubic[3, at])
    most = np.maximum(slope * change, 1e-300)
    loss = LOGARITHM_LOSS - np.log(np.minimum(most, 1.0)) + 3 * np.log(4 / pieces.edge[at])
    return np.where(slope > 0, edge / models.unit_distance * loss, 0.0)


def _curved(
    models: Models, pieces: Pieces, row: Indices, offset: Floats, steepest_color: Floats, share: float
) -> tuple[Indices, CurvedEmission] | None:
    """Return which pieces have interpolated opacity, and their emission; None if there are none."""
    if models.unit_distance is None:
        return None
    at = np.flatnonzero(row >= models.exact)
    if len(at) == 0:
        return None
    rows, row = models.rows, row[at]
    slope = rows[column.ALPHA1].take(row)
    opacity = rows[column.ALPHA0].take(row) + slope * offset[at]
    # What is clear, from the end where that is least: there it keeps all its digits.
    above_end = np.abs(pieces.cubic[0, at] - rows[column.DENSE_END].take(row))
    light = curved_emission(
        pieces.cubic.take(at, axis=1),
        np.clip(opacity, 0.0, 1.0),
        np.clip(rows[column.LEAST_CLEAR].take(row) + np.abs(slope) * above_end, 0.0, 1.0),
        slope,
        pieces.slack[at],
        pieces.length[at] / models.unit_distance,
        steepest_color[at],
        np.full(len(at), share),
    )
    return at, light


def _unsure_of_opacity(
    models: Models, pieces: Pieces, row: Indices, layout: Layout, astray: float
) -> Indices:
    """Return the pieces that may, or may not, be stopped by something opaque: their P is unknown.

    An opaque piece is sure if some of it is neither near an end of its row nor astray.  A clear one that
    comes within its slack of an opaque row is no matter if the next piece of the ray is surely opaque: it
    begins a little earlier or later.  Otherwise the ray touches what is opaque, or misses it, by rounding.
    """
    rows = models.rows
    opaque = rows[column.IS_OPAQUE].take(row) > 0
    sure = opaque & (pieces.edge + pieces.astray < 1)
    below, above = rows[column.OPAQUE_BELOW].take(row) > 0, rows[column.OPAQUE_ABOVE].take(row) > 0
    beside = np.flatnonzero(below | above)
    touches = np.zeros(len(row), np.bool_)
    if len(beside):
        low, high = value_range(pieces.cubic.take(beside, axis=1))
        slack = pieces.slack.take(beside) + astray
        bend = np.maximum(row[beside] - models.exact, 0)
        touches[beside] = (below[beside] & (low - slack <= models.bends.take(bend))) | (
            above[beside] & (high + slack >= models.bends.take(bend + 1))
        )
    stopped = np.append(sure[1:], False)
    stopped[layout.last] = False
    return np.flatnonzero((opaque & ~sure) | (touches & ~stopped & ~opaque))
