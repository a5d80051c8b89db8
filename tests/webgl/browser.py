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
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

Call = Callable[[str, str], Any]

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
    const gl = document.createElement("canvas").getContext("webgl");
    const named = gl && gl.getExtension("WEBGL_debug_renderer_info");
    return named ? gl.getParameter(named.UNMASKED_RENDERER_WEBGL) : "nothing at all";
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
def opened(name: str, address: str | None = None, flags: tuple[str, ...] = (), **page: Any) -> Iterator[Call]:
    """Keep a browser open, and give what calls a JavaScript function of its one page with a text.

    The page is the one at `address`, which must have an <input type=file>, else an empty one; `flags` are
    more of Chromium's, `page` settings of Playwright's `new_page` such as device_scale_factor.

    Playwright's event loop counts as running in the thread that started it for as long as the browser is
    open, and `asyncio.run` would refuse to start there.  So the browser has a thread of its own.

    Raises
    ------
    NotRunError
        If Playwright, Chromium or the implementation is not there.
    """
    executable = chromium()
    with ThreadPoolExecutor(1, thread_name_prefix=name) as thread:
        closing = ExitStack()
        try:
            call = thread.submit(_started, closing, executable, name, address, flags, page).result()
            yield lambda function, text: thread.submit(call, function, text).result(JOB_SECONDS)
        finally:
            thread.submit(closing.close).result(JOB_SECONDS)


def chromium() -> str:
    """Return the path of Chromium."""
    if find_spec("playwright") is None:
        message = "playwright is not installed; pip install 'volref[webgl]'"
        raise NotRunError(message)
    asked = os.environ.get("VOLREF_CHROMIUM", "chromium")
    found = shutil.which(asked)
    if found is None:
        message = f"{asked} is not on the PATH; apt-get install chromium, or set VOLREF_CHROMIUM to its path"
        raise NotRunError(message)
    return found


def _started(
    closing: ExitStack,
    executable: str,
    name: str,
    address: str | None,
    flags: tuple[str, ...],
    settings: dict[str, Any],
) -> Call:
    from playwright.sync_api import sync_playwright

    implementation = IMPLEMENTATIONS[name]
    folder = Path(closing.enter_context(TemporaryDirectory(prefix="volref-webgl-")))
    browser = closing.enter_context(sync_playwright()).chromium.launch(
        executable_path=executable,
        args=[*FLAGS, *flags, implementation.flag],
        env={**os.environ, **ENVIRONMENT},
        timeout=LAUNCH_MILLISECONDS,
    )
    closing.callback(browser.close)
    page = browser.new_page(**settings)
    renderer = page.evaluate(RENDERER)
    if not re.search(implementation.renderer, renderer):
        message = f"{name} was asked for, drawn by {renderer}; apt-get install {implementation.packages}"
        raise NotRunError(message)
    if address is None:
        page.set_content("<input type=file>")
    else:
        page.goto(address)

    # Chromium reads a file ten times as fast as Playwright carries a message of some megabytes.
    def call(function: str, text: str) -> Any:
        file = folder / "text"
        file.write_text(text, encoding="utf-8")
        page.set_input_files("input", file)
        return page.evaluate(
            f"async () => ({function})(await document.querySelector('input').files[0].text())"
        )

    return call
