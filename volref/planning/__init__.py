"""Every choice of a rendering resolved to numbers, and what the scene does not need.

A stage is left out where the scene alone proves that it cannot change the image, or, for early
termination and float32, where its effect is below a bound that the result carries.
"""

import numpy as np

from volref.arrays import number, one_of
from volref.errors import SceneError
from volref.planning.choices import (
    BLOCK,
    LONGEST_BLOCK,
    MOST_DEFAULT_SEGMENTS,
    TERMINATION,
    background_stage,
    cells_stages,
    colour_stage,
    early_termination,
    empty_space,
    light_stages,
    may_be_seen,
    meshes_stage,
    missing_rays,
    more_than_values,
    never_needed,
    precision_of,
    sampled_because,
    shows,
    step_length,
    volume_stage,
)
from volref.planning.record import SEGMENTS_PER_BLOCK, SHORTCUTS, Occupancy, Plan, Stage
from volref.scene.footprint import footprint
from volref.scene.scene import Scene
from volref.scene.volume import Volume

__all__ = [
    "BLOCK",
    "HALF_LEVEL",
    "METHODS",
    "MOST_DEFAULT_SEGMENTS",
    "RAYS_PER_CHUNK",
    "SHORTCUTS",
    "TERMINATION",
    "Occupancy",
    "Plan",
    "Stage",
    "may_be_seen",
    "more_than_values",
    "plan",
    "sampled_because",
]

# Half a level of an 8-bit image: below it a difference cannot be seen after rounding.
HALF_LEVEL = 1 / 510

# Rays that are marched together: NumPy spends about 1 us on a call, and more no longer fit the cache.
RAYS_PER_CHUNK = 32768

METHODS = ("auto", "march", "exact")


def plan(
    scene: Scene,
    *,
    method: str = "auto",
    step: float | None = None,
    tolerance: float = HALF_LEVEL,
    certified: bool = True,
    precision: str | None = None,
) -> Plan:
    """Decide what rendering `scene` takes, from the scene alone.

    Parameters
    ----------
    scene
        What to draw.
    method
        "march", "exact", or "auto": the cheapest whose proven bound meets the tolerance, which is "exact"; if
        an estimate may do (`certified=False`), `volref.render` measures which is cheaper.
    step
        Of "march", in world units; default half the least spacing of the volume.
    tolerance
        The error per pixel that is asked for.
    certified
        Whether the bound has to be proven.
    precision
        Of "march": "float64" or "float32"; default float32 where it provably cannot cost more than an eighth
        of the tolerance, which halves the time.

    Raises
    ------
    SceneError
        If the method is unknown, the step is not positive, or it would take more than 2^31 samples on one
        ray (2^20 for the default step).
    """
    if not isinstance(scene, Scene):
        message = f"scene must be a volref.Scene, got {type(scene).__name__}; build or load one first"
        raise SceneError(message)
    one_of("method", method, METHODS)
    number("tolerance", tolerance, above=0)
    sampled = sampled_because(scene)
    if method == "exact" and sampled:
        message = f"method must be 'march' or 'auto' for {sampled}, got 'exact'; the result is an estimate"
        raise SceneError(message)
    reduced = scene.mode != "composite" and scene.volume is not None and not sampled
    if method == "march" and reduced:
        message = f"method must be 'exact' or 'auto' in mode {scene.mode!r}, got 'march'; both are exact"
        raise SceneError(message)
    if reduced or (method == "auto" and certified and not sampled):
        method = "exact"
    if method != "march":
        if step is not None:
            message = f"step must be left out unless method is 'march', got {step!r}; pass method='march' too"
            raise SceneError(message)
        return _stepless(scene, method, tolerance)
    stages = [meshes_stage(scene)]
    if scene.volume is None or scene.transfer is None:
        stages.append(Stage("volume", included=False, reason="the scene has none"))
        return Plan(scene, method, 0.0, tolerance, 0.0, 0, None, (*stages, background_stage(scene)))
    length, most_segments = step_length(scene, step)
    seen = shows(scene)
    stages.append(volume_stage(scene, seen=seen))
    if not seen:
        return Plan(scene, method, length, tolerance, 0.0, 0, None, (*stages, background_stage(scene)))
    indices = 1.0
    if isinstance(scene.volume, Volume):
        indices = float(np.linalg.norm(scene.volume.index_from_world[:3, :3], axis=1).max())
    block = SEGMENTS_PER_BLOCK if SEGMENTS_PER_BLOCK * length * indices <= LONGEST_BLOCK else 3
    missing, occupancy = missing_rays(scene), None
    empty = Stage("empty space", included=False, reason="nothing of the volume is on the screen")
    if footprint(scene).pixels:
        occupancy, empty = empty_space(scene, length * block)
    termination, ending = early_termination(scene)
    palette, colour = colour_stage(scene)
    furthest = block * length * indices
    kind, rounding, float64 = precision_of(scene, furthest, most_segments, tolerance, precision)
    stages.extend([missing, empty, ending, colour, float64])
    stages.extend([*light_stages(scene), *never_needed(), background_stage(scene)])
    return Plan(
        scene,
        method,
        length,
        tolerance,
        termination,
        most_segments,
        occupancy,
        tuple(stages),
        palette,
        kind,
        rounding,
        block,
    )


def _stepless(scene: Scene, method: str, tolerance: float) -> Plan:
    """Return the plan of a method that chooses its own steps."""
    stages = [meshes_stage(scene)]
    if scene.volume is None or scene.transfer is None:
        stages.append(Stage("volume", included=False, reason="the scene has none"))
    else:
        seen = shows(scene)
        stages.append(volume_stage(scene, seen=seen))
        if seen:
            stages.append(missing_rays(scene))
            stages.extend([] if sampled_because(scene) else cells_stages(scene))
            stages.extend([*light_stages(scene), *never_needed()])
    stages.append(background_stage(scene))
    return Plan(scene, method, 0.0, tolerance, 0.0, 0, None, tuple(stages))
