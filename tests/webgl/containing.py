"""Images of real WebGL in their acceptance intervals: `python -m tests.webgl.containing` writes the page.

With words it only prints, for the implementations and the cases whose names hold all of them.
"""

import sys
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.webgl.cases import Case, cases, jitter_of
from tests.webgl.engine import Engine, engine
from tests.webgl.scenes import EXAMPLES
from volref import accept
from volref.emulation.device import Device

ENGINES = ("swiftshader", "llvmpipe")

# Scenes that are drawn in floats too, which show what bytes round away.
FLOATS = ("oblique", "turned", "dense", "radar storm")

# A set that both are members of, as far as filters go that do not round results; see the page.
SET = "webgl-highp"

PAGE = Path(__file__).parents[2] / "docs" / "containment.md"

HEAD = """# Held to real WebGL: acceptance intervals

Every image that two implementations of WebGL draw of the [systems](systems/index.md) must lie in the interval
that [accept](guide/intervals.md) derives for that machine, in every pixel and channel, bytes and floats.
`python -m tests.webgl.containing` draws them and writes this page; `pytest -m webgl` holds a part of it.

- *outside* are pixels of real images that lie outside: it must be 0;
- *p50* and *p99* are how wide intervals are, in 1/255, before the canvas or a mean of frames is stored in
  bytes: half of the drawn pixels, and 99 of 100, have narrower ones;
- *worst p99* is that of the scene with the widest;
- *ambiguous* is the share of drawn pixels that hang on a comparison by more than half a byte, in the scene
  with most of them.
"""

MACHINES = """
## Machines whose filter and window grid are emulated

| pipeline | machine | images | pixels | outside | p50 | p99 | worst p99 | ambiguous |
|---|---|---|---|---|---|---|---|---|
"""

SETS = """
## `webgl-highp`: filters of 8 bits, rounded somehow

No image is drawn for these: they are how wide a set of machines is. Where it says *no use*, `accept` says so
and names the probe that would settle it.

| pipeline | scenes | p50 | p99 | worst p99 | ambiguous |
|---|---|---|---|---|---|
"""


@dataclass(frozen=True)
class Contained:
    """One image: drawn pixels, how many lie outside, widths (n,) in 1/255, share of ambiguous pixels."""

    pixels: int
    outside: int
    widths: np.ndarray
    ambiguous: float
    advice: str

    def __str__(self) -> str:
        p50, p99 = (self.percentile(p) for p in (50, 99))
        return (
            f"{self.outside} of {self.pixels} px outside, p50 {p50:.3f}, p99 {p99:.3f}, {self.ambiguous:.2%}"
        )

    def percentile(self, percent: float) -> float:
        # Without bounds a width is infinite: between two of them nothing is to be interpolated.
        return float(np.percentile(self.widths, percent, method="higher")) if len(self.widths) else 0.0


def contained(opened: Engine | None, case: Case, device: str) -> Contained:
    """Judge the canvas that an engine draws of a case; without one, only how wide the interval is."""
    scene, pipeline = EXAMPLES[case.scene].make(), case.described()
    jitter, frames = jitter_of(case.system, scene), case.system.frames
    acceptance = accept(scene, pipeline, Device.named(device), jitter, frames)
    outside = 0
    if opened is not None:
        drawn = case.system.draw(opened, scene, pipeline, jitter=jitter, frames=frames)["canvas"]
        # A float64 of 255ths is off by its own rounding only.
        image, rounding = (drawn / 255, 1e-12) if drawn.dtype == np.uint8 else (drawn.astype(float), 0.0)
        # What is no number is compared with what the machine stores for it.
        inside = (image >= acceptance.lo - rounding) & (image <= acceptance.hi + rounding)
        inside |= np.isnan(image) & np.isnan(acceptance.nominal)
        outside = int((~inside).any(axis=-1).sum())
    widths = 255 * acceptance.width[acceptance.drawn]
    pixels = int(acceptance.drawn.sum())
    return Contained(pixels, outside, widths, acceptance.share_ambiguous, acceptance.advice)


def main(words: list[str]) -> None:
    """Print what the words choose; without any, write the page."""
    asked = [name for name in ENGINES if name in words] or list(ENGINES)
    some = [case for case in cases() if case.format == "unorm8" or case.scene in FLOATS]
    chosen = [case for case in some if all(word in str(case) for word in words if word not in ENGINES)]
    found: dict[tuple[str, str], list[tuple[Case, Contained]]] = defaultdict(list)
    for name in asked:
        with engine(name) as opened:
            for case in chosen:
                one = contained(opened, case, name)
                print(f"{name}, {case}: {one}", flush=True)
                found[case.pipeline, name].append((case, one))
    for case in chosen:
        if not words and case.format == "float":
            one = contained(None, case, SET)
            print(f"{SET}, {case}: {one}", flush=True)
            found[case.pipeline, SET].append((case, one))
    if not words:
        PAGE.write_text("".join(page(found)), encoding="utf-8")


def page(found: dict[tuple[str, str], list[tuple[Case, Contained]]]) -> Iterator[str]:
    """Yield the parts of docs/containment.md."""
    yield HEAD + MACHINES
    for (pipeline, name), ones in sorted(found.items()):
        if name != SET:
            outside = sum(one.outside for _, one in ones)
            pixels = sum(one.pixels for _, one in ones)
            yield row(pipeline, name, str(len(ones)), f"{pixels:,}", str(outside), *widths(ones))
    yield SETS
    for (pipeline, name), ones in sorted(found.items()):
        if name == SET:
            useless = any(one.advice for _, one in ones)
            yield row(pipeline, str(len(ones)), *(("no use",) * 4 if useless else widths(ones)))


def widths(ones: list[tuple[Case, Contained]]) -> Iterator[str]:
    """Yield the cells of widths and ambiguous pixels, of canvases of floats."""
    floats = [one for case, one in ones if case.format == "float" and len(one.widths)]
    together = np.concatenate([one.widths for one in floats])
    for percent in (50, 99):
        yield f"{np.percentile(together, percent, method='higher'):.3f}"
    yield f"{max(one.percentile(99) for one in floats):.3f}"
    yield f"{max(one.ambiguous for one in floats):.2%}"


def row(*cells: str) -> str:
    return f"| {' | '.join(cells)} |\n"


if __name__ == "__main__":
    main(sys.argv[1:])
