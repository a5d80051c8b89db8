"""docs/performance.md from the figures in tests/benchmarks/results/: `python -m tests.benchmarks.page`.

A section has a name (that of its JSON file), a title, a function that makes its Markdown from the figures,
and perhaps one that draws its plot.  The figures of every section name the machine and the date.
"""

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from tests.benchmarks.march import march_section
from tests.benchmarks.peers.plot import save_plot as peers_plot
from tests.benchmarks.peers.section import side_by_side
from tests.benchmarks.scaling import save_plot as scaling_plot
from tests.benchmarks.scaling import scaling_section

ROOT = Path(__file__).parents[2]
RESULTS, PAGE = Path(__file__).parent / "results", ROOT / "docs" / "performance.md"
IMAGES = "images"

Figures = dict[str, Any]


class Section(NamedTuple):
    """A part of the page; `plot` takes figures and the file to write, `command` is what measures."""

    title: str
    command: str
    text: Callable[[Figures], str]
    plot: Callable[[Figures, Path], None] | None = None
    plot_shows: str = ""


# In the order of the page.
SECTIONS = {
    "peers": Section(
        "Side by side",
        "python -m tests.benchmarks.peers",
        side_by_side,
        peers_plot,
        "Root mean square error against CPU seconds, log-log, a panel for each scene.",
    ),
    "march": Section("The marcher's kernels", "python -m tests.benchmarks.march", march_section),
    "scaling": Section(
        "How the cost grows",
        "python -m tests.benchmarks.scaling",
        scaling_section,
        scaling_plot,
        "CPU seconds against pixels, segments, voxels and triangles, log-log, beside a proportional line.",
    ),
}

INTRODUCTION = """\
# Performance

What volref takes, and what others take for the same image. Every figure is from the machine that its
section names, and is made again by

```console
{commands}
$ python -m tests.benchmarks.page
```

of which the last writes this page and its plots from the figures in `tests/benchmarks/results`. Times
differ from machine to machine; ratios of times of one run do so less.
"""


def performance_page(results: Mapping[str, Figures]) -> str:
    """Return the page with the sections that there are figures for, in the order of `SECTIONS`."""
    chosen = {name: section for name, section in SECTIONS.items() if name in results}
    commands = "\n".join(f"$ {section.command}" for section in chosen.values())
    parts = [INTRODUCTION.format(commands=commands)]
    for name, section in chosen.items():
        figures = results[name]
        parts.append(f"## {section.title}\n")
        parts.append(f"Measured on {figures['date']} on: {figures['machine']}.\n")
        if section.plot is not None:
            parts.append(f"![{section.plot_shows}]({IMAGES}/performance-{name}.svg)\n")
        parts.append(section.text(figures))
    return "\n".join(parts).rstrip("\n") + "\n"


def load_results(folder: Path = RESULTS) -> dict[str, Figures]:
    """Return the figures of the sections that have any."""
    files = {name: folder / f"{name}.json" for name in SECTIONS}
    return {
        name: json.loads(file.read_text(encoding="utf-8")) for name, file in files.items() if file.exists()
    }


def write_page(results: Mapping[str, Figures], page: Path = PAGE) -> None:
    """Write the page, and its plots (SVG and PNG) into the folder of images beside it."""
    images = page.parent / IMAGES
    images.mkdir(parents=True, exist_ok=True)
    for name, figures in results.items():
        plot = SECTIONS[name].plot
        if plot is not None:
            for suffix in (".svg", ".png"):
                plot(figures, images / f"performance-{name}{suffix}")
    page.write_text(performance_page(results), encoding="utf-8")


if __name__ == "__main__":
    write_page(load_results())
