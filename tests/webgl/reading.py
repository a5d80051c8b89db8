"""Pages for people in headless Chromium, from a file, as a reader has them: any size, light or dark."""

import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any

from tests.webgl.browser import ENVIRONMENT, FLAGS, JOB_SECONDS, LAUNCH_MILLISECONDS, chromium

Visit = Callable[..., Any]


class Trouble(list[str]):
    """What went wrong on a page, and what it asked others for."""

    def watch(self, page: Any) -> None:
        page.on("console", lambda message: self.append(f"{message.type}: {message.text}"))
        page.on("pageerror", lambda error: self.append(str(error)))
        page.on("dialog", lambda dialog: (self.append(dialog.message), dialog.dismiss()))
        page.on("request", lambda request: self._asked(request.url))

    def _asked(self, address: str) -> None:
        if not address.startswith(("file:", "data:", "blob:")):
            self.append(address)


@contextmanager
def reader() -> Iterator[Visit]:
    """Keep a browser open; give what visits a file and calls a function of Playwright's page there.

    `visit(path, function, **settings)` returns what the function does; settings are those of a context.
    Anything on the console, any error and any request for something else fails the visit.  The browser has a
    thread of its own, see `opened`.

    Raises
    ------
    NotRunError
        If Playwright or Chromium is not there.
    """
    executable = chromium()
    with ThreadPoolExecutor(1, thread_name_prefix="reader") as thread:
        started, browser = thread.submit(_start, executable).result()

        def visit(path: Any, function: Callable[[Any], Any], **settings: Any) -> Any:
            return thread.submit(_visit, browser, path, function, settings).result(JOB_SECONDS)

        try:
            yield visit
        finally:
            thread.submit(browser.close).result(JOB_SECONDS)
            thread.submit(started.stop).result(JOB_SECONDS)


def _start(executable: str) -> tuple[Any, Any]:
    from playwright.sync_api import sync_playwright

    started = sync_playwright().start()
    browser = started.chromium.launch(
        executable_path=executable,
        args=[*FLAGS],
        env={**os.environ, **ENVIRONMENT},
        timeout=LAUNCH_MILLISECONDS,
    )
    return started, browser


def _visit(browser: Any, path: Any, function: Callable[[Any], Any], settings: dict[str, Any]) -> Any:
    context = browser.new_context(**settings)
    try:
        page, trouble = context.new_page(), Trouble()
        trouble.watch(page)
        page.goto(path.as_uri())
        found = function(page)
        assert not trouble, trouble
        return found
    finally:
        context.close()
