"""Real WebGL for the tests below: one browser for each implementation, open for the session."""

import os
from contextlib import ExitStack
from pathlib import Path

import pytest

from tests.webgl.browser import IMPLEMENTATIONS, NotRunError
from tests.webgl.engine import engine
from tests.webgl.modules import WEBGPU, modules
from tests.webgl.reading import reader


def pytest_collection_modifyitems(items):
    """Mark every test of this folder `webgl`."""
    for item in items:
        if Path(__file__).parent in item.path.parents:
            item.add_marker("webgl")


@pytest.fixture(scope="session")
def engine_of():
    """Engine by name, opened at first use; where it cannot be had the test is not run, or fails in CI."""
    kept = {}
    with ExitStack() as closing:

        def get(name):
            if name not in kept:
                try:
                    kept[name] = closing.enter_context(engine(name))
                except NotRunError as why:
                    kept[name] = why
            return _had(kept[name])

        yield get


@pytest.fixture(scope="session", params=("swiftshader", "llvmpipe"))
def webgl(request, engine_of):
    """Two implementations that share no code, in turn."""
    return engine_of(request.param)


@pytest.fixture(scope="session", params=IMPLEMENTATIONS)
def every_webgl(request, engine_of):
    """Each implementation in turn: for what differs between devices."""
    return engine_of(request.param)


@pytest.fixture(scope="session")
def swiftshader(engine_of):
    """The implementation that is part of Chromium."""
    return engine_of("swiftshader")


@pytest.fixture(scope="session")
def page(tmp_path_factory):
    """A page with volref's ES modules, on SwiftShader, with WebGPU; a device pixel for a CSS pixel."""
    yield from _page("swiftshader", tmp_path_factory, WEBGPU)


@pytest.fixture(scope="session")
def fine_page(tmp_path_factory):
    """A page with volref's ES modules, on Mesa's llvmpipe; 2 x 2 device pixels for a CSS pixel."""
    yield from _page("llvmpipe", tmp_path_factory, device_scale_factor=2)


@pytest.fixture(scope="session")
def visit():
    """What opens a file as a reader does, see `reader`."""
    with ExitStack() as closing:
        try:
            kept = closing.enter_context(reader())
        except NotRunError as why:
            kept = why
        yield _had(kept)


def _page(name, tmp_path_factory, flags=(), **settings):
    with ExitStack() as closing:
        try:
            opened = closing.enter_context(modules(name, tmp_path_factory.mktemp("files"), flags, **settings))
        except NotRunError as why:
            opened = why
        yield _had(opened)


def _had(opened):
    """Return what was opened; where it cannot be had the test is not run, or fails in CI."""
    if isinstance(opened, NotRunError):
        refuse = pytest.fail if os.environ.get("VOLREF_REQUIRE_WEBGL") == "1" else pytest.skip
        refuse(f"not run: {opened}")
    return opened
