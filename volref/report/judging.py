"""One page of verdicts: every judged image with its interval, its difference, and why."""

from collections.abc import Sequence
from importlib import resources
from pathlib import Path

from volref.io.atomic import write_text
from volref.report.markup import document
from volref.report.verdicts.cases import KINDS, Case
from volref.report.verdicts.overview import overview
from volref.report.verdicts.pixels import sample_of
from volref.report.verdicts.sections import case_section
from volref.report.verdicts.views import chips, palette

# Pixels whose numbers are on the page: of one image, and of all together.
MOST_OF_AN_IMAGE = 256 * 256
MOST_OF_A_PAGE = 64 * MOST_OF_AN_IMAGE

SCRIPTS = ("numbers.js", "painting.js", "viewer.js", "page.js")


def judging_page(cases: Sequence[Case], *, title: str = "Verdicts") -> str:
    """Return an HTML page of judged images, those that failed first; it needs nothing from elsewhere.

    Images of more than 256 x 256 pixels, fewer if there are more than 64 images, are reduced: of every block
    of pixels the page shows the worst one, with its own numbers.
    """
    ordered = sorted(cases, key=lambda case: KINDS.index(case.kind))
    most = min(MOST_OF_AN_IMAGE, MOST_OF_A_PAGE // max(len(ordered), 1))
    sections = [
        case_section(case, number, sample_of(case.verdict.excess, most))
        for number, case in enumerate(ordered, start=1)
    ]
    body = [
        overview(ordered, title),
        '<section aria-label="Images in full"><h2>Images</h2>',
        *sections,
        "</section>",
        '<dialog class="enlarged" aria-label="Target"><form method="dialog"><button>Close</button></form>'
        "<figure></figure></dialog>",
        f'<script type="application/json" id="palette">{palette()}</script>',
    ]
    script = "\n".join(_data(name) for name in SCRIPTS)
    return document(title, "\n".join(body), style=_data("verdicts.css") + chips(), script=f"\n{script}")


def write_judging(
    path: str | Path, cases: Sequence[Case], *, title: str = "Verdicts", overwrite: bool = False
) -> None:
    """Write the page of judged images to an .html file, whole or not at all.

    Raises
    ------
    FormatError
        If the file exists and `overwrite` is False, or cannot be written.
    """
    write_text(path, judging_page(cases, title=title), overwrite=overwrite)


def _data(name: str) -> str:
    return resources.files("volref.report.verdicts").joinpath(name).read_text(encoding="utf-8")
