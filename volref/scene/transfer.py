"""Transfer functions: from the value of the field to colour and extinction.

Colours are straight (emitted, not weighted) and in the working space.  Between knots the colour is linear
in the value, and so is either the extinction or the opacity, whichever was given.  Beyond the outer knots
the outer ones hold.  Two knots at one value are a jump: values below take the first, the value itself
and those above the second.

A lookup table of n texels over a domain from a to b has its entries at (texel-centre rule, n = 4):

    |--0--|--1--|--2--|--3--|      entry i at a + (b - a) (i + 1/2) / n, clamped beyond the outer centres
    a                       b

so over 0..8 they lie at 1, 3, 5, 7; without texel centres, at a + (b - a) i / (n - 1): 0, 2.67, 5.33, 8.

Gradient opacity is a second, piecewise linear factor in 0..1, of how steeply the field changes there: it
multiplies what is interpolated, be it the extinction or the opacity of a unit distance.
"""

import math
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import Booleans, Floats, one_of, set_fields
from volref.errors import SceneError
from volref.scene.spline import spline_table
from volref.scene.transfer_checks import (
    GradientOpacity,
    at_least_zero,
    checked_domain,
    checked_factors,
    checked_length,
    checked_positions,
    checked_units,
    share,
    table_of_codes,
)

INTERPOLATIONS = ("extinction", "opacity")


