"""The first thing to run: a real head with its white matter, from the data in the wheel alone."""

import dataclasses
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from volref.errors import FormatError
from volref.image import encode_rgba8
from volref.io.atomic import check_free, write_text
from volref.io.npy import write_npy
from volref.io.png import write_png
from volref.io.scenes import load_scene
from volref.report.figures import figures_of
from volref.report.html import render_page
from volref.report.pictures import distance_map, error_map, with_legend
from volref.scene.scene import Scene
from volref.truth.rendering import render
from volref.truth.result import Render

DATA = Path(__file__).parent.parent / "demo_data"

FILES = ("demo.png", "demo.npy", "demo.html", "depth.png", "error.png")

TITLE = "A head and its white matter"
LEAD = (
    "The average brain of 152 people (MRI, in blue) with the surface of its white matter (orange). The "
    "volume ends in a plane, and the surface goes on above it. Below the plane each ray adds up the tissue "
    "in front of the surface and stops there."
)
ALT = (
    "A brain seen from its right, its front and above. The lower two thirds are a translucent blue volume in "
    "which the folded orange surface of the white matter shows through; the top of the surface stands out of "
    "the volume, bare."
)
REPEAT_PYTHON = """\
import volref as vr
from volref.report.demo import demo_scene

scene = demo_scene(width={width}, height={height})
out = vr.render(scene)
print(out.rgba.shape, out.bound.max() * 255, out.bound_kind, out.seconds)
print(vr.trace(scene, ({x}, {y})))
"""


def demo_scene(width: int = 512, height: int = 512) -> Scene:
    """Return the scene of the demo: the MNI ICBM152 average head up to z = 42.5 mm, and its white matter.

    The world is in millimetres, x to the right, y to the front, z up.  The opening of the camera is the
    vertical one, so an image narrower than high shows less of the head.

    Raises
    ------
    SceneError
        If the size is not whole numbers in the range of `Scene`.
    """
    return dataclasses.replace(load_scene(DATA / "scene.json"), width=width, height=height)


def run_demo(
    folder: str | Path,
    *,
    width: int = 512,
    height: int = 512,
    threads: int | None = None,
    progress: Callable[[int, int], None] | None = None,
    overwrite: bool = False,
) -> dict[str, Any]:
    """Render the demo and write it to `folder`; return the paths and the figures as plain data.

    demo.png is the image for people (sRGB), demo.npy the same as float64 premultiplied RGBA (height, width,
    4) in the working space, depth.png and error.png are maps with a scale, and demo.html shows them all.
    The error is certified.

    Parameters
    ----------
    folder
        Where to write; made if missing.
    threads, progress
        As for `volref.render`.
    overwrite
        True replaces files of an earlier run.

    Raises
    ------
    FormatError
        If the folder cannot be made, or holds one of the files and `overwrite` is False.
    SceneError
        If an argument breaks a rule of the scene or of `render`.
    """
    started = time.perf_counter()
    paths = _free_paths(Path(folder), overwrite=overwrite)
    scene = demo_scene(width, height)
    loaded = time.perf_counter() - started
    out = render(scene, threads=threads, progress=progress)
    _make_folder(Path(folder))
    write_png(paths["demo.png"], encode_rgba8(out.rgba), overwrite=overwrite)
    write_npy(paths["demo.npy"], out.rgba, overwrite=overwrite)
    write_png(paths["depth.png"], with_legend(distance_map(out.distance, "mm")), overwrite=overwrite)
    write_png(paths["error.png"], with_legend(error_map(out.bound)), overwrite=overwrite)
    write_text(paths["demo.html"], demo_page(scene, out, loaded), overwrite=overwrite)
    figures = figures_of(out)
    return {
        "message": figures.sentence,
        "files": [str(paths[name]) for name in FILES],
        "page": str(paths["demo.html"]),
        "scene": str(DATA / "scene.json"),
        "width": scene.width,
        "height": scene.height,
        **dataclasses.asdict(figures),
        "met_tolerance": out.met_tolerance,
        "seconds_in_all": time.perf_counter() - started,
    }


def demo_page(scene: Scene, out: Render, loaded: float) -> str:
    """Return the page of the demo; `loaded` is the time in seconds that reading the scene took."""
    python = REPEAT_PYTHON.format(
        width=scene.width, height=scene.height, x=scene.width // 2, y=scene.height // 2
    )
    return render_page(
        scene,
        out,
        title=TITLE,
        lead=LEAD,
        alt=ALT,
        unit="mm",
        figures=[("reading the scene", f"{loaded:.2f} s")],
        repeat=[
            ("From a terminal", f"volref demo --size {scene.width}x{scene.height}"),
            ("From Python, and every number of one ray", python),
        ],
        notice=(DATA / "NOTICE.txt").read_text(encoding="utf-8"),
    )


def _free_paths(folder: Path, *, overwrite: bool) -> dict[str, Path]:
    paths = {name: folder / name for name in FILES}
    for path in paths.values():
        check_free(path, overwrite=overwrite)
    return paths


def _make_folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        message = f"{folder} must be a folder that can be written to, got {error.strerror}; name another"
        raise FormatError(message) from error
