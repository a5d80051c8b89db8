"""Draw all systems on all scenes and write how far emulations are from real WebGL: `python -m tests.webgl`.

With words it only prints, for the implementations and the cases whose names hold all of them:

    python -m tests.webgl swiftshader congote2012 oblique
"""

import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

from tests.webgl.browser import RENDERER
from tests.webgl.cases import Case, cases, compared
from tests.webgl.engine import engine
from tests.webgl.figures import Figures, together

ENGINES = ("swiftshader", "llvmpipe")

PAGE = Path(__file__).parents[2] / "docs" / "webgl.md"

HEAD = """# Held to real WebGL

Every system of the [catalogue](systems/index.md) is written a second time, in GLSL under `tests/webgl`, and
drawn in headless Chromium by two implementations of WebGL that share no code. `python -m tests.webgl` draws
them all and writes this page; `pytest -m webgl` holds the same figures to bounds.

{renderers}

Each pipeline has a canvas of floats and one of bytes, on scenes of {size} pixels that differ in camera,
voxels, atlas, opacity and meshes. Only pixels that one of the two sides has drawn count.

- *p50*, *p99* and *max* are of the largest difference of a pixel's channels in targets of floats, in
  proportion to numbers beyond 1;
- *exact* are pixels of which all bytes are equal;
- *off* are pixels, in floats or bytes, that differ by more than 1/255, and *unexplained* those of them that
  `volref.emulation.ambiguity` had not named beforehand: pixels that hang on a comparison, such as whether a
  ray takes one more sample.

Read p99 for how closely the arithmetic is met, and *unexplained* for whether anything is left that is not
understood: it should be 0.
"""

CANVAS = """
## Canvas

| pipeline | drawn by | scenes | p50 | p99 | max | exact bytes | pixels | off | unexplained |
|---|---|---|---|---|---|---|---|---|---|
"""

PASSES = """
## Passes before it

What a frame capture would show, from the same drawings.

| pipeline | target | drawn by | p50 | p99 | max | exact bytes | pixels | off | unexplained |
|---|---|---|---|---|---|---|---|---|---|
"""


def main(words: list[str]) -> None:
    """Print the figures of what the words choose; without any, write the page."""
    asked = [name for name in ENGINES if name in words] or list(ENGINES)
    chosen = [case for case in cases() if all(word in str(case) for word in words if word not in ENGINES)]
    renderers, found = {}, {}
    for name in asked:
        with engine(name) as opened:
            renderers[name] = opened.call(RENDERER, "")
            for case in chosen:
                for target, figures in compared(opened, case).items():
                    print(f"{name}, {case}, {target}: {figures}", flush=True)
                    found[name, case, target] = figures
    if not words:
        PAGE.write_text("".join(page(renderers, found)), encoding="utf-8")


def page(renderers: dict[str, str], found: dict[tuple[str, Case, str], Figures]) -> Iterator[str]:
    """Yield the parts of docs/webgl.md."""
    lines = "\n".join(f"- `{name}`: {renderer}" for name, renderer in renderers.items())
    yield HEAD.format(renderers=lines, size="96 x 72")
    rows, scenes = defaultdict(list), defaultdict(set)
    for (name, case, target), figures in found.items():
        rows[case.pipeline, target, name].append(figures)
        scenes[case.pipeline].add(case.scene)
    yield CANVAS
    for (pipeline, target, name), parts in sorted(rows.items()):
        if target == "canvas":
            yield row(pipeline, name, str(len(scenes[pipeline])), *shown(parts))
    yield PASSES
    for (pipeline, target, name), parts in sorted(rows.items()):
        if target != "canvas":
            yield row(pipeline, f"`{target}`", name, *shown(parts))


def shown(parts: list[Figures]) -> Iterator[str]:
    """Yield the cells of percentiles, exact bytes and counts."""
    floats, whole = ([part for part in parts if part.bytes == kind] for kind in (False, True))
    if floats:
        error = together(floats)
        yield from (f"{number:.1e}" for number in (error.percentile(50), error.percentile(99), error.worst))
    else:
        yield from ("", "", "")
    # Rounded down: what says 100 % is.
    yield f"{int(together(whole).exact * 1e5) / 1e3:.3f} %" if whole else ""
    yield f"{sum(part.pixels for part in parts):,}"
    yield str(sum(part.off for part in parts))
    yield str(sum(part.unexplained for part in parts))


def row(*cells: str) -> str:
    return f"| {' | '.join(cells)} |\n"


if __name__ == "__main__":
    main(sys.argv[1:])
