"""Precision: the error of all methods against their run time, on suites of scenes or on a user's own.

    from volref.studies.precision import SUITES, run_precision, subject_of
    report = run_precision([subject_of(SUITES[0])])
    print(report)

The reference is the certified integral at 1e-12 with its bound, which every error carries.
"""

from volref.studies.precision.frontier import frontier, frontier_check
from volref.studies.precision.methods import METHODS
from volref.studies.precision.report import PrecisionReport
from volref.studies.precision.run import run_precision
from volref.studies.precision.suites import SUITES, Subject, resized, subject_of

__all__ = [
    "METHODS",
    "SUITES",
    "PrecisionReport",
    "Subject",
    "frontier",
    "frontier_check",
    "resized",
    "run_precision",
    "subject_of",
]
