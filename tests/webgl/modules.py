"""A page that volref's ES modules run in: served on this machine, since modules and hashes need an origin."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import Any

import volref
from tests.webgl.browser import Call, opened

WEB = Path(volref.__file__).parent / "web"

# WebGPU on the processor: Chromium offers it only where it is asked to.
WEBGPU = (
    "--enable-unsafe-webgpu",
    "--use-webgpu-adapter=swiftshader",
    "--enable-features=Vulkan",
    "--use-vulkan=swiftshader",
)

PAGE = b"<!doctype html><meta charset=utf-8><title>volref</title><body style='margin:0'><input type=file>"


class Handler(SimpleHTTPRequestHandler):
    """/ is an empty page, /web the modules, /files a folder; what is sent to /files is kept there."""

    def do_GET(self):
        if self.path == "/":
            self._answer(200, PAGE, "text/html")
            return
        super().do_GET()

    def do_POST(self):
        body = self.rfile.read(int(self.headers["Content-Length"]))
        _, folder, name = self.path.split("/")
        if folder != "files":
            self._answer(404)
            return
        (Path(self.directory) / name).write_bytes(body)
        self._answer(204)

    def translate_path(self, path):
        kind, _, name = path.lstrip("/").partition("/")
        return str({"web": WEB, "files": Path(self.directory)}.get(kind, Path("/nowhere")) / name)

    def end_headers(self):
        self.send_header("Cache-Control", "no-store")
        super().end_headers()

    def log_message(self, *_):
        pass

    def _answer(self, status, body=b"", kind="text/plain"):
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)


class ModuleError(Exception):
    """What a module refused; the message is its one sentence."""


@dataclass(frozen=True)
class Modules:
    """An open page; `files` is the folder that it sees as /files."""

    call: Call
    files: Path

    def run(self, body: str, given: object = None) -> Any:
        """Return what the statements `body` return as JSON: `v` are the modules, `given` what is given.

        Raises
        ------
        ModuleError
            If they throw.
        """
        function = f"""async (text) => {{
            const v = await import("/web/index.js");
            const given = JSON.parse(text);
            try {{ return {{ value: await (async () => {{ {body} }})() }}; }}
            catch (error) {{ return {{ error: error.message, stack: error.stack }}; }}
        }}"""
        answer = self.call(function, json.dumps(given))
        if "error" in answer:
            raise ModuleError(answer["error"])
        return answer.get("value")


@contextmanager
def modules(name: str, files: Path, flags: tuple[str, ...] = (), **page: Any) -> Iterator[Modules]:
    """Keep a page with the modules open in the implementation of that name, see `browser.opened`."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Handler, directory=str(files)))
    thread = Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        with opened(name, f"http://127.0.0.1:{server.server_port}/", flags, **page) as call:
            yield Modules(call, files)
    finally:
        server.shutdown()
        server.server_close()
        thread.join()
