"""Stability: stiff and extreme cases, each with its truth, the textbook formula's answer, and volref's."""

from volref.studies.stability.case import Case
from volref.studies.stability.catalogue import CASES
from volref.studies.stability.report import StabilityReport
from volref.studies.stability.run import run_stability

__all__ = ["CASES", "Case", "StabilityReport", "run_stability"]
