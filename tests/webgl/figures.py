"""How far real WebGL's targets are from emulated ones.

Only pixels that one of the two has drawn count: where both hold what the target was cleared to, they are
equal without merit.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from volref.formats import codes_of


@dataclass(frozen=True)
class Figures:
    """Figures of one target, or of several taken together.

    error (n,): largest difference of a drawn pixel's channels, in 1/255 for targets of bytes; of floats
    beyond 1, which no screen shows but a formula that adds up to too much gives, in proportion to them.
    unexplained: how many pixels are off by more than 1/255 and were not predicted to hang on a comparison.
    colors: how many different ones the drawn pixels of real WebGL have; flat pictures agree without merit.
    """

    bytes: bool
    error: np.ndarray
    unexplained: int
    colors: int

    @property
    def pixels(self) -> int:
        return len(self.error)

    def percentile(self, percent: float) -> float:
        """Error that so many of a hundred pixels do not exceed."""
        return float(np.percentile(self.error, percent, method="higher")) if self.pixels else 0.0

    @property
    def worst(self) -> float:
        return float(self.error.max(initial=0.0))

    @property
    def exact(self) -> float:
        """Share of pixels that are equal."""
        return float((self.error == 0).mean()) if self.pixels else 1.0

    @property
    def off(self) -> int:
        """How many pixels are off by more than 1/255."""
        return int((self.error > (1 if self.bytes else 1 / 255)).sum())

    def __str__(self) -> str:
        if self.bytes:
            return f"{self.pixels} px, {self.exact:.4%} exact, {self.off} off, {self.unexplained} unexplained"
        shares = ", ".join(f"{name} {self.percentile(p):.1e}" for name, p in (("p50", 50), ("p99", 99)))
        ending = f"max {self.worst:.1e}, {self.off} off, {self.unexplained} unexplained"
        return f"{self.pixels} px, {shares}, {ending}"


def figures(
    ours: np.ndarray,
    theirs: np.ndarray,
    predicted: Callable[[], np.ndarray],
    cleared: Sequence[float],
    met: np.ndarray | None = None,
) -> Figures:
    """Figures of one target: emulated floats (..., C), and bytes or floats (..., C) of real WebGL.

    predicted: which pixels (H, W) hang on a comparison, asked only if one is off by more than 1/255.
    cleared: the colour (C,) or (1,) before anything was drawn.
    met (H, W): pixels that count in its stead, with all that are off.
    """
    assert ours.shape == theirs.shape, f"emulated {ours.shape}, drawn {theirs.shape}"
    whole = theirs.dtype == np.uint8
    empty = np.asarray(cleared, np.float32)
    if whole:
        ours, empty = codes_of(ours), codes_of(empty)
    drawn = ((ours != empty) | (theirs != empty)).any(axis=-1)
    with np.errstate(invalid="ignore"):
        apart = np.abs(ours.astype(np.float64) - theirs.astype(np.float64))
    if not whole:
        apart /= np.fmax(1.0, np.abs(theirs))
    # NaN is equal to NaN and infinitely far from numbers; so is an infinity, and equal to itself.
    apart = np.where((ours == theirs) | (np.isnan(ours) & np.isnan(theirs)), 0.0, apart)
    error = np.where(np.isnan(apart), np.inf, apart).max(axis=-1)
    far = error > (1 if whole else 1 / 255)
    drawn = drawn if met is None else met | far
    off = drawn & far
    unexplained = int((off & ~predicted()).sum()) if off.any() else 0
    return Figures(whole, error[drawn], unexplained, len(np.unique(theirs[drawn], axis=0)))


def together(parts: list[Figures]) -> Figures:
    """Figures of several targets of one kind taken as one."""
    assert len({part.bytes for part in parts}) == 1
    return Figures(
        parts[0].bytes,
        np.concatenate([part.error for part in parts]),
        sum(part.unexplained for part in parts),
        max(part.colors for part in parts),
    )
