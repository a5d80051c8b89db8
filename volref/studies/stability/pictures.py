"""Scenes as cases: rendered by each method, flattened to pixels (N, 4) and held against a known image."""

from collections.abc import Sequence

import numpy as np

from volref.arrays import Floats
from volref.planning import HALF_LEVEL
from volref.scene import Scene
from volref.studies.stability.case import EPS, Answer, Measured
from volref.studies.stability.shader import shader_image
from volref.truth import rendering

# Where nothing stands against it, a certificate must reach this.
CERTIFIED = 1e-12

# What an early end of a ray may leave of the light: by decision, not read from the marcher.
EARLY_END = 1e-6

# What the limits of scenes with a homogeneous medium are made of; see `rounding`.
ROUNDING = "a homogeneous medium has no error but rounding: half an ulp per segment and a few for the chord"
ESTIMATE = "the marcher's largest estimate, which at second order is 8 times its error"
EARLY = "1e-6 for rays that end below that transmittance"
CERTIFICATE = "the exact method's certificate, itself at most 1e-12"


def rounding(segments: float, extinction: float = 0.0, farthest: float = 0.0) -> float:
    """Return how far rounding may move a marched pixel of a homogeneous medium, colours up to 1.

    Composited front to back, each segment rounds the transmittance by u (T + w) and the colour by u C, with
    u = eps / 2 and w the weight: eps per segment.  Opacities are off by 2 ulp (the product, and expm1, which
    NumPy's own tests hold to 1 ulp), which weighted add up to 4 eps at most.  The ends of the span are off
    by 4 eps of their distance each (transform, subtraction, direction, quotient), and the optical depth by
    `extinction` times that.

    Examples
    --------
    >>> rounding(10) == 14 * EPS
    True
    """
    return (segments + 4) * EPS + 8 * EPS * extinction * farthest


def known(
    scenes: Sequence[Scene],
    reference: Floats,
    *,
    textbook: Floats | None = None,
    step: float | None = None,
    march: float | None = None,
    certified: float = CERTIFIED,
    slack: float = 0.0,
) -> Measured:
    """Return the numbers of scenes whose pixels (N, 4) are known.

    Parameters
    ----------
    scenes
        One or more; their pixels stand one after the other.
    reference
        The true pixels.
    textbook
        What a naive program gives; default `shader_image`.
    step
        The marcher's.
    march
        The error allowed to the marcher; default its largest estimate.
    certified
        The certificate that the exact method must reach.
    slack
        How far the reference may be from the integral along volref's own rays, by rounding.
    """
    if textbook is None:
        textbook = np.concatenate([shader_image(scene) for scene in scenes])
    answers = [_marched(scenes, step, march, slack)]
    exact = _exact(scenes, certified, slack)
    return Measured(reference.reshape(-1, 4), textbook, (*answers, *exact))


def marched(scene: Scene) -> Floats:
    """Return the pixels (N, 4) of a march with the default step."""
    return _rendered([scene], "march", tolerance=CERTIFIED)[0]


def _marched(scenes: Sequence[Scene], step: float | None, limit: float | None, slack: float) -> Answer:
    pixels, bounds = _rendered(scenes, "march", step=step, tolerance=CERTIFIED)
    allowed = float(bounds.max()) if limit is None else limit
    return Answer("march", pixels, allowed + slack)


def _exact(scenes: Sequence[Scene], certified: float, slack: float) -> tuple[Answer, ...]:
    pixels, bounds = _rendered(scenes, "exact", tolerance=certified)
    certificate = np.repeat(bounds[:, None], 4, axis=1) + slack
    return (Answer("exact", pixels, certified + slack, certificate),)


def _rendered(
    scenes: Sequence[Scene], method: str, *, step: float | None = None, tolerance: float = HALF_LEVEL
) -> tuple[Floats, Floats]:
    """Return the pixels (N, 4) and their bounds (N,)."""
    images = [
        rendering.render(scene, method=method, step=step, tolerance=tolerance, threads=1) for scene in scenes
    ]
    return (
        np.concatenate([image.rgba.reshape(-1, 4) for image in images]),
        np.concatenate([image.bound.reshape(-1) for image in images]),
    )
