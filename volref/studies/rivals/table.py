"""The table of rivals: each with the order theory expects of it and what costs it orders.

Orders are those of the image's error in the rival's knob, for one of these cases:

    smooth   extinction and colour are smooth along the ray
    faces    the field bends at the faces of cells, wherever the samples lie
    kinks    the field is smooth and the transfer function bends
    jumps    the field is smooth and the transfer function jumps
    thick    one extinction, with an optical depth above 1 for each step
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from volref.arrays import number, whole_number
from volref.errors import SceneError
from volref.studies.rivals.cells import cell_gauss, halving
from volref.studies.rivals.medium import Integrator, Medium
from volref.studies.rivals.preintegration import preintegrated
from volref.studies.rivals.uniform import LEFT, MIDDLE, exponential, riemann, trapezoid

CASES = ("smooth", "faces", "kinks", "jumps", "thick")
KNOBS = ("step", "parts", "tolerance")


@dataclass(frozen=True)
class Loss:
    """The order left in a case, 0 where the error stays however fine the setting, and why."""

    case: str
    order: float
    why: str


@dataclass(frozen=True)
class Rival:
    """An integrator with what is known of it.

    Parameters
    ----------
    name, title
        What programs and people call it.
    knob
        What its setting is: a "step" in world units, whole "parts" of each cell, or a "tolerance".
    order
        The power of the step, 1 / parts or tolerance with which the error falls where everything is smooth.
    losses
        The cases in which it falls more slowly.
    source
        Where it is described.
    prepare
        Returns its integrator for one field and one setting.
    ladder
        Settings worth measuring, coarse to fine; steps in units of the least spacing of the volume.

    Raises
    ------
    SceneError
        If the knob or a case is unknown, or an order is not one.
    """

    name: str
    title: str
    knob: str
    order: float
    losses: tuple[Loss, ...]
    source: str
    prepare: Callable[[Medium, float], Integrator]
    ladder: tuple[float, ...]

    def __post_init__(self) -> None:
        """Check the row."""
        cases = [loss.case for loss in self.losses]
        if self.knob not in KNOBS or len(set(cases)) < len(cases) or not set(cases) < set(CASES):
            message = (
                f"rival {self.name} must have a knob of {KNOBS} and losses in different cases of {CASES}, "
            )
            raise SceneError(message + f"got {self.knob!r} and {cases}; correct the row")
        if self.order <= 0 or any(not 0 <= loss.order < self.order for loss in self.losses):
            message = (
                f"rival {self.name} must have an order above 0 and losses below it, got {self.order:g} and "
            )
            raise SceneError(message + f"{[loss.order for loss in self.losses]}; correct the row")

    @property
    def clamps(self) -> bool:
        """Whether opacities are cut off at 1."""
        return any(loss.case == "thick" for loss in self.losses)

    def check(self, setting: float) -> None:
        """Refuse a setting that the knob has not.

        Raises
        ------
        SceneError
            If it is not positive and finite, or for "parts" not a whole number.
        """
        name = f"{self.knob} of {self.name}"
        if self.knob == "parts":
            whole = int(setting) if float(setting).is_integer() else setting
            whole_number(name, whole, low=1, high=1 << 20)
        else:
            number(name, setting, above=0)

    def order_on(self, case: str) -> float:
        """Return the order expected in a case of `CASES`.

        Examples
        --------
        >>> RIVALS["trapezoid"].order_on("smooth"), RIVALS["trapezoid"].order_on("jumps")
        (2, 1)
        """
        return next((loss.order for loss in self.losses if loss.case == case), self.order)


_STEPS = (4.0, 2.0, 1.0, 0.5, 0.25, 0.125, 0.0625)
_PARTS = (1, 2, 4)
_TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-6, 1e-8)

_JUMP = Loss("jumps", 1, "the place of the jump is known to a step")
_CLAMP = Loss("thick", 0, "alpha is held at 1 until the optical depth of a step falls below 1")
_TABLE = tuple(
    Loss(
        case,
        0,
        "the value is linear there and the table knows its knots: what is left is the table's own error",
    )
    for case in ("kinks", "jumps")
)


_UNSEEN = tuple(
    Loss(case, 0, "what lies between the end of a piece and its first node is seen by neither rule")
    for case in ("kinks", "jumps")
)


def _cell_gauss(nodes: int) -> Rival:
    losses = [Loss("kinks", 2, "a knot within a piece: second order at a few pieces")] if nodes > 1 else []
    return Rival(
        f"cell-gauss-{nodes}",
        f"Gauss, {nodes} node{'s' * (nodes > 1)} a cell",
        "parts",
        2 * nodes,
        (*losses, _JUMP),
        "Novins and Arvo 1992; Gauss collocation",
        partial(cell_gauss, nodes=nodes),
        _PARTS,
    )


def _halving(nodes: int) -> Rival:
    return Rival(
        f"halving-gauss-{nodes}",
        f"adaptive halving, {nodes} nodes",
        "tolerance",
        1,
        _UNSEEN,
        "Novins and Arvo 1992",
        partial(halving, nodes=nodes),
        _TOLERANCES,
    )


def _preintegrated(order: int, size: int) -> Rival:
    bends = Loss("faces", 2, "a parabola through a bend is off by the step")
    return Rival(
        f"preintegrated{'' if order == 1 else '-parabola'}-{size}",
        f"pre-integrated, {'linear' if order == 1 else 'parabola'}, {size}^2",
        "step",
        order + 1,
        (*((bends,) if order == 2 else ()), *_TABLE),
        "Engel, Kraus and Ertl 2001" if order == 1 else "El Hajjar et al. 2008; Etiene et al. 2013",
        partial(preintegrated, size=size, order=order),
        _STEPS,
    )


_ROWS = (
    Rival(
        "left-riemann",
        "Riemann, front sample",
        "step",
        1,
        (_CLAMP,),
        "Max 1995; Etiene et al. 2014",
        partial(riemann, place=LEFT),
        _STEPS,
    ),
    Rival(
        "midpoint-riemann",
        "Riemann, middle sample",
        "step",
        1,
        (_CLAMP,),
        "Max 1995; Etiene et al. 2013",
        partial(riemann, place=MIDDLE),
        _STEPS,
    ),
    Rival(
        "trapezoid",
        "trapezoid",
        "step",
        2,
        (_JUMP,),
        "Novins and Arvo 1992",
        trapezoid,
        _STEPS,
    ),
    Rival(
        "left-exponential",
        "opacity-corrected, front sample",
        "step",
        1,
        (),
        "Max 1995",
        partial(exponential, place=LEFT),
        _STEPS,
    ),
    Rival(
        "midpoint-exponential",
        "opacity-corrected, middle sample",
        "step",
        2,
        (_JUMP,),
        "Max 1995",
        partial(exponential, place=MIDDLE),
        _STEPS,
    ),
    *(_preintegrated(order, size) for order in (1, 2) for size in (256, 1024)),
    *(_cell_gauss(nodes) for nodes in (1, 2, 3, 4)),
    *(_halving(nodes) for nodes in (2, 4)),
)

# Rivals by name, in the order in which people meet them.
RIVALS = {row.name: row for row in _ROWS}
