"""Where samples lie in the sweeps of a radar, with how far their angles may be off (seed 001, eq. 18 to 20).

n points.  A place off by d moves the distance r by up to d sqrt 3, an elevation by that over r, an azimuth by
that over the distance from the axis.
"""

from collections.abc import Iterator

import numpy as np

from volref.arrays import Booleans, Floats, Indices
from volref.emulation.textures.radar_image import PolarGrid
from volref.emulation.textures.slices import SlicePair
from volref.emulation.textures.spherical import placed_between, spherical
from volref.oracle.intervals.finding import Finder

# How far polynomials for angles may be from what is emulated: one rounding of each of their terms.
ANGLE_ROUNDINGS = 16


def polar_pairs(
    finder: Finder, grid: PolarGrid, position: Floats, radius: Floats
) -> Iterator[tuple[Indices, SlicePair, Floats, Floats, Booleans, Booleans]]:
    """Yield the sweeps around points (3, n), then those of the ones that may lie between others.

    Each time: which points, their pair, how far off in the image (n,), how far off between the sweeps (n,),
    which may be seen, and which may not.
    """
    volume, device = finder.textures.pipeline.volume, finder.textures.device
    printed = volume.geometry == "spherical-printed"
    r, phi, theta = (one.astype(np.float64) for one in spherical(position, device, printed=printed))
    unit = finder.slack.control
    moved = 1.7321 * radius + 4 * unit
    q = position.astype(np.float64) - (0.0 if printed else 0.5)
    axis = np.hypot(q[0], q[1])
    phi_off = np.minimum(moved / np.maximum(axis, 1e-12) + ANGLE_ROUNDINGS * unit * 4, 6.3)
    ratio = np.abs(q[2]) / np.maximum(phi if printed else r, 1e-12)
    below = np.maximum(phi if printed else r, 1e-12)
    ratio_off = (moved + ratio * (phi_off if printed else moved)) / below + 4 * unit
    slope = np.sqrt(np.maximum(1 - np.minimum(ratio + ratio_off, 1) ** 2, 1e-12))
    theta_off = np.minimum(ratio_off / slope, np.sqrt(2 * ratio_off)) + ANGLE_ROUNDINGS * unit * 4
    theta_off = np.where(np.isnan(theta), 4.0, theta_off)
    tilt = np.pi / 2 - theta
    along_off = moved / grid.span + 4 * unit
    turn_off = phi_off / (2 * np.pi) + 4 * unit
    places = np.maximum(turn_off * grid.columns, along_off * grid.gates)
    places = places / max(finder.textures.volume.sizes) + 4 * unit
    everywhere = np.arange(len(r))
    for number, shift in enumerate((0.0, -1.0, 1.0)):
        at = everywhere
        bent = tilt
        if number:
            bent = tilt + shift * 1.01 * theta_off
            at = np.flatnonzero(_sweep(grid, bent) != _sweep(grid, tilt))
            if not len(at):
                continue
        pair, seen = placed_between(
            volume,
            grid,
            (position[:, at], r[at].astype(position.dtype), phi[at].astype(position.dtype)),
            bent[at],
        )
        gap = _gap(grid, pair.first.astype(np.intp))
        with np.errstate(divide="ignore", invalid="ignore"):
            share_off = np.where(gap > 0, 2.01 * theta_off[at] / gap, 0.0) + 4 * unit
        if volume.between == "x":
            share_off = turn_off[at] * len(grid.tilts)
        maybe, maybe_not = _sight(
            grid, tilt[at], theta_off[at], (r[at] - grid.start) / grid.span, along_off[at], seen
        )
        yield at, pair, places[at] * (1 if number == 0 else 2), share_off, maybe, maybe_not


def _sweep(grid: PolarGrid, tilt: Floats) -> Indices:
    return np.asarray(np.searchsorted(grid.tilts, tilt, side="right"))


def _gap(grid: PolarGrid, first: Indices) -> Floats:
    above = np.minimum(first + 1, len(grid.tilts) - 1)
    return np.asarray(grid.tilts[above] - grid.tilts[first])


def _sight(
    grid: PolarGrid, tilt: Floats, tilt_off: Floats, along: Floats, along_off: Floats, seen: Booleans
) -> tuple[Booleans, Booleans]:
    """Return which points may lie between sweeps and gates, and which may not."""
    edges = [(tilt - grid.tilts[0], tilt_off), (grid.tilts[-1] - tilt, tilt_off)]
    edges += [(along, along_off), (1 - along, along_off)]
    may, may_not = np.ones(len(tilt), np.bool_), np.zeros(len(tilt), np.bool_)
    for distance, off in edges:
        may &= ~(distance < -off)
        may_not |= ~(distance > off)
    if len(grid.tilts) < 2:
        return seen, ~seen
    return may, may_not
