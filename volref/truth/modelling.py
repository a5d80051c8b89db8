"""Pieces of rays to integrals of their models: the exact integrator's pass.

n pieces; see `stages.models`, `stages.quadrature` and `stages.curved`.
"""

from dataclasses import dataclass

import numpy as np

from volref.arrays import Booleans, Floats, Indices
from volref.records import Pieces
from volref.stages import models as column
from volref.stages.curved import LOGARITHM_LOSS, curved_emission
from volref.stages.models import Models, rows_of
from volref.stages.quadrature import emission
from volref.stages.radiance import Layout, Modelled, layout_of, sums_in_front
from volref.stages.splitting import value_range

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
    # There, what is seen may differ by a jump, or by as much as the value.
    astray_sigma = min(models.most_sigma, models.most_jump + models.most_slope * astray) if astray else 0.0
    row = _rows(models, pieces)
    rows = models.rows
    seen = np.flatnonzero(rows[column.SEEN].take(row) > 0)
    if len(seen) < len(row):
        pieces, row = pieces.take(seen), row.take(seen)
    layout = layout_of(pieces.ray)
    length, cubic = pieces.length, pieces.cubic
    offset = cubic[0] - rows[column.CENTER].take(row)
    slope, level = rows[column.SIGMA1].take(row), rows[column.SIGMA0].take(row)
    density = np.empty_like(cubic)
    density[0] = level + slope * offset
    np.multiply(cubic[1:], slope, out=density[1:])
    density *= length
    reach = 0.5 * np.abs(cubic[1]) + 0.25 * np.abs(cubic[2]) + 0.125 * np.abs(cubic[3])
    slope = np.abs(slope)
    depth_error = rows[column.SIGMA_OFF].take(row) + slope * (pieces.slack + 128 * ROUNDOFF * reach)
    depth_error += (32 * ROUNDOFF) * level + pieces.astray * astray_sigma
    depth_error *= length
    c1, c2 = rows[column.C1].take(row, axis=1), rows[column.C2].take(row, axis=1)
    color = rows[column.C0].take(row, axis=1) + offset * (c1 + offset * c2)
    c1 += 2 * offset * c2
    c1_size, c2_size = np.abs(c1), np.abs(c2)
    change = (c1_size + c2_size * reach) * reach
    steepest_color = (c1_size + 2 * c2_size * reach).max(axis=0)
    color_error = rows[column.COLOR_OFF].take(row) + steepest_color * pieces.slack
    misplaced = length * pieces.astray * (astray_sigma * float(models.largest.max()))
    _beside(models, pieces, row, depth_error, color_error, misplaced)
    share = np.full(len(row), tolerance * QUADRATURE_SHARE)
    depth = np.maximum(density[0] + density[2] / 12, 0.0)
    steepest = np.abs(density[0]) + 0.5 * np.abs(density[1]) + 0.25 * np.abs(density[2])
    steepest += 0.125 * np.abs(density[3])
    curved = _curved(models, pieces, row, offset, steepest_color, share)
    if curved is not None:
        at, light = curved
        depth[at] = light.depth
    in_front = np.exp(-sums_in_front(np.minimum(depth, OPAQUE), layout))
    weight = in_front * change.max(axis=0) / np.maximum(reach, 1e-300)
    straight = emission(cubic, density, weight, share, second=bool(c2.any()))
    first, error, opacity = straight.first, straight.error, straight.opacity
    unsettled = np.zeros(len(row), np.bool_)
    if curved is not None:
        opacity[at] = -np.expm1(-light.depth)
        first[at], error[at] = light.first, light.error
        depth_error[at] += light.depth_error
        unsettled[at] = ~light.settled
        steepest[at] = np.where(light.settled & (light.depth >= OPAQUE), 0.0, light.depth)
    light_error = error * (c1_size + c2_size * straight.reach)
    shine = color * opacity + c1 * first + c2 * straight.second
    quadrature = in_front * light_error.max(axis=0)
    light_error += misplaced
    integrals = Modelled(
        depth, opacity, in_front, shine, color, change, depth_error, color_error, light_error
    )
    return Solved(pieces, layout, integrals, row, quadrature, np.maximum(steepest, 1e-300), unsettled)


def _rows(models: Models, pieces: Pieces) -> Indices:
    """Return the row of each piece: its own, or that of the run its values lie in."""
    unknown = np.flatnonzero(pieces.row < 0)
    if len(unknown) == 0:
        return pieces.row
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
    """Return the most depth within `edge` (world length) of where the opacity reaches 1, or 0, of pieces `at`.

    There the clear part g = 1 - opacity is a cubic, at most G somewhere on the piece; on the share w of it, it
    reaches G (w / 4)^3 (Remez), and its mean logarithm is at most 3.84 less (see `stages.curved`).
    """
    assert models.unit_distance is not None
    slope = models.rows[column.TOUCHING].take(pieces.row[at])
    change = np.abs(pieces.cubic[1, at] + 0.25 * pieces.cubic[3, at])
    most = np.maximum(slope * change, 1e-300)
    loss = LOGARITHM_LOSS - np.log(np.minimum(most, 1.0)) + 3 * np.log(4 / pieces.edge[at])
    return np.where(slope > 0, edge / models.unit_distance * loss, 0.0)


def _curved(
    models: Models, pieces: Pieces, row: Indices, offset: Floats, steepest_color: Floats, share: Floats
):
    """Return which pieces have interpolated opacity, and their emission; None if there are none."""
    if models.unit_distance is None:
        return None
    at = np.flatnonzero(row >= models.exact)
    if len(at) == 0:
        return None
    rows, row = models.rows, row[at]
    slope = rows[column.ALPHA1].take(row)
    opacity = rows[column.ALPHA0].take(row) + slope * offset[at]
    light = curved_emission(
        pieces.cubic.take(at, axis=1),
        np.clip(opacity, 0.0, 1.0),
        slope,
        pieces.slack[at],
        pieces.length[at] / models.unit_distance,
        steepest_color[at],
        share[at],
    )
    return at, light
