"""`volref charts`: the tiny scenes that tell faults apart, as golden bundles."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from volref.cli.options import add_force, add_json
from volref.cli.output import note, print_json, progress
from volref.cli.programs import is_file
from volref.cli.verb import GOOD, Verb

if TYPE_CHECKING:
    from volref.emulation.device import Device
    from volref.golden.charts import Chart


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("output", nargs="?", metavar="OUT", help="folder to write to; without it, a list")
    parser.add_argument(
        "--only",
        metavar="NAME",
        action="append",
        default=[],
        help="this chart alone; may be given several times",
    )
    parser.add_argument(
        "--device",
        metavar="NAME|FILE",
        default="webgl-highp",
        help="the machine, or the set of machines, that is to pass; default webgl-highp",
    )
    add_force(parser)
    add_json(parser)
    parser.add_argument("-q", "--quiet", action="store_true", help="no progress, no summary, errors only")


def _run(options: argparse.Namespace) -> int:
    charts = _chosen(options.only)
    written = []
    if options.output is not None:
        written = _write(charts, options)
    if options.json:
        print_json({"charts": [_document(chart) for chart in charts], "folders": written})
    elif options.output is None:
        width = max(len(chart.name) for chart in charts)
        for chart in charts:
            rows = " ".join(chart.separates)
            print(f"{chart.name:<{width}}  {chart.pipeline.name:<19}  {chart.title} ({rows})")
    elif not options.quiet:
        note(
            f"wrote {len(written)} bundles to {options.output}; draw each scene.json and judge it with check"
        )
    return GOOD


def _write(charts: "list[Chart]", options: argparse.Namespace) -> list[str]:
    from volref.golden.contents import MANIFEST
    from volref.golden.writing import write_subject
    from volref.io.atomic import check_free

    device, out = device_at(options.device), Path(options.output)
    for chart in charts:
        check_free(out / chart.name / MANIFEST, overwrite=options.force)
    out.mkdir(parents=True, exist_ok=True)
    folders = []
    with progress("charts", quiet=options.quiet) as show:
        for number, chart in enumerate(charts, start=1):
            folder = out / chart.name
            subject = chart.subject(device)
            write_subject(folder, subject, name=chart.name, title=chart.title, overwrite=options.force)
            folders.append(str(folder))
            if show is not None:
                show(number, len(charts))
    return folders


def device_at(text: str) -> "Device":
    """Return the device of a preset's name, or in a file."""
    from volref import Device, load_device

    return load_device(text) if is_file(text) else Device.named(text)


def _chosen(names: list[str]) -> "list[Chart]":
    from volref.errors import FormatError
    from volref.golden.charts import CHARTS

    for name in names:
        if name not in CHARTS:
            message = f"--only must be a chart, got {name!r}; use one of {', '.join(CHARTS)}"
            raise FormatError(message)
    return [chart for chart in CHARTS.values() if not names or chart.name in names]


def _document(chart: "Chart") -> dict[str, object]:
    return {
        "name": chart.name,
        "title": chart.title,
        "pipeline": chart.pipeline.name,
        "separates": list(chart.separates),
        "frames": max(chart.frames, 1),
    }


VERB = Verb(
    "charts",
    "tiny scenes on which faults of renderers look different, as golden bundles",
    (
        ("charts", "which there are, and what they tell apart"),
        ("charts out/", "write all of them"),
        ("charts out/ --only f-shape --device llvmpipe", "one, for one machine"),
    ),
    _arguments,
    _run,
    notes="Draw out/NAME/scene.json with your program and judge the image against the bundle.",
)
