"""The methods that are measured, each over its ladder of settings: volref's own, then the rivals.

march         midpoint rule at steps, with an estimate of its error
exact         the certified integral at tolerances
auto          the cheapest method with a proof at tolerances
auto-estimate the cheapest method with an estimate at tolerances
...           every rival, which knows nothing of its error
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

from volref.arrays import Floats
from volref.errors import SceneError
from volref.io.guard import nearest
from volref.planning import HALF_LEVEL
from volref.scene.scene import Scene
from volref.studies.rivals import RIVALS, Rival, integrate
from volref.truth.rendering import render
from volref.truth.result import Render

# What the exact method and "auto" are asked for: half a grey level, and every power of ten.
TOLERANCES = (1e-2, HALF_LEVEL, *(10.0**-digits for digits in range(3, 13)))

# Steps of the marcher in units of the least spacing, those of the rivals.
STEPS = (4.0, 2.0, 1.0, 0.5, 0.25, 0.125, 0.0625)

# A tolerance that keeps the marcher to float64.
DIGITS = 1e-12

# Families by the first word of a rival's name; one line each in a plot.
FAMILIES = {
    "left-riemann": "Riemann or trapezoid",
    "midpoint-riemann": "Riemann or trapezoid",
    "trapezoid": "Riemann or trapezoid",
    "left-exponential": "opacity-corrected",
    "midpoint-exponential": "opacity-corrected",
    "preintegrated": "pre-integrated",
    "cell-gauss": "Gauss in each cell",
    "halving-gauss": "adaptive halving",
}


@dataclass(frozen=True, eq=False)
class Answer:
    """What a method made of a scene.

    rgba (H, W, 4).  bound (H, W): what the method says its error is, of kind `bound_kind`, or None.
    samples: values interpolated or pieces integrated.  answered: the method that did the work.
    preparation: wall seconds of the work that does not grow with the image, or None where not told apart.
    """

    rgba: Floats
    bound: Floats | None
    bound_kind: str
    samples: int
    answered: str
    preparation: float | None = None


@dataclass(frozen=True)
class Method:
    """A method: its names for programs and people, its family, what its settings are, and what runs it.

    knob: "step" (in units of the least spacing), "parts" of a cell, or "tolerance".  ladder: the settings to
    measure, coarse to fine.
    """

    name: str
    title: str
    family: str
    knob: str
    ladder: tuple[float, ...]
    run: Callable[[Scene, float], Answer]


def _least_spacing(scene: Scene) -> float:
    return min(scene.gridded[0].spacing)


def _marched(scene: Scene, step: float) -> Answer:
    length = step * _least_spacing(scene)
    return _answer(render(scene, method="march", step=length, tolerance=DIGITS, threads=1))


def _asked(scene: Scene, tolerance: float, *, method: str, certified: bool) -> Answer:
    return _answer(render(scene, method=method, tolerance=tolerance, certified=certified, threads=1))


def _answer(out: Render) -> Answer:
    return Answer(out.rgba, out.bound, out.bound_kind, out.samples, out.plan.method)


def _rivalled(scene: Scene, setting: float, *, rival: Rival) -> Answer:
    knob = setting * _least_spacing(scene) if rival.knob == "step" else setting
    out = integrate(scene, rival, knob)
    return Answer(out.rgba, None, "none", out.samples, rival.name, out.preparation)


def _family(name: str) -> str:
    return next((family for start, family in FAMILIES.items() if name.startswith(start)), "other rivals")


_OWN = (
    Method("march", "volref march", "volref march", "step", STEPS, _marched),
    Method(
        "exact",
        "volref exact",
        "volref, certified",
        "tolerance",
        TOLERANCES,
        partial(_asked, method="exact", certified=True),
    ),
    Method(
        "auto",
        "volref auto",
        "volref, certified",
        "tolerance",
        TOLERANCES,
        partial(_asked, method="auto", certified=True),
    ),
    Method(
        "auto-estimate",
        "volref auto, estimated",
        "volref, estimated",
        "tolerance",
        TOLERANCES,
        partial(_asked, method="auto", certified=False),
    ),
)

METHODS = (
    *_OWN,
    *(
        Method(r.name, r.title, _family(r.name), r.knob, r.ladder, partial(_rivalled, rival=r))
        for r in RIVALS.values()
    ),
)

# The families in the order of a legend.
LEGEND = tuple(dict.fromkeys(method.family for method in METHODS))


def chosen_methods(names: Sequence[str] | None = None) -> tuple[Method, ...]:
    """Return the methods of these names, in the order of `METHODS`; None: all.

    Raises
    ------
    SceneError
        If a name is none of them.

    Examples
    --------
    >>> [method.title for method in chosen_methods(["trapezoid", "march"])]
    ['volref march', 'trapezoid']
    """
    known = [method.name for method in METHODS]
    for name in names or ():
        if name not in known:
            message = f"method must be one of {', '.join(known)}, got {name!r}; {nearest(name, known)}"
            raise SceneError(message)
    return tuple(method for method in METHODS if names is None or method.name in names)


def setting_words(method: Method, setting: float) -> str:
    """Return a setting for people.

    Examples
    --------
    >>> march, exact = chosen_methods(["march", "exact"])
    >>> setting_words(march, 0.0625), setting_words(exact, 1 / 510), setting_words(exact, 1e-6)
    ('step 1/16', '1/510', '1e-6')
    """
    if method.knob == "tolerance":
        return power_words(setting)
    if method.knob == "parts":
        return f"{setting:g} part{'s' * (setting != 1)}"
    return f"step {setting:g}" if setting >= 1 else f"step 1/{1 / setting:g}"


def power_words(number: float) -> str:
    """Return a small number to two digits for people; half a grey level by its name.

    Examples
    --------
    >>> power_words(1 / 510), power_words(0.01), power_words(2.34e-9)
    ('1/510', '1e-2', '2.3e-9')
    """
    if number == HALF_LEVEL:
        return "1/510"
    mantissa, exponent = f"{number:.1e}".split("e")
    return f"{float(mantissa):g}e{int(exponent)}"
