"""Settings of every test."""

import os

from hypothesis import settings

# A deadline is a timing, and timings do not belong in tests; CI draws the same examples in every run.
settings.register_profile("volref", deadline=None, derandomize="CI" in os.environ)
settings.load_profile("volref")
