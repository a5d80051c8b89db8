"""`volref report`: the versions and the machine, for bug reports."""

import argparse
import os
import platform
import re
from collections.abc import Mapping
from typing import Any

from volref.cli.options import add_json
from volref.cli.output import print_json, table
from volref.cli.verb import GOOD, Verb

# Extras that only bundle others, or are for those who work on volref itself.
LEFT_OUT = {"all", "bench", "docs", "io", "test"}


def _arguments(parser: argparse.ArgumentParser) -> None:
    add_json(parser)


def _run(options: argparse.Namespace) -> int:
    found = _environment()
    if options.json:
        print_json(found)
    else:
        print(table(found))
    return GOOD


def _environment() -> dict[str, Any]:
    from volref import __version__
    from volref.truth.crew import available_cores

    return {
        "volref": __version__,
        "python": f"{platform.python_implementation()} {platform.python_version()}",
        "platform": platform.platform(),
        "machine": platform.machine(),
        "cores": os.cpu_count(),
        "cores_usable": available_cores(),
        "simd": _simd(),
        "packages": _versions(None),
        "extras": _versions_by_extra(),
    }


def _simd() -> dict[str, list[str]]:
    """Return the instruction sets NumPy was built for, and those that this processor adds."""
    import numpy as np

    features: Mapping[str, Any] = np.show_config(mode="dicts")["SIMD Extensions"]
    return {name: list(features.get(name, [])) for name in ("baseline", "found")}


def _requirements() -> list[tuple[str, str | None]]:
    """Return (package, extra or None) for each requirement that volref was installed with."""
    from importlib import metadata

    try:
        stated = metadata.requires("volref") or []
    except metadata.PackageNotFoundError:
        return []
    found = []
    for line in stated:
        package, extra = re.match(r"[\w.-]+", line), re.search(r"extra == [\"']([\w-]+)[\"']", line)
        if package is not None:
            found.append((package[0], extra[1] if extra else None))
    return found


def _versions(extra: str | None) -> dict[str, str | None]:
    """Return the version of each package that the extra asks for, None where it is missing."""
    return {
        package: _version(package) for package, of in _requirements() if of == extra and package != "volref"
    }


def _versions_by_extra() -> dict[str, dict[str, str | None]]:
    extras = sorted({of for _, of in _requirements() if of is not None} - LEFT_OUT)
    found = {extra: _versions(extra) for extra in extras}
    return {extra: versions for extra, versions in found.items() if versions}


def _version(package: str) -> str | None:
    from importlib import metadata

    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None


VERB = Verb(
    "report",
    "versions and machine, to paste into a bug report",
    (("report", "what to paste"), ("report --json", "the same for a program")),
    _arguments,
    _run,
)
