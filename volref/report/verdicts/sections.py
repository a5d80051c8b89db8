"""A case as a part of the page, closed unless something is wrong with it."""

from collections.abc import Sequence
from html import escape

import numpy as np

from volref.arrays import Bytes, Floats
from volref.oracle.explanation import Explanation, Ranked
from volref.oracle.faults.table import FAULTS
from volref.report.markup import facts, inline_image, paragraph, scrolling
from volref.report.targets import target_picture
from volref.report.verdicts.cases import Case
from volref.report.verdicts.pixels import Sample
from volref.report.verdicts.viewer import stills, viewer
from volref.report.verdicts.views import difference_of, difference_picture, scale_of, shown
from volref.report.verdicts.words import (
    MARKS,
    cause_rows,
    metric_rows,
    outside_words,
    provenance_rows,
    share_words,
    width_rows,
)

# Pixels of a render target's picture: larger ones are shown by every second pixel, and so on.
MOST_OF_A_TARGET = 192 * 192

# Faults that a case lists.
MOST_OF_A_RANKING = 8


def case_section(case: Case, number: int, sample: Sample) -> str:
    """Return everything about one case; `number` tells its controls from those of others."""
    kind = case.kind
    parts = [
        paragraph(case.verdict.message),
        viewer(case, number, sample),
        stills(case, sample),
        _titled("Why", _explanation(case, case.why, sample)) if case.why is not None else "",
        _titled("Pass by pass", _passes(case)) if case.passes else "",
        '<div class="columns">',
        _titled("Metrics", facts(metric_rows(case.verdict.metrics), "Metrics")),
        _titled("The interval", facts(width_rows(case), "The interval") + _causes(case)),
        _titled("Provenance", facts(provenance_rows(case), "Provenance")),
        "</div>",
    ]
    return (
        f'<details class="case {kind}" id="case-{number}" data-kind="{kind}"'
        f"{' open' * (kind != 'pass')}>"
        f"<summary>{badge(case)}<h3>{escape(case.name)}</h3>"
        f'<span class="brief">{escape(outside_words(case))}</span></summary>'
        f"{''.join(parts)}</details>"
    )


def badge(case: Case) -> str:
    """Return what came of a case as a word with a mark and a colour."""
    mark = f'<span aria-hidden="true">{MARKS[case.kind]}</span>'
    chosen = "" if case.acceptance.justified else ' <span class="badge chosen">unjustified</span>'
    return f'<span class="badge {case.kind}">{mark} {case.kind}</span>{chosen}'


def _titled(title: str, content: str) -> str:
    return f"<div><h4>{escape(title)}</h4>{content}</div>"


def _explanation(case: Case, why: Explanation, sample: Sample) -> str:
    parts = [paragraph(why.message)]
    if why.counterfactual is not None:
        parts.append(_counterfactual(case, why.counterfactual, sample))
    if why.ranking:
        parts.append(_ranking(why.ranking))
    return "".join(parts)


def _counterfactual(case: Case, image: Floats, sample: Sample) -> str:
    """Return the candidate, what a program with the fault draws, and what is left between them."""
    candidate, drawn = sample(case.candidate), sample(image)
    left = difference_of(candidate, drawn)
    scale = scale_of(left)
    rest = (
        f"candidate less counterfactual, black is 0, the ends are ±{scale}/255" if left.any() else "nothing"
    )
    pictures: list[tuple[str, Bytes, str]] = [
        ("Candidate", shown(candidate), "what was judged"),
        ("Counterfactual", shown(drawn), "what the program draws with the first fault below"),
        ("What is left", difference_picture(left, scale), rest),
    ]
    return f'<div class="trio">{"".join(_figure(case, *picture) for picture in pictures)}</div>'


def _figure(case: Case, name: str, codes: Bytes, about: str) -> str:
    picture = inline_image(codes, f"{name} for {case.name}: {about}", *codes.shape[1::-1])
    return f"<figure>{picture}<figcaption><strong>{name}</strong> {escape(about)}</figcaption></figure>"


def _ranking(ranking: Sequence[Ranked]) -> str:
    seen = [one for one in ranking[:MOST_OF_A_RANKING] if one.explained > 0] or ranking[:1]
    rows = "".join(
        f'<tr><th scope="row">{escape(one.fault)}</th><td>{escape(title_of(one.fault))}</td>'
        f"<td>{escape(_strength(one.strength))}</td>"
        f"<td>{_bar(one.explained, 1.0)} {share_words(one.explained)}</td></tr>"
        for one in seen
    )
    names = ("fault", "what it is", "strength", "explains of what is outside")
    head = "".join(f'<th scope="col">{name}</th>' for name in names)
    table = scrolling("Faults", f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>")
    rest = len(ranking) - len(seen)
    said = f"{rest} other fault{'s' * (rest > 1)} tried: less than these, or nothing." if rest else ""
    return table + paragraph(said)


def _strength(strength: float | tuple[float, ...]) -> str:
    return ", ".join(f"{one:.4g}" for one in (strength if isinstance(strength, tuple) else (strength,)))


def title_of(key: str) -> str:
    """Return what a fault is, of two joined what both are, "" for one that is not in the table."""
    return "; ".join(FAULTS[part].title for part in key.split(" + ") if part in FAULTS)


def _causes(case: Case) -> str:
    rows = cause_rows(case)
    if not rows:
        return ""
    widest = max(mean for _, mean, _ in rows)
    body = "".join(
        f'<tr><th scope="row">{escape(name)}</th><td>{_bar(mean, widest)} {mean:.3g}</td>'
        f"<td>{p99:.3g}</td></tr>"
        for name, mean, p99 in rows
    )
    head = '<th scope="col">cause</th><th scope="col">mean, 1/255</th><th scope="col">p99, 1/255</th>'
    return scrolling("Causes", f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>")


def _bar(part: float, whole: float) -> str:
    """Return a bar that the number beside it belongs to."""
    share = 100 * min(max(part / whole if whole > 0 else 0.0, 0.0), 1.0)
    return f'<span class="bar" aria-hidden="true"><span style="width:{share:.1f}%"></span></span>'


def _passes(case: Case) -> str:
    items = "".join(
        f'<li><button type="button" class="target"><span class="order">{order}</span>'
        f"{_target(name, target)}<span>{escape(name)}</span></button></li>"
        for order, (name, target) in enumerate(case.passes.items(), start=1)
    )
    return f'<ol class="passes">{items}</ol>'


def _target(name: str, target: Floats) -> str:
    codes = target_picture(target)
    codes = codes[..., None].repeat(3, axis=-1) if codes.ndim == 2 else codes[..., :3]
    every = max(1, int(np.ceil(np.sqrt(codes.shape[0] * codes.shape[1] / MOST_OF_A_TARGET))))
    codes = codes[::every, ::every]
    size = " x ".join(str(length) for length in target.shape[:-1][::-1])
    return inline_image(codes, f"{name}, {size}, {target.shape[-1]} channels", *codes.shape[1::-1])
