"""Why a ray of a program ended: one sentence, from the loop's own arithmetic.

The loop tests in this order: its own end where that is tested before a sample, the mesh, the sample, its own
end where that is tested after it together with alpha, the cap.
"""

import dataclasses
import operator

import numpy as np

from volref.arrays import Indices
from volref.emulation.loop.marching import LONGEST_LOOP, Marched, Program, march
from volref.emulation.textures.mipmaps import LANES


def why_ended(program: Program, marched: Marched, ray: int) -> str:
    """Return why a ray of a program ended, after the samples that it has taken."""
    stepping, count = program.textures.pipeline.stepping, int(marched.samples[ray])
    after = f"after {count} sample{'s' * (count != 1)}"
    if marched.hit[ray]:
        return f"mesh met {after}: {_depths(program, ray, count)}"
    alpha = marched.alpha[ray]
    if stepping.opaque_at is not None:
        above = stepping.opaque_test == "above"
        test, sign = (operator.gt, ">") if above else (operator.ge, ">=")
        if test(alpha, alpha.dtype.type(stepping.opaque_at)):
            return f"alpha {alpha:.9g} {sign} {stepping.opaque_at:g} {after}"
    if count == (stepping.cap or LONGEST_LOOP) and _goes_on(program, ray, count):
        return f"the loop has run {count} times, its cap"
    return f"{_own_end(program, ray)}, {after}"


def quad_of(program: Program, ray: int) -> Indices:
    """Return the rays that are walked with one: itself, or its quad where the table has mip levels."""
    if not program.textures.levels:
        return np.array([ray])
    return ray // LANES * LANES + np.arange(LANES)


def _goes_on(program: Program, ray: int, count: int) -> bool:
    """Tell whether a ray would take another sample if the loop's cap were one more."""
    if count == LONGEST_LOOP:
        return True
    pipeline = program.textures.pipeline.with_switches(stepping={"cap": count + 1})
    textures = dataclasses.replace(program.textures, pipeline=pipeline)
    further = march(dataclasses.replace(program, textures=textures), rays=quad_of(program, ray))
    return bool(further.samples[ray] > count)


def _depths(program: Program, ray: int, count: int) -> str:
    """Compare the depths of ray and surface, the ray's summed as the loop does."""
    cut = program.cut
    assert cut is not None
    depth, step, surface = cut.depth[ray], cut.step[ray], cut.surface[ray]
    for _ in range(count):
        depth = depth + step
    if cut.early:
        return f"depth {depth:.6g} - surface {surface:.6g} > -{step:.6g}"
    return f"depth {depth:.6g} >= surface {surface:.6g}"


def _own_end(program: Program, ray: int) -> str:
    stepping, paths = program.textures.pipeline.stepping, program.paths
    step, length = paths.step[ray], paths.length[ray]
    if stepping.end == "count":
        return f"all {int(paths.count[ray])} steps are done"
    if stepping.end in ("outside", "outside-above"):
        return "the position is outside the box" if stepping.end == "outside" else "a coordinate is above 1"
    if stepping.end == "parameter":
        return "t >= 1"
    if not np.isfinite(length):
        return f"the length of the ray is {length}"
    if stepping.end == "length-left":
        return f"no length is left of {length:.6g} in steps of {step:.6g}"
    if stepping.end == "length-before" and stepping.last_step == "dropped":
        return f"another whole step of {step:.6g} does not fit into the length {length:.6g}"
    return f"the length {length:.6g} is walked in steps of {step:.6g}"
