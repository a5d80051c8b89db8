"""The page docs/systems/against_truth.md."""

from collections.abc import Mapping

import volref as vr
from data_gen.systems.figures import FINER, UNIT_DISTANCE, Distance

HEAD = f"""# How far from the truth

The head of the demo, drawn by every program as it is in the catalogue and held against its certified truth,
which is off by 1/2550 at most. Numbers are differences of red, green and blue in 1/255: their mean, the
99th percentile and the largest. Tone maps and gamma are taken off first. Opacities are meant for
{UNIT_DISTANCE:g} mm, or for a step where the program does not correct them; factors that it leaves open
suit the scene. One command draws this page
and the pictures of the others; it takes some minutes:

    $ python -m data_gen.systems

*As it is*: the program with its targets of 8 bits. *Exact targets*: with textures and targets that lose
nothing. *And a fine step*: with a step {FINER} times finer too. What is left then is what the program does
differently from the scene's own integral: where it puts its slices, what it takes for opacity, what it gets
wrong.

| program | as it is | exact targets | and a fine step |
| --- | --- | --- | --- |
"""


def page(rows: Mapping[str, Mapping[str, Distance]]) -> str:
    """Return the page as Markdown, one row for each program."""
    lines = (f"| `{name}` | {' | '.join(map(_words, found.values()))} |" for name, found in rows.items())
    titles = (f"- `{name}`: {vr.pipelines()[name].title}." for name in rows)
    return HEAD + "\n".join(lines) + "\n\n" + "\n".join(titles) + "\n"


def _words(found: Distance) -> str:
    return f"{found.mean:.2f} / {found.p99:.1f} / {found.most:.0f}"
