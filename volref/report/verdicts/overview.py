"""The head of the page: how many images passed, and a line for each that leads to it."""

from html import escape

from volref.report.markup import inline_image
from volref.report.verdicts.cases import KINDS, Case
from volref.report.verdicts.pixels import sample_of
from volref.report.verdicts.sections import badge
from volref.report.verdicts.viewer import choice
from volref.report.verdicts.views import shown
from volref.report.verdicts.words import MEANINGS, cause_words, counts_of, headline, outside_words

# Pixels of the picture in a line.
MOST_OF_A_LINE = 64 * 64


def overview(cases: list[Case], title: str) -> str:
    """Return heading, counts, filter, and a line for each case."""
    count = counts_of(cases)
    tiles = "".join(
        f'<div class="{kind}"><dt>{MEANINGS[kind]}</dt><dd>{count[kind]}</dd></div>'
        for kind in KINDS
        if count[kind] or kind in ("fail", "pass")
    )
    lines = "".join(_line(case, number) for number, case in enumerate(cases, start=1))
    return (
        f'<header><h1>{escape(title)}</h1><p class="headline">{escape(headline(cases))}</p></header>'
        f'<dl class="figures counts">{tiles}</dl>{_filter(count, len(cases)) if len(cases) > 1 else ""}'
        f'<nav aria-label="Images"><ul class="lines">{lines}</ul></nav>'
    )


def _filter(count: dict[str, int], every: int) -> str:
    options = {"every": f"All ({every})"}
    options |= {kind: f"{kind.capitalize()} ({count[kind]})" for kind in KINDS if count[kind]}
    return (
        f'<div class="filter" hidden>{choice("Show", "kind", 0, options)}'
        '<label class="find">Name contains '
        '<input type="search" autocomplete="off" spellcheck="false"></label>'
        '<p class="found" role="status"></p></div>'
    )


def _line(case: Case, number: int) -> str:
    sample = sample_of(case.verdict.excess, MOST_OF_A_LINE)
    codes = shown(sample(case.candidate))
    # The line says all there is to say: the picture is for the eye alone.
    picture = inline_image(codes, "", *codes.shape[1::-1])
    cause = f'<span class="cause">{escape(cause_words(case.why))}</span>' if case.why is not None else ""
    return (
        f'<li data-kind="{case.kind}" data-name="{escape(case.name.lower())}">'
        f'<a href="#case-{number}">{picture}'
        f'<span class="badges">{badge(case)}</span><span class="title">{escape(case.name)}</span>'
        f'<span class="brief">{escape(outside_words(case))}</span>{cause}</a></li>'
    )
