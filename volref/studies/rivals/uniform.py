"""Rivals with a uniform step and one or two samples to a segment: the Riemann sums of GPU ray casters.

R rays, S segments of a block; edges are (S + 1, R), all else (S, R), colours (3, S, R).

    t   0        h       2h       3h  L        edges at multiples of the step, the last at the end L
        |--------|--------|--------|--|        left: a sample at the front edge of each segment
        x        x        x        x           middle: at its middle
             o        o        o      o        trapezoid: at both ends
"""

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from volref.arrays import Floats
from volref.studies.rivals.medium import Bundle, Integrator, Light, Medium, paint, sample
from volref.workspace import Workspace

# Segments of a ray that are taken together, and the samples of a block that these should come near: enough
# for NumPy's calls to cost little, and few enough for the cache.
LEAST_SEGMENTS, MOST_SEGMENTS = 8, 64
SAMPLES_PER_BLOCK = 16384

# Of rays and the edges of a block: what its segments let pass (S, R), and the light that leaves them in
# front (3, S, R).
Block: TypeAlias = Callable[[Bundle, Floats, Workspace], tuple[Floats, Floats]]

LEFT, MIDDLE = 0.0, 0.5


def riemann(medium: Medium, step: float, place: float) -> Integrator:
    """Integrate by alpha = min(sigma h, 1) of one sample at `place` (0..1) of each segment.

    The first term of 1 - exp(-sigma h) (Max 1995 expands it so), as early GPU ray casters have it: off by
    (sigma h)^2 / 2 in each segment wherever the sample lies, so of first order even at the middle.
    """

    def block(rays: Bundle, edges: Floats, work: Workspace) -> tuple[Floats, Floats]:
        length = np.diff(edges, axis=0)
        values = sample(medium, rays.start, rays.slope, edges[:-1] + place * length, work)
        colors, sigma = paint(medium, values, work)
        opacity = np.minimum(sigma * length, 1.0)
        return 1.0 - opacity, opacity * colors

    return marcher(step, block)


def exponential(medium: Medium, step: float, place: float) -> Integrator:
    """Integrate by alpha = 1 - exp(-sigma h) of one sample at `place` of each segment: opacity correction.

    In GPU words alpha = 1 - (1 - a)^(h / d), with the table's opacity a of a distance d.
    """

    def block(rays: Bundle, edges: Floats, work: Workspace) -> tuple[Floats, Floats]:
        length = np.diff(edges, axis=0)
        values = sample(medium, rays.start, rays.slope, edges[:-1] + place * length, work)
        colors, sigma = paint(medium, values, work)
        opacity = -np.expm1(-sigma * length)
        return 1.0 - opacity, opacity * colors

    return marcher(step, block)


def trapezoid(medium: Medium, step: float) -> Integrator:
    """Integrate emission and optical depth by the trapezoid rule (Novins and Arvo 1992).

    tau = h (sigma_a + sigma_b) / 2 and C = h (c_a sigma_a + c_b sigma_b exp(-tau)) / 2 between samples a, b.
    Nothing holds C to the colour where sigma h is large.
    """

    def block(rays: Bundle, edges: Floats, work: Workspace) -> tuple[Floats, Floats]:
        half = np.diff(edges, axis=0) / 2
        values = sample(medium, rays.start, rays.slope, edges, work)
        colors, sigma = paint(medium, values, work)
        passed = np.exp(-half * (sigma[:-1] + sigma[1:]))
        glow = colors * sigma
        return passed, half * (glow[:, :-1] + glow[:, 1:] * passed)

    return marcher(step, block, at_ends=True)


def marcher(step: float, block: Block, *, per_segment: int = 1, at_ends: bool = False) -> Integrator:
    """Return the integrator that cuts rays at multiples of `step` and composites what `block` gives.

    The rule takes `per_segment` values of each segment, and one more of a ray if they lie `at_ends`.
    """

    def integrate(bundle: Bundle, work: Workspace) -> Light:
        counts = np.ceil(bundle.length / step)
        transmittance, color = np.ones(len(counts)), np.zeros((3, len(counts)))
        first, most = 0, int(counts[0])
        while first < most:
            live = int(np.searchsorted(-counts, -first))
            rays = Bundle(bundle.start[:, :live], bundle.slope[:, :live], bundle.length[:live])
            size = min(max(SAMPLES_PER_BLOCK // live, LEAST_SEGMENTS), MOST_SEGMENTS, most - first)
            number = np.arange(first, first + size + 1)[:, None]
            passed, light = block(rays, np.minimum(number * step, rays.length), work)
            composite(transmittance[:live], color[:, :live], passed, light)
            first += size
        samples = per_segment * int(counts.sum()) + at_ends * len(counts)
        return Light(transmittance, color, samples)

    return integrate


def composite(transmittance: Floats, color: Floats, passed: Floats, light: Floats) -> None:
    """Add segments, front to back, to `transmittance` (R,) and `color` (3, R), in place."""
    for k in range(len(passed)):
        color += transmittance * light[:, k]
        transmittance *= passed[k]
