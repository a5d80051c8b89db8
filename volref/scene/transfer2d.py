"""Transfer functions of two numbers: the value of the field, and the magnitude of its gradient.

A table of m rows (magnitude) and n columns (value), looked up as a GPU looks up a texture: bilinearly, with
texel centres.  For n = 4 columns over values from a to b and m = 2 rows over magnitudes from c to d:

    d +-----+-----+-----+-----+
      |  o  |  o  |  o  |  o  |   row 1      column j at a + (b - a) (j + 1/2) / n
      +-----+-----+-----+-----+              row i    at c + (d - c) (i + 1/2) / m
      |  o  |  o  |  o  |  o  |   row 0      clamped beyond the outer centres
    c +-----+-----+-----+-----+
      a                       b

so over values 0..8 and magnitudes 0..2 the entry of row 1, column 3 lies at value 7, magnitude 1.5.
"""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import Booleans, Floats, set_fields
from volref.errors import SceneError
from volref.scene.transfer import TransferFunction
from volref.scene.transfer_checks import (
    at_least_zero,
    checked_domain,
    checked_length,
    checked_units,
    table_of_codes,
)


@dataclass(frozen=True, eq=False, init=False)
class TransferFunction2D:
    """A table from value and gradient magnitude to straight colour and opacity, bilinear between entries.

    Parameters
    ----------
    rgba
        Straight colours, at least 0, and opacities in 0..1: shape (m, n, 4), rows by gradient magnitude,
        columns by value.  Whole numbers are codes: a table of uint8 is divided by 255.
    value_domain
        Values at the left edge of column 0 and the right edge of column n - 1.
    magnitude_domain
        Magnitudes at the outer edges of the rows, in value units per world unit.
    unit_distance
        The world length for which the opacity is meant.
    units
        Unit of the values, for people.

    Raises
    ------
    SceneError
        If a field breaks one of these rules.

    Examples
    --------
    >>> table = np.zeros((2, 4, 4), np.uint8)
    >>> table[1, 3] = 255  # white and opaque where value and gradient are large
    >>> transfer = TransferFunction2D(table, (0, 8), (0, 2))
    >>> transfer.most_opacity(0.0, 5.0), transfer.most_opacity(0.0, 6.0)
    (0.0, 0.5)
    """

    rgba: Floats
    value_domain: tuple[float, float]
    magnitude_domain: tuple[float, float]
    unit_distance: float
    units: str

    def __init__(
        self,
        rgba: ArrayLike,
        value_domain: tuple[float, float],
        magnitude_domain: tuple[float, float],
        unit_distance: float = 1.0,
        *,
        units: str = "",
    ) -> None:
        table = at_least_zero("transfer.rgba", table_of_codes(rgba, ("m", "n", 4)), ("m", "n", 4))
        if table.size == 0:
            message = f"transfer.rgba must have at least one entry, got shape {table.shape}; give some"
            raise SceneError(message)
        if (table[..., 3] > 1).any():
            row, column = (int(i) for i in np.argwhere(table[..., 3] > 1)[0])
            message = f"transfer.rgba must hold opacities in 0..1, got {table[row, column, 3]:g} at index "
            raise SceneError(message + f"({row}, {column}, 3); divide by the largest code")
        set_fields(
            self,
            rgba=table,
            value_domain=checked_domain("transfer.value_domain", value_domain),
            magnitude_domain=checked_domain("transfer.magnitude_domain", magnitude_domain),
            unit_distance=checked_length(unit_distance),
            units=checked_units(units),
        )

    @property
    def interpolation(self) -> str:
        """What is linear between entries: "opacity", always."""
        return "opacity"

    @property
    def colors_max(self) -> Floats:
        """The greatest red, green and blue (3,) of any entry."""
        return np.asarray(self.rgba[..., :3].max(axis=(0, 1)))

    @property
    def envelope(self) -> TransferFunction:
        """The transfer function of the value alone that is nowhere below this one, whatever the gradient.

        Its knots are the columns, with the greatest colours and opacity of each.
        """
        most = self.rgba.max(axis=0)
        return TransferFunction.from_lut(most, self.value_domain, self.unit_distance, units=self.units)

    def most_opacity(self, low: float, high: float) -> float:
        """Return the greatest opacity of any value from `low` to `high`, at most, with any gradient.

        It is that of the envelope: reached at the columns, and at most too large between them.
        """
        envelope = self.envelope
        opacity = np.asarray(envelope.opacity)
        inside = (envelope.values >= low) & (envelope.values <= high)
        return float(max(np.interp([low, high], envelope.values, opacity).max(), *opacity[inside], 0.0))

    def is_visible(self, low: ArrayLike, high: ArrayLike) -> Booleans:
        """Tell for each range of values from `low` to `high` whether any gradient makes any of it visible.

        Examples
        --------
        >>> table = np.zeros((2, 4, 4))
        >>> table[1, 3] = 1.0
        >>> TransferFunction2D(table, (0, 8), (0, 2)).is_visible([0.0, 4.0], [5.0, 5.1]).tolist()
        [False, True]
        """
        return self.envelope.is_visible(low, high)


# What a scene can be classified by.
AnyTransfer: TypeAlias = TransferFunction | TransferFunction2D
