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
from volref.truth.fields.polar import PolarField
from volref.truth.march import march_chunk
from volref.truth.modes.reductions import Reducible, prepare_reduction, reduce_pixels
from volref.truth.modes.sampled import sample_pixels
from volref.truth.modes.shading import LitSurface
from volref.workspace import Workspace


@dataclass(frozen=True, eq=False)
class Integrated:
    """The pixels of a part: rgba (R, 4), bound (R,), values interpolated or pieces made, and by whom.

    hit (R,): distance of an isosurface, +inf where the ray meets none; None in other modes.
    """

    rgba: Floats
    bound: Floats
    samples: int
    worker: tuple[str, int, int]
    hit: Floats | None = None


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

    @cached_property
    def reducible(self) -> Reducible:
        """The volume made ready to be reduced to one value of each ray."""
        return prepare_reduction(self.scene)

    @cached_property
    def lit_surface(self) -> LitSurface:
        """The gradient made ready for an isosurface in the light."""
        return LitSurface(self.scene, self.plan)

    def make_ready(self) -> None:
        """Make the volume ready for the method of the plan, before threads need it."""
        if self.plan.method == "march":
            _ = self.field
        elif self.scene.mode == "composite":
            _ = self.prepared
        else:
            _ = self.reducible, self.lit_surface if self.scene.lights_volume else None

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
        scene = self.scene
        if scene.mode != "composite":
            return self._reduced(pixels, begin, end, behind, tolerance)
        if self.plan.method == "march":
            chunk = march_chunk(scene, self.plan, self.field, pixels, begin, end, behind, _workspace())
            return Integrated(chunk.rgba, chunk.bound, chunk.samples, worker())
        done = integrate_pixels(scene, self.prepared, pixels, begin, end, behind, tolerance)
        return Integrated(done.rgba, done.bound, done.pieces, worker())

    def _reduced(
        self, pixels: Indices, begin: Floats | float, end: Floats, behind: Floats, tolerance: float
    ) -> Integrated:
        """Reduce the rays of `pixels` to one value, exactly on a grid and else by samples."""
        scene = self.scene
        if self.plan.method == "march":
            assert isinstance(self.field, PolarField)
            found = sample_pixels(scene, self.plan, self.field, pixels, begin, end, behind)
            return Integrated(found.rgba, found.bound, found.samples, worker(), self._hits(found.hit))
        done = reduce_pixels(scene, self.reducible, pixels, begin, end, behind, tolerance)
        rgba, bound = done.rgba, done.bound
        if scene.lights_volume:
            rays = pixel_rays(scene.camera, scene.width, scene.height, pixels)
            rgba, bound = self.lit_surface.shade(rays, done.hit, done.off, rgba, bound)
        return Integrated(rgba, bound, done.pieces, worker(), self._hits(done.hit))

    def _hits(self, hit: Floats) -> Floats | None:
        return hit if self.scene.mode == "isosurface" else None


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
