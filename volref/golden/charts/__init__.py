"""Test charts: tiny scenes on which faults of renderers look different from one another."""

from volref.golden.charts.catalogue import CHARTS
from volref.golden.charts.chart import Chart

__all__ = ["CHARTS", "Chart"]
