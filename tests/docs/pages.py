"""The pages of docs/ as text: their code blocks, and the files they show."""

import re
from pathlib import Path

DOCS = Path(__file__).parents[2] / "docs"

# ```console, or ```{code-block} json with ":caption: scene.json" as its first line.
_BLOCK = re.compile(r"^```(\S+)(?: \w+)?\n(?::caption: (\S+)\n)?(.*?)^```$", re.MULTILINE | re.DOTALL)


def blocks(page, kind):
    """Return the blocks of one kind, such as "console", in order."""
    return [text for found, _, text in _BLOCK.findall(page.read_text(encoding="utf-8")) if found == kind]


def captioned_files(page):
    """Return {file name: text} of the blocks that have a caption."""
    found = _BLOCK.findall(page.read_text(encoding="utf-8"))
    return {caption: text for _, caption, text in found if caption}
