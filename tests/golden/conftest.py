"""Bundles that several tests read."""

import pytest

from tests.golden.bundles import written


@pytest.fixture(scope="session")
def bundle(tmp_path_factory):
    """A small bundle; not to be changed."""
    return written(tmp_path_factory.mktemp("golden") / "tiny", derived=True, title="A few pixels")
