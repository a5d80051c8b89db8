"""Rivals: the integrators that GPUs and papers use, run on volref's scenes under one harness.

    from volref.studies.rivals import RIVALS, integrate
    rgba, samples, seconds = integrate(scene, RIVALS["midpoint-exponential"], 0.5)[:3]

Each is a row of `RIVALS` with the order of accuracy that theory expects of it, and what costs it orders.
They share volref's rays, spans, interpolation and classification, in float64, and differ in nothing but the
quadrature along the ray.
"""

from volref.studies.rivals.harness import Outcome, integrate
from volref.studies.rivals.table import RIVALS, Loss, Rival

__all__ = ["RIVALS", "Loss", "Outcome", "Rival", "integrate"]
