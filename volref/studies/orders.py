"""Orders of accuracy, observed and expected: the power of the step with which each rival's error falls.

    from volref.studies.orders import observe_orders, orders_markdown
    print(orders_markdown(observe_orders()))

A case is a scene whose image is known to rounding.  Each rival runs down a ladder of settings, each half the
one before (a tenth for tolerances), and the slope of log error over log setting is fitted where the error
has become a power of the step and is not yet that of rounding or of a table.  The error is the root of the
mean square over all channels and pixels: where a feature lies within a step is chance, and many rays average
it (Etiene et al. 2014, "Verifying volume rendering using discretization error analysis").
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from volref.arrays import Floats
from volref.phantoms import scenes as phantoms
from volref.phantoms import transfer as tables
from volref.phantoms.views import view_around
from volref.scene.scene import Scene
from volref.scene.transfer import TransferFunction
from volref.scene.volume import Volume
from volref.studies.rivals import RIVALS, Rival, integrate
from volref.studies.rivals.cells import cell_gauss
from volref.studies.rivals.harness import image_by
from volref.studies.rivals.table import CASES

WIDTH, HEIGHT = 24, 18

# Nodes per cell with which Gauss's rule, of order 48, is exact to rounding on the smooth case.
NODES_OF_TRUTH = 24


@dataclass(frozen=True, eq=False)
class Case:
    """A scene, its image (H, W, 4), and the length whose halves, quarters... are the steps of the ladder."""

    name: str
    meaning: str
    scene: Scene
    truth: Floats
    length: float


@dataclass(frozen=True)
class Observation:
    """How the error of a rival fell in a case.

    settings, errors: the fitted rungs of the ladder.  order: the slope through them.  expected: the order
    that theory gives.
    """

    rival: str
    case: str
    settings: tuple[float, ...]
    errors: tuple[float, ...]
    order: float
    expected: float


def smooth_case() -> Case:
    """Return one cell of a grid: the value is a cubic along a ray, extinction and colour linear in it.

    The cubics are so bent that the error of a parabola shows before that of a table of 256^2.
    """
    corners = np.array([[[1, 6], [7, 5]], [[0, 2], [7, 0]]]) / 7
    volume = Volume(corners, centering="node")
    table = TransferFunction([0.0, 1.0], [(0.9, 0.1, 0.2), (0.1, 0.6, 1.0)], [1.2, 2.4])
    scene = Scene(volume, table, view_around(volume), WIDTH, HEIGHT)
    truth = image_by(scene, lambda medium: cell_gauss(medium, 1, NODES_OF_TRUTH)).rgba
    return Case("smooth", "one cell: nothing bends", scene, truth, 1.0)


def faces_case() -> Case:
    """Return the squared distance on a coarse grid: along a ray a line that bends at every face."""
    table = tables.two_colors(0.0, 108.0)
    scene, truth = phantoms.ball_scene(WIDTH, HEIGHT, transfer=table, size=4, spacing=4.0, centering="node")
    return Case("faces", "the field bends at the faces of cells", scene, truth, 4.0)


def kinks_case() -> Case:
    """Return a linear field and a table that bends: along a ray the extinction bends at the knots."""
    table = tables.few_knots(extinction=1.0)
    scene, truth = phantoms.ramp_scene(WIDTH, HEIGHT, transfer=table)
    return Case("kinks", "the transfer function bends", scene, truth, 5.0)


def jumps_case() -> Case:
    """Return a linear field and a table that jumps: along a ray the extinction is constant in between."""
    table = tables.steps([0.31, 0.64], [(1.0, 0.0, 0.2), (0.0, 1.0, 0.3)], [0.5, 0.9])
    scene, truth = phantoms.ramp_scene(WIDTH, HEIGHT, transfer=table)
    return Case("jumps", "the transfer function jumps", scene, truth, 5.0)


def thick_case() -> Case:
    """Return a homogeneous box so dense that extinction times step stays above 1."""
    scene, truth = phantoms.homogeneous_scene(WIDTH, HEIGHT, extinction=16.0, parallel=True)
    return Case("thick", "optical depth of a step above 1", scene, truth, 4.0)


MAKERS = dict(zip(CASES, (smooth_case, faces_case, kinks_case, jumps_case, thick_case), strict=True))

# First and last rung of the fit, by knob or name of the rival and by case; rung j is a step of length / 2^j,
# 2^j parts, or a tolerance of 10^-j.  Above the first the error is no power of the step yet; below the last
# it is that of rounding or of a table.  Where a bend or a jump lies within a step is chance: more rungs.
RUNGS = {
    "step": {"smooth": (5, 8), "faces": (5, 8), "kinks": (4, 8), "jumps": (3, 9), "thick": (1, 5)},
    "parts": {"smooth": (4, 7), "faces": (4, 7), "kinks": (3, 7), "jumps": (1, 7)},
    "tolerance": {"smooth": (4, 9), "faces": (4, 9), "kinks": (7, 10), "jumps": (7, 10)},
    "cell-gauss-3": {"smooth": (3, 5), "faces": (3, 5)},
    "cell-gauss-4": {"smooth": (1, 3), "faces": (2, 4)},
    "halving-gauss-4": {"smooth": (6, 10)},
    "preintegrated-256": {"smooth": (3, 5), "faces": (2, 5), "kinks": (7, 9), "jumps": (7, 9)},
    "preintegrated-1024": {"smooth": (4, 6), "faces": (4, 6), "kinks": (7, 9), "jumps": (7, 9)},
    "preintegrated-parabola-256": {"smooth": (2, 4), "faces": (2, 5), "kinks": (7, 9), "jumps": (7, 9)},
    "preintegrated-parabola-1024": {"smooth": (3, 5), "faces": (4, 7), "kinks": (7, 9), "jumps": (7, 9)},
}


def settings_of(rival: Rival, case: Case) -> tuple[float, ...]:
    """Return the settings at which the order of `rival` is read off in `case`, coarse to fine."""
    first, last = RUNGS.get(rival.name, {}).get(case.name) or RUNGS[rival.knob][case.name]
    rungs = range(first, last + 1)
    if rival.knob == "parts":
        return tuple(2**j for j in rungs)
    if rival.knob == "tolerance":
        return tuple(10.0**-j for j in rungs)
    return tuple(case.length / 2**j for j in rungs)


def observe_order(rival: Rival, case: Case) -> Observation:
    """Return how the error of `rival` falls with its setting in `case`.

    Examples
    --------
    >>> seen = observe_order(RIVALS["left-riemann"], thick_case())
    >>> round(seen.order, 6) == seen.expected == 0
    True
    """
    settings = settings_of(rival, case)
    errors = [rms(integrate(case.scene, rival, setting).rgba - case.truth) for setting in settings]
    finer = [1 / s if rival.knob == "parts" else s for s in settings]
    order = float(np.polyfit(np.log(finer), np.log(errors), 1)[0])
    return Observation(rival.name, case.name, settings, tuple(errors), order, rival.order_on(case.name))


def observe_orders(
    rivals: Iterable[str] = tuple(RIVALS), cases: Iterable[str] = CASES
) -> tuple[Observation, ...]:
    """Return the observations of the named rivals in the named cases, case by case.

    A case that says nothing of a rival is left out: in thick media only the clamped opacities have an order.
    """
    names = tuple(rivals)
    made = [MAKERS[name]() for name in cases]
    return tuple(
        observe_order(RIVALS[name], case)
        for case in made
        for name in names
        if case.name != "thick" or RIVALS[name].clamps
    )


def rms(difference: Floats) -> float:
    """Return the root of the mean square."""
    return float(np.sqrt((difference**2).mean()))


def orders_markdown(observations: Iterable[Observation]) -> str:
    """Return a Markdown table, a row per rival and a column per case: expected order, then observed.

    Examples
    --------
    >>> seen = Observation("trapezoid", "smooth", (0.5, 0.25), (0.04, 0.01), 2.0, 2)
    >>> print(orders_markdown([seen]))
    | rival | in powers of | smooth |
    | --- | --- | --- |
    | trapezoid | step | 2: 2.00 |
    """
    seen = {(o.rival, o.case): o for o in observations}
    cases = [case for case in CASES if any(case == key[1] for key in seen)]
    lines = ["| rival | in powers of | " + " | ".join(cases) + " |", "| --- " * (len(cases) + 2) + "|"]
    for name, rival in RIVALS.items():
        if not any(name == key[0] for key in seen):
            continue
        cells = [_cell(seen.get((name, case))) for case in cases]
        knob = "1 / parts" if rival.knob == "parts" else rival.knob
        lines.append(f"| {rival.title} | {knob} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def _cell(seen: Observation | None) -> str:
    # Adding 0 turns the -0.00 of a plateau into 0.00.
    return "-" if seen is None else f"{seen.expected:g}: {round(seen.order, 2) + 0.0:.2f}"
