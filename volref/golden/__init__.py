"""Goldens: bundles that a test reads, the charts that tell faults apart, the plugin for pytest."""
