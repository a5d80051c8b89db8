"""A browser is what it was asked to be, or it is none."""

import dataclasses

import pytest

from tests.webgl import browser
from tests.webgl.browser import NotRunError, opened


@pytest.mark.usefixtures("swiftshader")
def test_a_browser_that_draws_with_another_renderer_is_refused(monkeypatch):
    disguised = dataclasses.replace(browser.IMPLEMENTATIONS["llvmpipe"], flag="--use-angle=swiftshader")
    monkeypatch.setitem(browser.IMPLEMENTATIONS, "llvmpipe", disguised)
    with (
        pytest.raises(NotRunError, match=r"llvmpipe was asked for, drawn by ANGLE .*SwiftShader"),
        opened("llvmpipe"),
    ):
        pass


def test_without_chromium_the_reason_says_how_to_get_it(monkeypatch):
    monkeypatch.setenv("VOLREF_CHROMIUM", "chromium-of-nowhere")
    monkeypatch.setattr(browser, "find_spec", lambda _: True)
    with pytest.raises(NotRunError, match="chromium-of-nowhere is not on the PATH; apt-get install chromium"):
        opened("swiftshader").__enter__()


def test_without_playwright_the_reason_says_how_to_get_it(monkeypatch):
    monkeypatch.setattr(browser, "find_spec", lambda _: None)
    with pytest.raises(NotRunError, match=r"playwright is not installed; pip install 'volref\[webgl\]'"):
        opened("swiftshader").__enter__()
