"""VTK's colour and opacity functions (vtkColorTransferFunction, vtkPiecewiseFunction) as linear pieces.

Between two nodes VTK moves the midpoint and bends the curve by a sharpness, and interpolates colours in
HSV, CIELAB or Msh.  With u = 0..1 from one node to the next:

    s = u / (2 m) below the midpoint m, 1/2 + (u - m) / (2 - 2 m) above it
    k < 0.01           weight s
    0.01 <= k          p = (2 s)^(1 + 10 k) / 2, mirrored above 1/2, and
                       weight 3 p^2 - 2 p^3 + (1 - k) p (1 - p) (1 - 2 p)
    k > 0.99           of colours only: the first node's for s < 1/2, then the second's, a jump

VTK up to 9.0 and vtk.js have that jump in opacities too; here VTK 9.7 is followed, in all.

The result is cut into linear pieces until no channel is off by more than `TOLERANCE`; values beyond the
outer nodes are those of the nodes.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import Booleans, Floats, Indices, float_array
from volref.errors import SceneError
from volref.io.vtk_colors import diverging, hsv_of_rgb, lab_of_rgb, nearer_hues, rgb_of_hsv, rgb_of_lab

SPACES = ("RGB", "HSV", "Lab", "CIELAB", "Diverging", "wrapped HSV")

# How far a linear piece may be from VTK's curve, and by how much the ends of two pieces may differ and yet be
# one knot: together below 1e-4.
TOLERANCE = 2.5e-5
SAME = 5e-5

MOST_NODES = 65536
LARGEST = 1e300  # differences of values stay finite
MOST_ROUNDS = 12  # 2^12 pieces between two nodes


@dataclass(frozen=True, eq=False)
class Curve:
    """Linear pieces: knots (K,), non-decreasing, at most two equal, and channels (c, K) at them."""

    knots: Floats
    channels: Floats


@dataclass(frozen=True, eq=False)
class _Nodes:
    """Nodes in order: x (n,), channels (c, n), midpoint (n,), sharpness (n,), infinite for a jump."""

    x: Floats
    channels: Floats
    midpoint: Floats
    sharpness: Floats


def color_curve(nodes: ArrayLike, space: str) -> Curve:
    """Return red, green and blue of VTK nodes (n, 4) x r g b, or (n, 6) with midpoint and sharpness."""
    return _curve("color nodes", nodes, 3, space)


def opacity_curve(nodes: ArrayLike) -> Curve:
    """Return one channel of VTK nodes (n, 2) x y, or (n, 4) with midpoint and sharpness.

    Examples
    --------
    >>> opacity_curve([(0, 0, 0.25, 0), (8, 1, 0.5, 0)]).knots.tolist()
    [0.0, 2.0, 8.0]
    """
    return _curve("opacity nodes", nodes, 1, "RGB")


def joined(*curves: Curve) -> tuple[Floats, Floats]:
    """Return the knots of all curves together, and all their channels at them; jumps stay jumps.

    Examples
    --------
    >>> ramp = Curve(np.array([0.0, 4.0]), np.array([[0.0, 1.0]]))
    >>> step = Curve(np.array([2.0, 2.0]), np.array([[0.0, 1.0]]))
    >>> knots, channels = joined(ramp, step)
    >>> knots.tolist(), channels.tolist()
    ([0.0, 2.0, 2.0, 4.0], [[0.0, 0.5, 0.5, 1.0], [0.0, 0.0, 1.0, 1.0]])
    """
    at = np.unique(np.concatenate([curve.knots for curve in curves]))
    before = np.concatenate([_values(curve, at, side="left") for curve in curves])
    after = np.concatenate([_values(curve, at, side="right") for curve in curves])
    jumps = (before != after).any(axis=0)
    repeats = np.where(jumps, 2, 1)
    channels = np.repeat(after, repeats, axis=1)
    channels[:, np.cumsum(repeats)[jumps] - 2] = before[:, jumps]
    return np.repeat(at, repeats), channels


def _values(curve: Curve, at: Floats, side: str) -> Floats:
    """Return the channels (c, n) at positions, at a jump those of its left or right `side`."""
    knots = curve.knots
    after = np.searchsorted(knots, at, side="right" if side == "right" else "left")
    low, high = np.maximum(after - 1, 0), np.minimum(after, len(knots) - 1)
    width = knots[high] - knots[low]
    share = np.divide(at - knots[low], width, out=np.zeros(len(at)), where=width > 0)
    first, second = curve.channels[:, low], curve.channels[:, high]
    return np.asarray(np.where(share == 1, second, first + share * (second - first)))


@dataclass(frozen=True, eq=False)
class _Stretches:
    """Parts of the way between two nodes: from share `low` to share `high`, above the midpoint or not."""

    node: Indices
    low: Floats
    high: Floats
    upper: Booleans

    def share(self, stretch: Indices, part: Floats) -> Floats:
        """Return how far from one node to the next a `part` 0..1 of a stretch ends."""
        low, high = self.low[stretch], self.high[stretch]
        return np.asarray(np.where(part == 1, high, low + part * (high - low)))


def _curve(name: str, nodes: ArrayLike, channels: int, space: str) -> Curve:
    table = _checked_nodes(name, nodes, channels)
    midpoint, sharpness = np.clip(table[:, -2], 1e-5, 1 - 1e-5), table[:, -1]
    jumps = (sharpness > 0.99) & (channels == 3)
    values = _Nodes(table[:, 0], table[:, 1:-2].T, midpoint, np.where(jumps, np.inf, sharpness))
    stretches = _stretches(values, space)

    def evaluate(stretch: Indices, part: Floats) -> Floats:
        share = stretches.share(stretch, part)
        return _between(values, stretches.node[stretch], share, stretches.upper[stretch], space)

    stretch, part = _refined(len(stretches.node), evaluate, channels)
    node, share = stretches.node[stretch], stretches.share(stretch, part)
    first, second = values.x[node], values.x[node + 1]
    x = np.where(share == 1, second, first + share * (second - first))
    ends = values.channels[:, :1], values.channels[:, -1:]  # what holds beyond the outer nodes
    inside = evaluate(stretch, part)
    return _without_doubles(
        np.concatenate([values.x[:1], x, values.x[-1:]]), np.concatenate([ends[0], inside, ends[1]], axis=1)
    )


def _stretches(nodes: _Nodes, space: str) -> _Stretches:
    """Return the ways between nodes, cut at the midpoint where something bends or jumps there."""
    node = np.flatnonzero(np.diff(nodes.x) > 0)
    middle = nodes.midpoint[node]
    cut = (middle != 0.5) | (nodes.sharpness[node] >= 0.01) | (space == "Diverging")
    whole = np.where(cut, middle, 1.0)
    node = np.concatenate([node, node[cut]])
    low = np.concatenate([np.zeros(len(whole)), middle[cut]])
    high = np.concatenate([whole, np.ones(cut.sum())])
    order = np.lexsort([low, node])
    return _Stretches(node[order], low[order], high[order], low[order] > 0)


def _checked_nodes(name: str, nodes: ArrayLike, channels: int) -> Floats:
    """Return nodes (n, channels + 3): x, the channels, midpoint and sharpness, in order of x."""
    table = float_array(f"transfer {name}", nodes, ("n", "columns"), limit=LARGEST)
    if table.shape[1] == channels + 1:
        table = np.column_stack([table, np.full(len(table), 0.5), np.zeros(len(table))])
    if not 1 <= len(table) <= MOST_NODES:
        message = f"transfer {name} must be 1 to {MOST_NODES}, got {len(table)}; make them fewer"
        raise SceneError(message)
    for what, part in (("channels", table[:, 1:-2]), ("midpoint and sharpness", table[:, -2:])):
        outside = (part < 0) | (part > 1)
        if outside.any():
            i, j = np.argwhere(outside)[0]
            message = f"transfer {name} must have {what} in 0..1, got {part[i, j]:g} at index {i}; change it"
            raise SceneError(message)
    return np.asarray(table[np.argsort(table[:, 0], kind="stable")])


def _between(nodes: _Nodes, node: Indices, share: Floats, upper: Booleans, space: str) -> Floats:
    """Return the channels (c, n) a `share` of the way from each node to the next.

    At the midpoint itself, where a sharp curve jumps, `upper` says which side is meant.
    """
    middle, sharpness = nodes.midpoint[node], nodes.sharpness[node]
    s = np.where(share < middle, 0.5 * share / middle, 0.5 + 0.5 * (share - middle) / (1 - middle))
    first, second = nodes.channels[:, node], nodes.channels[:, node + 1]
    sharp = np.isinf(sharpness)
    bent = (sharpness >= 0.01) & ~sharp
    sharpness = np.where(bent, sharpness, 0.0)
    power = 1 + 10 * sharpness
    p = np.where(s < 0.5, 0.5 * (2 * s) ** power, 1 - 0.5 * np.maximum(2 - 2 * s, 0.0) ** power)
    place = np.where(bent, p, s)
    curved = p * p * (3 - 2 * p) + (1 - sharpness) * p * (1 - p) * (1 - 2 * p)
    weight = np.where(bent, curved, s)
    mixed = _mixed(first, second, weight, place, space)
    return np.asarray(np.where(sharp, np.where(upper, second, first), mixed))


def _mixed(first: Floats, second: Floats, weight: Floats, place: Floats, space: str) -> Floats:
    if space == "Diverging":
        return diverging(first, second, place)  # VTK has no bent curve there
    if space in ("HSV", "wrapped HSV"):
        one, other = hsv_of_rgb(first), hsv_of_rgb(second)
        if space == "wrapped HSV":
            one, other = nearer_hues(one, other)
        hsv = (1 - weight) * one + weight * other
        hsv[0] += hsv[0] < 0
        return rgb_of_hsv(hsv)
    if space in ("Lab", "CIELAB"):
        return rgb_of_lab((1 - weight) * lab_of_rgb(first) + weight * lab_of_rgb(second))
    return np.asarray((1 - weight) * first + weight * second)


def _refined(
    count: int, evaluate: Callable[[Indices, Floats], Floats], channels: int
) -> tuple[Indices, Floats]:
    """Return knots as stretches and parts 0..1 of them, so many that straight lines between them will do.

    A line is held against the curve at three places, to half the tolerance, for what may lie between them.
    """
    stretch, part = np.repeat(np.arange(count), 2), np.tile([0.0, 1.0], count)
    value = evaluate(stretch, part) if count else np.zeros((channels, 0))
    untested = np.flatnonzero(part < 1)
    for _ in range(MOST_ROUNDS):
        low, width = part[untested], part[untested + 1] - part[untested]
        first, rise = value[:, untested], value[:, untested + 1] - value[:, untested]
        off = np.zeros(len(untested))
        for share in (0.25, 0.5, 0.75):
            apart = np.abs(evaluate(stretch[untested], low + share * width) - (first + share * rise))
            np.maximum(off, apart.max(axis=0), out=off)
        bad = untested[off > TOLERANCE / 2]
        if not len(bad):
            break
        middle = (part[bad] + part[bad + 1]) / 2
        value = np.insert(value, bad + 1, evaluate(stretch[bad], middle), axis=1)
        stretch, part = np.insert(stretch, bad + 1, stretch[bad]), np.insert(part, bad + 1, middle)
        moved = bad + np.arange(len(bad))
        untested = np.stack([moved, moved + 1], axis=1).ravel()  # the halves of what was cut
    return stretch, part


def _without_doubles(x: Floats, channels: Floats) -> Curve:
    """Return a curve with one of two knots at one place where nothing jumps; the outer ones stay."""
    double = (np.diff(x) == 0) & (np.abs(np.diff(channels, axis=1)) <= SAME).all(axis=0)
    dropped = np.append(False, double)
    if len(x) > 2 and dropped[-1]:
        dropped[-2:] = True, False
    x, channels = x[~dropped], channels[:, ~dropped]
    # Of more than two at one place only the outer ones are seen.
    hidden = np.zeros(len(x), bool)
    hidden[1:-1] = (x[1:-1] == x[:-2]) & (x[1:-1] == x[2:])
    return Curve(x[~hidden], np.asarray(channels[:, ~hidden]))
