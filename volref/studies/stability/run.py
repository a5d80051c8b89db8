"""Runs the cases, with warnings as errors, and judges them."""

import time
import warnings
from collections.abc import Callable, Sequence

import numpy as np

from volref.arrays import Floats
from volref.studies.stability.case import Answer, Case, Measured, errors
from volref.studies.stability.catalogue import chosen_cases
from volref.studies.stability.report import Judged, Result, StabilityReport

# Called before each case with (cases done, cases in all).
Progress = Callable[[int, int], None]


def run_stability(progress: Progress | None = None, *, only: Sequence[str] | None = None) -> StabilityReport:
    """Run the study and return what every case gave.

    Warnings count as errors, and so do a division by zero, an overflow or an invalid operation of NumPy in
    what volref computes; the textbook formulas may do as they like.

    Parameters
    ----------
    progress
        Called with (cases done, cases in all).
    only
        Names of cases or families; default all.

    Raises
    ------
    SceneError
        If a name is neither.

    Examples
    --------
    >>> report = run_stability(only=["opaque-clear-opaque"])
    >>> report.passed, report.results[0].textbook_error, report.results[0].answers[0].error
    (True, inf, 0.0)
    """
    cases = chosen_cases(only)
    started = time.perf_counter()
    results = []
    for done, case in enumerate(cases):
        if progress is not None:
            progress(done, len(cases))
        results.append(run_case(case))
    if progress is not None:
        progress(len(cases), len(cases))
    return StabilityReport(tuple(results), time.perf_counter() - started)


def run_case(case: Case) -> Result:
    """Run one case; what it raises makes it fail."""
    try:
        with warnings.catch_warnings(), np.errstate(divide="raise", over="raise", invalid="raise"):
            warnings.simplefilter("error")
            found = case.measure()
    except (ArithmeticError, LookupError, RuntimeError, TypeError, ValueError, Warning) as error:
        problem = f"{type(error).__name__}: {error}"
        return Result(case, None, None, None, (), problem)
    return _judged_case(case, found)


def _judged_case(case: Case, found: Measured) -> Result:
    off = errors(found.textbook, found.reference, case.error)
    worst = np.unravel_index(int(np.argmax(off)), off.shape)
    return Result(
        case,
        float(found.reference[worst]),
        float(found.textbook[worst]),
        float(off[worst]),
        tuple(_judged(case, answer, found.reference, worst) for answer in found.answers),
        "",
    )


def _judged(case: Case, answer: Answer, reference: Floats, shown: tuple[np.intp, ...]) -> Judged:
    off = errors(answer.value, reference, case.error)
    certificate = None if answer.certificate is None else float(answer.certificate.max())
    if answer.certificate is None:
        passed = bool(off.max() <= answer.limit)
    else:
        passed = bool((off <= answer.certificate).all()) and float(answer.certificate.max()) <= answer.limit
    return Judged(answer.who, float(answer.value[shown]), float(off.max()), answer.limit, certificate, passed)
