"""The page docs/gallery.md: an image for each sheet, what it shows, its errors, and whom to credit."""

import textwrap
from collections.abc import Iterable, Mapping

from data_gen.gallery.catalogue import CREDITS
from data_gen.gallery.sheets import Sheet

HEAD = """# Gallery

Real scans, a real radar and meshes, drawn by volref from the files in `tests/data/`. One command draws these
images and writes this page; it takes some minutes:

    $ python -m data_gen.gallery

Errors are those of colours and alphas in 0..1. *Certified* ones are proven; where no proof covers a scene, as
under light, it is marched and its error is *estimated* ([Errors](guide/errors.md)). Estimates are largest
where an opaque border is seen edge on.
"""

WIDTH = 110


def page(sheets: Iterable[Sheet], errors: Mapping[str, str]) -> str:
    """Return the page as Markdown; `errors` says what is known of each sheet's errors, by its name."""
    return "\n".join([HEAD, *(_section(sheet, errors[sheet.name]) for sheet in sheets), _credits(sheets)])


def _section(sheet: Sheet, error: str) -> str:
    lines = [
        f"## {sheet.title}",
        "",
        f"![{sheet.title}](images/{sheet.file})",
        "",
        *textwrap.wrap(sheet.caption, WIDTH),
    ]
    if error:
        lines += ["", *textwrap.wrap(error, WIDTH)]
    files = ", ".join(f"`{name}`" for name in sheet.files)
    return "\n".join([*lines, "", *textwrap.wrap(f"From {files}.", WIDTH), ""])


def _credits(sheets: Iterable[Sheet]) -> str:
    used = {name for sheet in sheets for name in sheet.files}
    rows = [f"| `{name}` | {credit} |" for name, credit in CREDITS.items() if name in used]
    notice = "The notices, and what was changed, are in `tests/data/README.md`."
    return "\n".join(
        ["## Credits", "", "| file | whom to credit, licence |", "| --- | --- |", *rows, "", notice, ""]
    )
