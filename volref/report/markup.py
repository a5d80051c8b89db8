"""Pieces of HTML that pages are put together from, and the document around them.

Whatever comes from a scene or a caller is text and is escaped here; nobody passes markup in but other
functions of these pages.  A document needs nothing from elsewhere, and its policy says so to the browser:
scripts are allowed by the hash of what they are, so that no text can become one.
"""

import base64
import hashlib
from collections.abc import Sequence
from html import escape
from importlib import resources

from volref.arrays import Bytes
from volref.report.pictures import VIRIDIS, ColoredMap, png_bytes

Row = tuple[str, str]


def facts(rows: Sequence[Row], name: str = "Facts") -> str:
    """Return a table of (name, value)."""
    body = "".join(
        f'<tr><th scope="row">{escape(key)}</th><td>{escape(value)}</td></tr>' for key, value in rows
    )
    return scrolling(name, f"<table><tbody>{body}</tbody></table>")


def scrolling(name: str, table: str) -> str:
    """Wrap what may be wider than a phone so that it scrolls by itself, by keyboard too."""
    return f'<div class="scroll" role="region" aria-label="{escape(name)}" tabindex="0">{table}</div>'


def code_block(name: str, code: str) -> str:
    """Return code under its name."""
    label = escape(name)
    return f'<h3>{label}</h3><pre tabindex="0" aria-label="{label}"><code>{escape(code)}</code></pre>'


def section(name: str, content: str) -> str:
    """Return a part of a page under a heading."""
    label = "-".join(word for word in name.lower().replace(",", "").split())
    return f'<section aria-labelledby="{label}"><h2 id="{label}">{escape(name)}</h2>{content}</section>'


def paragraph(text: str) -> str:
    """Return a paragraph, nothing for no text."""
    return f"<p>{escape(text)}</p>" if text else ""


def inline_image(codes: Bytes, alt: str, width: int, height: int) -> str:
    """Return codes (H, W, 3 or 4) as an image inside the page, with the size that it is shown at."""
    data = base64.b64encode(png_bytes(codes)).decode("ascii")
    return f'<img alt="{escape(alt)}" width="{width}" height="{height}" src="data:image/png;base64,{data}">'


def legend(picture: ColoredMap) -> str:
    """Return the scale of a map, its unit, and what its neutral tone means."""
    parts = []
    if picture.ticks:
        words = "".join(
            f'<span style="left:{100 * place:g}%" class="{_side(place)}">{escape(word)}</span>'
            for place, word in picture.ticks
        )
        parts.append(f'<div class="scale"></div><div class="ticks">{words}</div>')
        parts.append(f'<p class="key">{escape(picture.unit)}</p>')
    if picture.neutral:
        parts.append(f'<p class="key"><span class="neutral"></span> {escape(picture.neutral)}</p>')
    return "".join(parts)


def _side(place: float) -> str:
    return {0.0: "first", 1.0: "last"}.get(place, "middle")


def document(title: str, body: str, *, style: str = "", script: str = "") -> str:
    """Return a whole page: `body` in its main part, with more style and a script if there are any."""
    page = resources.files("volref.report").joinpath("page.css").read_text(encoding="utf-8")
    colors = ", ".join(f"rgb({r} {g} {b})" for r, g, b in VIRIDIS.tolist())
    policy = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"
    if script:
        digest = base64.b64encode(hashlib.sha256(script.encode("utf-8")).digest()).decode("ascii")
        policy += f"; script-src 'sha256-{digest}'"
        script = f'\n<script type="module">{script}</script>'
    return f"""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<title>{escape(title)}</title>
<style>
{page}.scale {{ background: linear-gradient(to right, {colors}); }}
{style}</style>
</head>
<body>
<main>
{body}
</main>{script}
</body>
</html>
"""
