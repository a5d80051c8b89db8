"""Draw the picture of the page of verdicts: `python -m data_gen.verdicts`.

Writes docs/images/report.png, what Chromium shows of a page about the demo's head: right images and wrong
ones, drawn by emulations.  With --page OUT.html the page too.  Takes some minutes, and needs the extra
`webgl` and Chromium (on the PATH, or its path in VOLREF_CHROMIUM).  Exit codes: 0 written, 2 refused, with
one sentence on stderr.
"""

import argparse
import io
import os
import shutil
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from data_gen.gallery.sheets import write_sheet
from volref.arrays import Bytes
from volref.emulation.catalogue import named
from volref.emulation.device import Device
from volref.emulation.passes import emulate
from volref.errors import FormatError, SceneError
from volref.formats import codes_of
from volref.oracle.accepting import accept
from volref.oracle.explanation import explain
from volref.oracle.faults.fault import Subject
from volref.oracle.faults.table import FAULTS
from volref.oracle.verdict import check
from volref.report.demo import demo_scene
from volref.report.judging import write_judging
from volref.report.verdicts.cases import Case
from volref.report.verdicts.making import case_of

PIXELS = 112
DEVICE = "swiftshader"

# Faults that are tried: those that such a scene suggests.
TRIED = (
    "A2-slice-off-by-one",
    "A3-half-slice",
    "A3-no-interpolation",
    "G1-half-voxel",
    "O1-uncorrected",
    "O1-stale",
    "O2-add-alpha",
    "T1-early-stop",
    "T4-step",
    "L1-half-texel",
    "F1-nearest",
    "D1-window-depth",
)

# How much of the page the picture shows, in CSS pixels.
WIDTH, HEIGHT = 1180, 1430


@dataclass(frozen=True)
class Drawn:
    """What was drawn: by which program, with which fault and strength, or with none."""

    pipeline: str
    fault: str = ""
    strength: float = 1.0

    @property
    def name(self) -> str:
        """Name of the image."""
        return f"head, {self.pipeline}: {FAULTS[self.fault].title if self.fault else 'as it should be'}"


IMAGES = (
    Drawn("texture3d", "G1-half-voxel", 0.5),
    Drawn("arbelaz2016", "O2-add-alpha"),
    Drawn("texture3d"),
    Drawn("arbelaz2016"),
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    options = _parser().parse_args(arguments)
    try:
        with TemporaryDirectory() as folder:
            page = options.page or Path(folder) / "verdicts.html"
            write_judging(page, [judged(drawn) for drawn in IMAGES], overwrite=True)
            (options.docs / "images").mkdir(parents=True, exist_ok=True)
            write_sheet(options.docs / "images" / "report.png", photographed(page.resolve()))
    except (FormatError, SceneError, OSError) as error:
        print(f"verdicts: {error}", file=sys.stderr)
        return 2
    return 0


def judged(drawn: Drawn) -> Case:
    """Return an image, drawn as it says, with its verdict and the reason for it."""
    subject = Subject(demo_scene(PIXELS, PIXELS), named(drawn.pipeline), Device.named(DEVICE))
    codes = picture_of(subject, drawn)
    acceptance = accept(subject.scene, subject.pipeline, subject.device)
    verdict = check(codes, acceptance)
    why = None
    if drawn.fault:
        parts = subject.scene, subject.pipeline, subject.device
        why = explain(codes, *parts, acceptance=acceptance, faults=_suiting(subject), pairs=False)
    return case_of(drawn.name, acceptance, verdict, explanation=why, subject=subject)


def picture_of(subject: Subject, drawn: Drawn) -> Bytes:
    """Return the bytes of the canvas (H, W, 4) that the program leaves."""
    if not drawn.fault:
        return emulate(subject.scene, subject.pipeline, subject.device).rgba8
    fault = FAULTS[drawn.fault]
    changed = fault.changed(subject, drawn.strength)
    canvas = emulate(changed.scene, changed.pipeline, changed.device).rgba
    return codes_of(fault.after(canvas, subject, drawn.strength)).astype(np.uint8)


def photographed(page: Path) -> Bytes:
    """Return the upper part of a page (HEIGHT, WIDTH, 3) as Chromium shows it."""
    from PIL import Image
    from playwright.sync_api import sync_playwright

    asked = os.environ.get("VOLREF_CHROMIUM", "chromium")
    found = shutil.which(asked)
    if found is None:
        message = f"{asked} is not on the PATH; apt-get install chromium, or set VOLREF_CHROMIUM to its path"
        raise FormatError(message)
    with sync_playwright() as started:
        browser = started.chromium.launch(executable_path=found, args=["--no-sandbox"])
        view = browser.new_page(
            viewport={"width": WIDTH, "height": HEIGHT}, color_scheme="light", reduced_motion="reduce"
        )
        view.goto(page.as_uri())
        view.locator("details.case .place:has-text('x ')").first.wait_for()
        shot = view.screenshot()
        browser.close()
    with Image.open(io.BytesIO(shot)) as image:
        return np.asarray(image.convert("RGB"))


def _suiting(subject: Subject) -> list[str]:
    return [key for key in TRIED if FAULTS[key].suits(subject)]


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="data_gen.verdicts", description="Draw docs/images/report.png.")
    parser.add_argument(
        "--docs", type=Path, default=Path("docs"), metavar="DIR", help="folder of the pages (default docs)"
    )
    parser.add_argument("--page", type=Path, metavar="OUT.html", help="keep the page as well")
    return parser


if __name__ == "__main__":
    sys.exit(main())
