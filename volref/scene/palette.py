"""Which colour channels have to be looked up and composited."""

from dataclasses import dataclass

import numpy as np

from volref.arrays import Booleans, Floats, Indices
from volref.scene.transfer import TransferFunction


@dataclass(frozen=True)
class Palette:
    """The channels that are looked up, 0 to 2, and what red, green and blue are made of.

    source: for each of the three, its number in `looked_up`, or -1 where it has one value, `constant`,
    wherever anything can be seen.

    Examples
    --------
    >>> grey = Palette((0,), (0, 0, 0), (0.0, 0.0, 0.0))
    >>> grey.spread(np.array([[0.5]])).tolist()
    [[0.5], [0.5], [0.5]]
    >>> green = Palette((), (-1, -1, -1), (0.0, 1.0, 0.0))
    >>> green.spread(np.array([[0.75]])).tolist()
    [[0.0], [0.75], [0.0]]
    """

    looked_up: tuple[int, ...]
    source: tuple[int, int, int]
    constant: tuple[float, float, float]

    @property
    def composited(self) -> int:
        """How many channels are composited: those looked up, and the weights if any colour is constant."""
        return len(self.looked_up) + (-1 in self.source)

    def spread(self, color: Floats) -> Floats:
        """Return the premultiplied colour (3, R) of what was composited in each channel (c, R)."""
        spread = np.empty((3, color.shape[1]))
        for channel, source, constant in zip(spread, self.source, self.constant, strict=True):
            np.multiply(color[source], constant if source < 0 else 1.0, out=channel)
        return spread


FULL_PALETTE = Palette((0, 1, 2), (0, 1, 2), (0.0, 0.0, 0.0))


def palette_of(transfer: TransferFunction) -> Palette:
    """Return the palette of `transfer`: equal channels are looked up once, constant ones not at all.

    Examples
    --------
    >>> palette_of(TransferFunction([0, 1], [(0.2, 0.2, 1), (0.8, 0.8, 1)], [0, 1])).source
    (0, 0, -1)
    """
    before, after = _ends_that_show(transfer)
    shown = np.unique(np.append(before, after))
    colors = transfer.colors[shown]
    looked_up: list[int] = []
    source: list[int] = []
    for channel in range(3):
        if len(colors) == 0 or (colors[:, channel] == colors[0, channel]).all():
            source.append(-1)
            continue
        same = [k for k, other in enumerate(looked_up) if (colors[:, channel] == colors[:, other]).all()]
        source.append(same[0] if same else len(looked_up))
        looked_up.extend([] if same else [channel])
    constant = tuple(
        float(colors[0, channel]) if source[channel] < 0 and len(colors) else 0.0 for channel in range(3)
    )
    return Palette(
        tuple(looked_up), (source[0], source[1], source[2]), (constant[0], constant[1], constant[2])
    )


def _ends_that_show(transfer: TransferFunction) -> tuple[Indices, Indices]:
    """Return the knots before and after the pieces in which anything shows, beyond the outer knots too."""
    strength = np.asarray(transfer.opacity if transfer.extinction is None else transfer.extinction)
    shows: Booleans = (strength[:-1] > 0) | (strength[1:] > 0)
    inner = np.flatnonzero(shows)
    outer = [knot for knot in (0, len(strength) - 1) if strength[knot] > 0]
    return np.append(inner, outer).astype(np.intp), np.append(inner + 1, outer).astype(np.intp)
