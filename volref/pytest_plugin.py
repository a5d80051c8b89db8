"""The plugin for pytest: a test hands its image to the fixture `volref_golden`, and gets a verdict.

pytest loads it wherever volref is installed, so that whatever is dear is imported when a test asks for it.
"""

import json
import os
import re
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, TypedDict, Unpack

import pytest

from volref.errors import FormatError, SceneError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from volref.emulation.device import Device
    from volref.emulation.pipeline import Pipeline
    from volref.golden.bundle import Bundle
    from volref.oracle.candidate import ImageSource
    from volref.oracle.faults.fault import Subject
    from volref.oracle.verdict import Verdict
    from volref.report.verdicts.cases import Case
    from volref.scene.scene import Scene


class Asked(TypedDict, total=False):
    """What a test may say of its golden and its image.

    scene, pipeline, device, jitter, frames: what is drawn, as `volref.accept` takes it, the scene also as a
    file; with it, the golden is made, and is held to be of just that.
    alpha, encoding, mask: how the image is held, as `volref.check` takes them.
    """

    scene: "Scene | str | Path"
    pipeline: "str | Pipeline"
    device: "str | Device"
    jitter: "ArrayLike | None"
    frames: int
    alpha: str | None
    encoding: str | None
    mask: "ImageSource | None"


@dataclass
class Run:
    """What a run has come to so far.

    cases: judged images for the page.  written: folders of goldens that were made.
    """

    cases: "list[Case]" = field(default_factory=list)
    written: list[Path] = field(default_factory=list)


RUN = pytest.StashKey[Run]()


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the plugin's options and its setting."""
    group = parser.getgroup("volref", "golden images")
    group.addoption(
        "--volref-update",
        action="store_true",
        help="make goldens that are missing, or that were made of another scene, pipeline or device",
    )
    group.addoption(
        "--volref-report",
        metavar="DIR",
        help="folder for a page of all verdicts, and for the images of those that failed",
    )
    parser.addini(
        "volref_goldens", "folder of the goldens, beside the test that uses them", default="goldens"
    )


def pytest_configure(config: pytest.Config) -> None:
    """Begin a run."""
    config.stash[RUN] = Run()


