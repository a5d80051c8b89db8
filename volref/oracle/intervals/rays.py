"""Rays that a machine may cast, each with how far its numbers may be off.

R rays; P pixels.  A pixel has one ray, or several where something decides between them.
"""

import dataclasses
from dataclasses import dataclass

import numpy as np

from volref.arrays import Booleans, Floats, Indices
from volref.emulation.loop.marching import Cut
from volref.emulation.rays.paths import Ends

# Rays of one pixel whose ends are nearer than this, in texture space, are one ray with a radius.
NEAR = 1e-3

# Numbers of a cut.
CUT = ("depth", "step", "surface")


@dataclass(frozen=True, eq=False)
class Rays:
    """Rays that may be cast.

    pixel (R,).  ends: entry and exit (3, R), and the direction of rays without an exit.  entry_off, exit_off,
    along_off (R,): how far each coordinate may be off.  cut, cut_off: depths, and how far they may be off.
    behind (R, 4), covered (R,): colour of the mesh behind the ray, and whether there is one.
    """

    ends: Ends
    entry_off: Floats
    exit_off: Floats
    along_off: Floats
    path_off: Floats
    behind: Floats
    covered: Booleans
    cut: Cut | None = None
    cut_off: Cut | None = None

    @property
    def pixel(self) -> Indices:
        """Pixels (R,)."""
        return self.ends.pixel

    def take(self, at: Indices) -> "Rays":
        """Return some of the rays."""
        along = None if self.ends.along is None else self.ends.along[:, at]
        ends = Ends(self.ends.pixel[at], self.ends.entry[:, at], self.ends.exit[:, at], along=along)
        cut, cut_off = (
            None if one is None else Cut(one.depth[at], one.step[at], one.surface[at], one.early)
            for one in (self.cut, self.cut_off)
        )
        offs = self.entry_off[at], self.exit_off[at], self.along_off[at], self.path_off[at]
        return Rays(ends, *offs, self.behind[at], self.covered[at], cut, cut_off)


def merged(kept: Rays, more: Rays, shaky: Booleans) -> Rays:
    """Return rays with those of another way; of two that are all but equal one, with the radius of both."""
    order = np.argsort(more.pixel, kind="stable")
    first = np.full(len(shaky), -1, np.intp)
    first[kept.pixel[::-1]] = np.arange(len(kept.pixel))[::-1]
    at = first[more.pixel[order]]
    same = at >= 0
    new, old = order[same], at[same]
    apart = [
        np.abs(getattr(more.ends, name)[:, new] - getattr(kept.ends, name)[:, old]).max(axis=0, initial=0.0)
        for name in ("entry", "exit")
    ]
    alike = (apart[0] < NEAR) & (apart[1] < NEAR) & (kept.covered[old] == more.covered[new])
    alike &= np.abs(kept.behind[old] - more.behind[new]).max(axis=1, initial=0.0) <= 1e-3
    if kept.cut is not None and more.cut is not None:
        alike &= np.abs(kept.cut.surface[old] - more.cut.surface[new]) <= 1e-3
    offs = {name: getattr(kept, name).copy() for name in ("entry_off", "exit_off", "path_off")}
    for (name, off), moved in zip(offs.items(), (*apart, np.maximum(*apart)), strict=True):
        np.maximum.at(off, old[alike], moved[alike] + getattr(more, name)[new[alike]])
    widened = dataclasses.replace(kept, **offs)
    extra = np.sort(np.concatenate([new[~alike], order[~same]]))
    return widened if not len(extra) else joined(widened, more.take(extra))


def joined(one: Rays, two: Rays) -> Rays:
    """Return the rays of both."""
    along = None
    if one.ends.along is not None and two.ends.along is not None:
        along = np.concatenate([one.ends.along, two.ends.along], axis=1)
    ends = Ends(
        np.concatenate([one.pixel, two.pixel]),
        np.concatenate([one.ends.entry, two.ends.entry], axis=1),
        np.concatenate([one.ends.exit, two.ends.exit], axis=1),
        one.ends.blank,
        along,
    )
    cuts = (_joined_cuts(one.cut, two.cut), _joined_cuts(one.cut_off, two.cut_off))
    offs = (
        np.concatenate([getattr(one, name), getattr(two, name)])
        for name in ("entry_off", "exit_off", "along_off", "path_off", "behind")
    )
    covered = np.concatenate([one.covered, two.covered])
    entry_off, exit_off, along_off, path_off, behind = offs
    return Rays(ends, entry_off, exit_off, along_off, path_off, behind, covered, *cuts)


def _joined_cuts(one: Cut | None, two: Cut | None) -> Cut | None:
    if one is None or two is None:
        return None
    depth, step, surface = (
        np.concatenate([getattr(one, name), getattr(two, name)]) for name in Cut._fields[:3]
    )
    return Cut(depth, step, surface, one.early)
