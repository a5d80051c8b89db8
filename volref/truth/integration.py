"""A scene's volume made ready for either integrator, and the pixels that come of it.

R pixels of a part.
"""

import os
import socket
import threading
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from volref.arrays import Floats, Indices
from volref.planning import Plan
from volref.scene.scene import Scene
from volref.stages.rays import pixel_rays
from volref.stages.spans import clip_spans
from volref.truth.exact import Prepared, integrate_pixels, prepare
from volref.truth.fields import Field, field_of
from volref.truth.march import march_chunk
from volref.workspace import Workspace


@dataclass(frozen=True, eq=False)
class Integrated:
    """The pixels of a part: rgba (R, 4), bound (R,), values interpolated or pieces made, and by whom."""

    rgba: Floats
    bound: Floats
    samples: int
    worker: tuple[str, int, int]


@dataclass(frozen=True, eq=False)
class Integration:
    """A scene with the plan to follow; its volume is made ready when it is first needed.

    `tolerance` is what the exact integrator aims at; the marcher's step follows from the plan.
    """

    scene: Scene
    plan: Plan

    @cached_property
    def field(self) -> Field:
        """The volume made ready for the marcher."""
        return field_of(self.scene, self.plan)

    @cached_property
    def prepared(self) -> Prepared:
        """The volume made ready for the exact integrator."""
        return prepare(self.scene, self.plan)

    def make_ready(self) -> None:
        """Make the volume ready for the method of the plan, before threads need it."""
        _ = self.field if self.plan.method == "march" else self.prepared

    def integrate(self, pixels: Indices, distance: Floats, behind: Floats, tolerance: float) -> Integrated:
        """Integrate the rays of `pixels` to `distance` (R,), or to where they are cut off, over `behind`."""
        begin, end = self.limits(pixels, distance)
        return self.between(pixels, begin, end, behind, tolerance)

    def limits(self, pixels: Indices, distance: Floats) -> tuple[Floats | float, Floats]:
        """Return where the rays of `pixels` begin, and where they end if not at `distance` (R,)."""
        scene = self.scene
        if not scene.clip:
            return 0.0, distance
        kept = clip_spans(pixel_rays(scene.camera, scene.width, scene.height, pixels), scene.clip)
        return kept.t_near, np.minimum(kept.t_far, distance)

    def between(
        self, pixels: Indices, begin: Floats | float, end: Floats, behind: Floats, tolerance: float
    ) -> Integrated:
        """Integrate the rays of `pixels` from `begin` (R,) to `end` (R,) over what lies `behind` (R, 4)."""
        if self.plan.method == "march":
            chunk = march_chunk(self.scene, self.plan, self.field, pixels, begin, end, behind, _workspace())
            return Integrated(chunk.rgba, chunk.bound, chunk.samples, worker())
        done = integrate_pixels(self.scene, self.prepared, pixels, begin, end, behind, tolerance)
        return Integrated(done.rgba, done.bound, done.pieces, worker())


_OWN = threading.local()


def _workspace() -> Workspace:
    """Return the workspace of this thread."""
    if not hasattr(_OWN, "work"):
        _OWN.work = Workspace()
    work: Workspace = _OWN.work
    return work


def worker() -> tuple[str, int, int]:
    """Return which thread of which process on which machine this is."""
    return socket.gethostname(), os.getpid(), threading.get_ident()