@dataclass(frozen=True, eq=False, init=False)
class TransferFunction:
    """A piecewise linear map from value to colour and to extinction or opacity.

    Parameters
    ----------
    values
        Positions of the knots (K,), non-decreasing, in the units of the volume's values.
    colors
        Straight colours (K, 3), at least 0.
    extinction
        Extinction at the knots (K,) per world unit, at least 0.  Exactly one of `extinction` and `opacity`
        is given; that one is interpolated.
    opacity
        Opacity at the knots (K,) in 0..1 of a layer `unit_distance` thick.  Between knots
        extinction = -log1p(-opacity) / unit_distance; an opacity of 1 ends a ray.
    unit_distance
        The world length for which `opacity` is meant.
    gradient_opacity
        Magnitudes (G,) of the gradient, non-decreasing, in value units per world unit, and factors (G,) in
        0..1 of the extinction or opacity, whichever is interpolated; linear between, held beyond the ends.
        Two equal magnitudes are a jump.  None is 1 everywhere.
    units
        Unit of the values, for people: "HU", "dBZ".

    Raises
    ------
    SceneError
        If a field breaks one of these rules.

    Examples
    --------
    >>> tf = TransferFunction([0, 10], [(0, 0, 0), (1, 1, 1)], [0.0, 2.0])
    >>> tf.interpolation, tf.opacity is None
    ('extinction', True)
    """

    values: Floats
    colors: Floats
    extinction: Floats | None
    opacity: Floats | None
    unit_distance: float
    gradient_opacity: tuple[Floats, Floats] | None
    units: str

    def __init__(
        self,
        values: ArrayLike,
        colors: ArrayLike,
        extinction: ArrayLike | None = None,
        opacity: ArrayLike | None = None,
        unit_distance: float = 1.0,
        *,
        gradient_opacity: GradientOpacity | None = None,
        units: str = "",
    ) -> None:
        if (extinction is None) == (opacity is None):
            given = "neither" if extinction is None else "both"
            message = f"transfer must have one of extinction and opacity, got {given}; "
            raise SceneError(message + "give the one that is linear between the knots")
        knots = checked_positions("transfer.values", values)
        count = (len(knots),)
        set_fields(
            self,
            values=knots,
            colors=at_least_zero("transfer.colors", colors, (*count, 3)),
            extinction=None
            if extinction is None
            else at_least_zero("transfer.extinction", extinction, count),
            opacity=None if opacity is None else share("transfer.opacity", opacity, count),
            unit_distance=checked_length(unit_distance),
            gradient_opacity=None if gradient_opacity is None else checked_factors(gradient_opacity),
            units=checked_units(units),
        )

    @classmethod
    def from_opacity(
        cls,
        values: ArrayLike,
        colors: ArrayLike,
        opacity: ArrayLike,
        unit_distance: float = 1.0,
        *,
        interpolation: str = "opacity",
        gradient_opacity: GradientOpacity | None = None,
        units: str = "",
    ) -> Self:
        """Transfer function of opacities, as GPU tables hold them.

        `interpolation="opacity"` keeps the opacity linear between knots; "extinction" takes the extinction
        -log1p(-opacity) / unit_distance at the knots and keeps that linear, and refuses opacity 1.

        Examples
        --------
        >>> colors = [(1, 1, 1)] * 2
        >>> tf = TransferFunction.from_opacity([0, 1], colors, [0, 0.5], 2.0, interpolation="extinction")
        >>> (tf.extinction * 2.0 / np.log(2.0)).tolist()
        [0.0, 1.0]
        """
        one_of("interpolation", interpolation, INTERPOLATIONS)
        extinction = None
        if interpolation == "extinction":
            extinction = _extinction_of(
                share("transfer.opacity", opacity, ("K",)), checked_length(unit_distance)
            )
        return cls(
            values,
            colors,
            extinction,
            opacity if extinction is None else None,
            unit_distance,
            gradient_opacity=gradient_opacity,
            units=units,
        )

    @classmethod
    def from_lut(
        cls,
        rgba: ArrayLike,
        domain: tuple[float, float],
        unit_distance: float = 1.0,
        *,
        texel_centers: bool = True,
        interpolation: str = "opacity",
        gradient_opacity: GradientOpacity | None = None,
        units: str = "",
    ) -> Self:
        """Transfer function of a lookup table (n, 4) with straight colours, spread over `domain`.

        Integer tables are codes and are divided by their type's largest value (255 for uint8).
        `texel_centers=True` places entry i at (i + 1/2) / n of the domain, as a texture lookup at
        (value - a) / (b - a) does; False places it at i / (n - 1).

        Examples
        --------
        >>> table = np.zeros((4, 4))
        >>> TransferFunction.from_lut(table, (0, 8)).values.tolist()
        [1.0, 3.0, 5.0, 7.0]
        """
        table = table_of_codes(rgba, ("n", 4))
        first, last = checked_domain("transfer.domain", domain)
        count = len(table)
        if count < (1 if texel_centers else 2):
            message = f"transfer.rgba must have more entries, got {count}; give at least 2"
            raise SceneError(message)
        index = np.arange(count)
        place = (index + 0.5) / count if texel_centers else index / (count - 1)
        return cls.from_opacity(
            first + (last - first) * place,
            table[:, :3],
            table[:, 3],
            unit_distance,
            interpolation=interpolation,
            gradient_opacity=gradient_opacity,
            units=units,
        )

    @classmethod
    def from_spline(
        cls,
        values: ArrayLike,
        colors: ArrayLike,
        opacity: ArrayLike,
        unit_distance: float = 1.0,
        *,
        samples: int = 256,
        kind: str = "natural",
        texel_centers: bool = True,
        interpolation: str = "opacity",
        gradient_opacity: GradientOpacity | None = None,
        units: str = "",
    ) -> Self:
        """Transfer function of a cubic spline through control points, baked to a table of `samples` entries.

        The table spreads over the values from the first control point to the last, its entries placed as in
        `from_lut`, and is linear between them: what a program draws that uploads the spline as a texture.
        Colours (K, 3) and opacities (K,) of the control points lie in 0..1, and the spline is held to that.

        `kind` is "natural", "clamped" (slope 0 at the ends), "not-a-knot", "catmull-rom", or "monotone"
        (PCHIP), which alone never swings beyond the control points.

        Examples
        --------
        >>> colors = [(0, 0, 0), (0.5, 0.5, 0.5), (1, 1, 1)]
        >>> spline = TransferFunction.from_spline([0, 1, 2], colors, [0, 0.8, 0], samples=4)
        >>> spline.values.tolist(), spline.opacity.round(6).tolist()
        ([0.25, 0.75, 1.25, 1.75], [0.29375, 0.73125, 0.73125, 0.29375])
        """
        table, domain = spline_table(values, colors, opacity, samples, kind, texel_centers=texel_centers)
        return cls.from_lut(
            table,
            domain,
            unit_distance,
            texel_centers=texel_centers,
            interpolation=interpolation,
            gradient_opacity=gradient_opacity,
            units=units,
        )

    @property
    def interpolation(self) -> str:
        """What is linear between knots: "extinction" or "opacity"."""
        return "extinction" if self.extinction is not None else "opacity"

    @property
    def knot_extinction(self) -> Floats:
        """Extinction at the knots (K,) per world unit, infinite where the opacity is 1."""
        if self.opacity is None:
            return np.asarray(self.extinction)
        with np.errstate(divide="ignore"):
            return np.asarray(-np.log1p(-self.opacity) / self.unit_distance)

    def most_extinction(self, low: float, high: float) -> float:
        """Return the greatest extinction of any value from `low` to `high`, infinite where the opacity is 1.

        Examples
        --------
        >>> TransferFunction([0, 2, 9], np.ones((3, 3)), [0, 4, 1]).most_extinction(0.0, 1.0)
        2.0
        """
        strength = np.asarray(self.opacity if self.extinction is None else self.extinction)
        inside = (self.values >= low) & (self.values <= high)
        most = max(np.interp([low, high], self.values, strength).max(), *strength[inside], 0.0)
        if self.extinction is not None:
            return float(most)
        return math.inf if most >= 1 else -math.log1p(-most) / self.unit_distance

    def is_visible(self, low: ArrayLike, high: ArrayLike) -> Booleans:
        """Tell for each range of values from `low` to `high` whether anything in it has an opacity above 0.

        Examples
        --------
        >>> transfer = TransferFunction([0, 1, 2, 3], np.ones((4, 3)), [0, 0, 5, 5])
        >>> transfer.is_visible([0.0, 0.0, 1.5, 4.0], [1.0, 1.01, 1.6, 4.0]).tolist()
        [False, True, True, True]
        """
        seen = np.asarray(self.opacity if self.extinction is None else self.extinction) > 0
        knots, high = self.values, np.asarray(high)
        seen_before = np.concatenate([[0], np.cumsum(seen)])
        first = np.searchsorted(knots, low, side="left")
        last = np.searchsorted(knots, high, side="right")
        seen_knot_inside = seen_before[last] > seen_before[first]
        # A piece that reaches into the range from a knot outside is seen where that knot is.
        seen_from_below = (first > 0) & seen[first - 1]
        reaches_above = (last < len(knots)) & ((last == 0) | (high > knots[last - 1]))
        seen_from_above = reaches_above & seen[np.minimum(last, len(knots) - 1)]
        return np.asarray(seen_knot_inside | seen_from_below | seen_from_above)


def _extinction_of(opacity: Floats, unit_distance: float) -> Floats:
    if (opacity == 1).any():
        message = "transfer.opacity must stay below 1 where extinction is interpolated, got 1 at index "
        message += f"{int(np.argmax(opacity == 1))}; lower it or use interpolation='opacity'"
        raise SceneError(message)
    return np.asarray(-np.log1p(-opacity) / unit_distance)