@pytest.fixture
def volref_golden(
    request: pytest.FixtureRequest,
    tmp_path_factory: pytest.TempPathFactory,
) -> "Callable[..., Verdict]":
    """Assert that an image is one that a correct machine may draw of a golden.

    `volref_golden(image, name)`, with `Asked` as further words; the name is that of the test by default.
    Returns the verdict of an image that passed.
    """
    used: set[str] = set()

    def golden(image: "ImageSource", name: str | None = None, **asked: Unpack[Asked]) -> "Verdict":
        refused = ""
        try:
            chosen = _name(request, name, used)
            bundle, verdict = _judged(request, chosen, image, asked)
        except (SceneError, FormatError) as error:
            refused = str(error)
        if refused:  # outside of `except`, whose traceback says nothing more
            pytest.fail(refused, pytrace=False)
        # Not by record_property: it warns of a schema of JUnit whose readers take properties all the same.
        request.node.user_properties.extend(_properties(chosen, verdict).items())
        if verdict.passed:
            if verdict.status != "inside":
                warnings.warn(f"{chosen}: {verdict.message}", stacklevel=2)
            return verdict
        place = _place_of_images(request, tmp_path_factory, chosen)
        _write_images(place, bundle, verdict)
        pytest.fail(f"{chosen}: {verdict.message}\nimages: {place}", pytrace=False)

    return golden


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Write the page of verdicts."""
    folder = session.config.getoption("--volref-report")
    cases = session.config.stash[RUN].cases
    if folder is None or not cases:
        return
    from volref.report.judging import write_judging

    worker = os.environ.get("PYTEST_XDIST_WORKER")
    page = Path(folder) / ("index.html" if worker is None else f"index-{worker}.html")
    page.parent.mkdir(parents=True, exist_ok=True)
    write_judging(page, cases, title="Golden images", overwrite=True)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    """Say which goldens were made, and where the page is."""
    state = config.stash[RUN]
    folder = config.getoption("--volref-report")
    if not state.written and not (folder and state.cases):
        return
    terminalreporter.section("volref")
    for golden in state.written:
        preview = golden / "expected" / "preview.png"
        terminalreporter.write_line(f"made {golden}: look at {preview}, then commit the folder")
    if folder and state.cases:
        terminalreporter.write_line(f"page of verdicts: {Path(folder) / 'index.html'}")


def _name(request: pytest.FixtureRequest, name: str | None, used: set[str]) -> str:
    """Return the name of a golden: as given, else that of the test, which may have but one such."""
    chosen = re.sub(r"[^A-Za-z0-9._-]+", "-", request.node.name).strip("-.") if name is None else name
    if chosen in used:
        message = f"the name of a golden must be used once in a test, got {chosen!r} again; "
        raise SceneError(message + "give each golden its own name")
    used.add(chosen)
    return chosen


def _judged(
    request: pytest.FixtureRequest, name: str, image: "ImageSource", asked: Asked
) -> "tuple[Bundle, Verdict]":
    """Return the golden of that name and the verdict on an image, after making it if that was asked for."""
    from volref.golden.checking import check_bundle
    from volref.golden.keeping import golden_folder, kept_golden, updated_golden

    unknown = sorted(asked.keys() - Asked.__annotations__.keys())
    if unknown:
        message = f"volref_golden must be told of {', '.join(Asked.__annotations__)}, got {unknown[0]!r}; "
        raise SceneError(message + "leave it out")
    config = request.config
    folder = golden_folder(request.path.parent / config.getini("volref_goldens"), name)
    subject = _subject(asked)
    if config.getoption("--volref-update") and subject is not None and updated_golden(folder, subject):
        config.stash[RUN].written.append(folder)
    bundle = kept_golden(folder, subject)
    how = (asked.get("alpha"), asked.get("encoding"), asked.get("mask"))
    verdict = check_bundle(bundle, image, alpha=how[0], encoding=how[1], mask=how[2])
    if config.getoption("--volref-report"):
        from volref.report.verdicts.cases import Case

        case = Case(request.node.nodeid, bundle.acceptance, verdict, passes=bundle.passes)
        config.stash[RUN].cases.append(case)
    return bundle, verdict


def _subject(asked: Asked) -> "Subject | None":
    """Return what a golden is to be made of; None if the test leaves that to the golden."""
    given = [key for key in ("scene", "pipeline", "device", "jitter", "frames") if key in asked]
    if not given:
        return None
    missing = [key for key in ("scene", "pipeline", "device") if key not in given]
    if missing:
        message = f"volref_golden must be given scene, pipeline and device together, got no {missing[0]}; "
        raise SceneError(message + "add it (device='webgl-highp' is any GPU), or name a golden that is there")
    from volref.golden.keeping import subject_of

    jitter, frames = asked.get("jitter"), asked.get("frames", 1)
    return subject_of(asked["scene"], asked["pipeline"], asked["device"], jitter, frames)


def _properties(name: str, verdict: "Verdict") -> dict[str, object]:
    """Return what JUnit is told."""
    found: dict[str, object] = {
        "volref_golden": name,
        "volref_status": verdict.status,
        "volref_outside": int(verdict.outside.sum()),
    }
    far = verdict.worst
    if far is not None:
        found["volref_worst"] = f"pixel ({far.x}, {far.y}) {far.channel} by {far.excess:.6g}"
    return found


def _place_of_images(request: pytest.FixtureRequest, temporary: pytest.TempPathFactory, name: str) -> Path:
    """Return the folder for the images of a golden that failed."""
    folder = request.config.getoption("--volref-report")
    if folder is None:
        return temporary.mktemp(name)
    place = Path(folder) / re.sub(r"[^A-Za-z0-9._-]+", "-", request.node.nodeid) / name
    place.mkdir(parents=True, exist_ok=True)
    return place


def _write_images(place: Path, bundle: "Bundle", verdict: "Verdict") -> None:
    """Write the images of a verdict, for people, and its numbers."""
    from volref.io.atomic import write_text
    from volref.io.npy import write_npy
    from volref.io.png import write_png
    from volref.report.verdict_images import verdict_images

    for name, picture in verdict_images(bundle.acceptance, verdict).items():
        write_png(place / f"{name}.png", picture, overwrite=True)
    write_npy(place / "candidate.npy", verdict.candidate, overwrite=True)
    text = json.dumps(verdict.as_dict(), indent=1, allow_nan=False)
    write_text(place / "verdict.json", f"{text}\n", overwrite=True)
