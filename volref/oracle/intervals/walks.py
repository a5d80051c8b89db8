"""The paths of rays, and how far their steps and lengths may be off."""

from dataclasses import dataclass

import numpy as np

from volref.arrays import Floats, Indices, Integers
from volref.emulation.drawing import Drawing
from volref.emulation.rays.paths import Paths, paths_of
from volref.oracle.intervals.rays import Rays
from volref.oracle.intervals.slack import Slack
from volref.scene.volume import Volume


@dataclass(frozen=True, eq=False)
class Walks:
    """Paths of rays, and how far their numbers may be off.

    All are (R,).  entry_off, exit_off, path_off: as in `Rays`; delta_off: coordinates of a step; length_off,
    step_off: what is walked and by how much at a time; count_off: steps more or fewer; relative: the
    direction, in parts of itself.
    """

    paths: Paths
    entry_off: Floats
    exit_off: Floats
    path_off: Floats
    delta_off: Floats
    length_off: Floats
    step_off: Floats
    count_off: Integers
    relative: Floats

    def take(self, chosen: Indices) -> "Walks":
        """Return those of some of the rays."""
        offs = (getattr(self, name)[chosen] for name in self.__dataclass_fields__ if name != "paths")
        return Walks(self.paths.take(chosen), *offs)


def walks_of(rays: Rays, drawing: Drawing, slack: Slack) -> Walks:
    """Return the paths of rays with what they may be off."""
    stepping, unit = drawing.pipeline.stepping, slack.control
    with np.errstate(divide="ignore", invalid="ignore"):
        paths = paths_of(rays.ends, drawing.scene, drawing.pipeline, drawing.box, drawing.device)
        ray = np.linalg.norm((rays.ends.exit - rays.ends.entry).astype(np.float64), axis=0)
        off = rays.entry_off + rays.exit_off
        # Of a ray of length L the direction is off by its ends' errors over L, and by roundings: those of
        # squares and their sum (half as much in the root), of a root, a division and a product.
        relative = np.where(ray > 0, 1.7321 * off / ray, 1.0) + 4 * unit + 2 * slack.division
        step = np.abs(paths.delta).max(axis=0).astype(np.float64)
        zero, count_off = np.zeros_like(ray), np.zeros(len(ray), np.int64)
        if stepping.rule == "count":
            # Ends that are known, as bytes are, are divided alike where divisions are rounded correctly.
            alike = (off == 0) & (drawing.device.freedom == "rounded")
            delta_off = off / stepping.steps + (unit + slack.division) * step * ~alike
            length_off = zero
            step_off = zero + slack.division * paths.step * (drawing.device.freedom == "khronos")
        elif stepping.rule == "voxel-count":
            count_off = _count_off(relative, rays, drawing)
            count = np.maximum(paths.count, 1)
            delta_off = off / count + (2 * unit + slack.division + count_off / count) * step
            length_off, step_off = zero, zero
        elif rays.ends.along is not None:
            relative = rays.along_off + 6 * unit
            delta_off = (rays.along_off + 2 * unit) * paths.texture_step
            length_off, step_off = relative * paths.length, rays.along_off * paths.step
        else:
            delta_off, length_off = relative * step, relative * paths.length
            step_off = relative * paths.step if stepping.end == "length-after" else zero
    delta_off, length_off, step_off = (_known(one) for one in (delta_off, length_off, step_off))
    ends = rays.entry_off, rays.exit_off, rays.path_off
    direction = np.minimum(np.nan_to_num(relative, nan=1.0), 1.0)
    return Walks(paths, *ends, delta_off, length_off, step_off, count_off, direction)


def _known(off: Floats) -> Floats:
    """Return how far numbers may be off, by 1 where the ray has no direction."""
    return np.nan_to_num(off.astype(np.float64), nan=1.0, posinf=1.0)


def _count_off(relative: Floats, rays: Rays, drawing: Drawing) -> Integers:
    """Return by how many the number of steps may be off (R,): by one where it is near to the next number."""
    assert isinstance(drawing.scene.volume, Volume)
    size = np.array(drawing.scene.volume.size, np.float64)[:, None]
    voxels = np.linalg.norm((rays.ends.exit - rays.ends.entry).astype(np.float64) * size, axis=0)
    steps = voxels / (drawing.pipeline.stepping.length or 1.0) + 0.5
    near = np.abs(steps - np.rint(steps)) <= relative * steps
    return np.asarray(near.astype(np.int64))
