"""From the opacity of the table to that of a sample: what the length of a step does to it.

n samples.  L: the step's length in texture space, l: in the world, d0: the transfer's unit distance.

    as-is        factor a
    per-step     factor a / steps
    per-length   factor a L
    corrected    1 - (1 - a)^(factor l / d0)
    corrected-in-texture    L s for l, s the longest side
    corrected-by-ray        m / n for l, m the mean side, n the ray's length in steps

The second and third are corrected in first order only, for an opacity of 1 - e^(-a ...) about a ... .
"""

from dataclasses import dataclass

import numpy as np

from volref.arrays import Floats, Indices
from volref.emulation.device import Device
from volref.emulation.pipeline import Pipeline
from volref.emulation.rays.box import Box
from volref.emulation.rays.paths import Paths
from volref.emulation.textures.lookup import Found
from volref.scene.scene import Scene


@dataclass(frozen=True, eq=False)
class OpacityRule:
    """A rule of a program for rays whose steps are known: `scale` (R,) or (1,) is its factor or exponent."""

    source: str
    corrected: bool
    scale: Floats
    by_gradient: float = 0.0
    times: float = 1.0

    @property
    def at_most_one(self) -> bool:
        """Whether no opacity of the table can become one above 1."""
        plain = self.corrected or float(np.max(self.scale, initial=0.0)) <= 1
        return plain and self.times <= 1 and not self.by_gradient

    def opacity(self, found: Found, ray: Indices, share: Floats | None) -> Floats:
        """Return the opacity (n,) of samples on rays `ray` (n,) whose step is `share` (n,) of a whole one."""
        opacity = self._by_step(found.value if self.source == "value" else found.color[3], ray, share)
        if self.times != 1.0:
            opacity = opacity * opacity.dtype.type(self.times)
        if not self.by_gradient:
            return opacity
        assert found.magnitude is not None
        return np.asarray(opacity * (found.magnitude * opacity.dtype.type(self.by_gradient)))

    def _by_step(self, opacity: Floats, ray: Indices, share: Floats | None) -> Floats:
        scale = self.scale if len(self.scale) == 1 else self.scale[ray]
        if share is not None:
            scale = scale * share.astype(opacity.dtype)
        if not self.corrected:
            return np.asarray(opacity * scale)
        one = opacity.dtype.type(1)
        return np.asarray(one - (one - opacity) ** scale)


def opacity_rule(scene: Scene, pipeline: Pipeline, box: Box, paths: Paths, device: Device) -> OpacityRule:
    """Return the rule of a program for rays."""
    switches, kind = pipeline.opacity, device.values_type
    factor = factor_of(scene, pipeline, box)
    assert scene.transfer is not None
    scale: Floats = np.array([factor])
    if switches.rule == "per-step":
        scale = scale / pipeline.stepping.steps
    elif switches.rule == "per-length":
        scale = factor * paths.texture_step
    elif switches.rule != "as-is":
        scale = factor * _meant_length(switches.rule, box, paths) / scene.transfer.unit_distance
    corrected = switches.rule.startswith("corrected")
    return OpacityRule(switches.source, corrected, scale.astype(kind), switches.by_gradient, switches.times)


def _meant_length(rule: str, box: Box, paths: Paths) -> Floats:
    """Return the length (R,) for which a rule corrects."""
    if rule == "corrected-in-texture":
        return np.asarray(paths.texture_step * float(box.sides.max()))
    if rule == "corrected-by-ray":
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(steps_per_ray(paths) ** -1.0 * float(box.sides.mean()))
    return paths.world_step


def steps_per_ray(paths: Paths) -> Floats:
    """Return how many steps (R,) long rays are, a number with a fraction."""
    return np.asarray(paths.length / paths.step)


def factor_of(scene: Scene, pipeline: Pipeline, box: Box) -> float:
    """Return the factor of a program's opacity, one that suits the scene where the program names none.

    That is the one with which a faint sample has the opacity of the scene's transfer function for a step
    along a side of mean length; on a box with equal sides, for every ray whose steps are equally long.
    """
    switches, stepping = pipeline.opacity, pipeline.stepping
    if switches.factor is not None:
        return switches.factor
    if switches.rule not in ("per-step", "per-length"):
        return 1.0
    assert scene.transfer is not None
    side = float(box.sides.mean()) / scene.transfer.unit_distance
    if switches.rule == "per-step" and stepping.rule == "texture-length":
        return side * stepping.steps * (stepping.length or 1.0 / stepping.steps)
    return side
