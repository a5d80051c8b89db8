"""Headless Chromium with a real WebGL implementation, driven through Playwright (extra `webgl`).

Chromium falls back silently to whatever draws at all, so each implementation is known by the renderer that
the page reports, never by the flags that asked for it.
"""

import os
import re
import shutil
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from playwright.sync_api import Page

# Software drivers are on Chromium's block list; a slow shader is not a hung one.
FLAGS = (
    "--no-sandbox",
    "--ignore-gpu-blocklist",
    "--disable-gpu-watchdog",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--use-gl=angle",
    "--enable-unsafe-swiftshader",
)

# Mesa must not take a graphics card where there is one.
ENVIRONMENT = {"LIBGL_ALWAYS_SOFTWARE": "1"}

# Milliseconds until a browser must be there, seconds until a job must be done: a hang ends, nothing is timed.
LAUNCH_MILLISECONDS = 120_000
JOB_SECONDS = 600

RENDERER = """() => {
    const gl = document.createElement("canvas").getContext("webgl2");
    const named = gl && gl.getExtension("WEBGL_debug_renderer_info");
    return named ? gl.getParameter(named.UNMASKED_RENDERER_WEBGL) : "no WebGL 2 at all";
}"""


@dataclass(frozen=True)
class Implementation:
    """What draws: the flag that asks for it, how its renderer names itself, what it is installed from."""

    flag: str
    renderer: str
    packages: str


IMPLEMENTATIONS = {
    "swiftshader": Implementation("--use-angle=swiftshader", r"SwiftShader", "chromium"),
    "llvmpipe": Implementation("--use-angle=gl-egl", r"llvmpipe.*OpenGL", "libegl1 libgles2 libgl1-mesa-dri"),
    "lavapipe": Implementation("--use-angle=vulkan", r"Vulkan.*llvmpipe", "mesa-vulkan-drivers"),
}


class NotRunError(Exception):
    """WebGL cannot be had here; the message says what is missing and how to install it."""


@contextmanager
def opened(name: str) -> Iterator[Callable[[str, Any], Any]]:
    """Keep a browser open, and give the function that calls a JavaScript function of its one page.

    Playwright's event loop counts as running in the thread that started it for as long as the browser is
    open, and `asyncio.run` would refuse to start there.  So the browser has a thread of its own.

    Raises
    ------
    NotRunError
        If Playwright, Chromium or the implementation is not there.
    """
    implementation = IMPLEMENTATIONS[name]
    executable = _chromium()
    with ThreadPoolExecutor(1, thread_name_prefix=name) as thread, ExitStack() as closing:
        page = thread.submit(_page, closing, executable, implementation).result()
        closing_in_its_thread = closing.pop_all()
        try:
            renderer = thread.submit(page.evaluate, RENDERER).result(JOB_SECONDS)
            if not re.search(implementation.renderer, renderer):
                message = (
                    f"{name} was asked for, drawn by {renderer}; apt-get install {implementation.packages}"
                )
                raise NotRunError(message)
            yield lambda script, given: thread.submit(page.evaluate, script, given).result(JOB_SECONDS)
        finally:
            thread.submit(closing_in_its_thread.close).result(JOB_SECONDS)


def _chromium() -> str:
    if find_spec("playwright") is None:
        message = "playwright is not installed; pip install 'volref[webgl]'"
        raise NotRunError(message)
    asked = os.environ.get("VOLREF_CHROMIUM", "chromium")
    found = shutil.which(asked)
    if found is None:
        message = f"{asked} is not on the PATH; apt-get install chromium, or set VOLREF_CHROMIUM to its path"
        raise NotRunError(message)
    return found


def _page(closing: ExitStack, executable: str, implementation: Implementation) -> "Page":
    from playwright.sync_api import sync_playwright

    playwright = closing.enter_context(sync_playwright())
    browser = playwright.chromium.launch(
        executable_path=executable,
        headless=True,
        args=[*FLAGS, implementation.flag],
        env={**os.environ, **ENVIRONMENT},
        timeout=LAUNCH_MILLISECONDS,
    )
    closing.callback(browser.close)
    return browser.new_page()
