"""Probes as folders, and the answers that a program leaves in them.

OUT/filter/            a golden bundle: scene.json, inputs/ ...
OUT/filter/answer.png  what the program drew; .npy, .npz or .exr as well
"""

from pathlib import Path

from volref.emulation.device import Device
from volref.errors import FormatError
from volref.golden.contents import MANIFEST
from volref.golden.probing.catalogue import DELIVERY, PROBES
from volref.golden.probing.judging import FREE
from volref.golden.writing import write_subject
from volref.io.atomic import check_free
from volref.io.guard import one_line

ANSWER = "answer"
SUFFIXES = (".png", ".npy", ".npz", ".exr")


def write_probes(folder: str | Path, *, overwrite: bool = False) -> list[Path]:
    """Write a golden bundle of every probe into a folder; return theirs.

    Raises
    ------
    FormatError
        If one of them is there and `overwrite` is False.
    """
    out, device = Path(folder), Device.named(FREE)
    probes = (DELIVERY, *PROBES.values())
    for probe in probes:
        check_free(out / probe.name / MANIFEST, overwrite=overwrite)
    out.mkdir(parents=True, exist_ok=True)
    return [
        write_subject(
            out / probe.name, probe.subject(device), name=probe.name, title=probe.title, overwrite=overwrite
        )
        for probe in probes
    ]


def answers_in(folder: str | Path) -> dict[str, Path]:
    """Return the answers in a folder of probes, by the probe's name.

    Raises
    ------
    FormatError
        If there is none, or a probe has two.

    Examples
    --------
    >>> answers_in("nowhere")
    Traceback (most recent call last):
    volref.errors.FormatError: nowhere must hold answers such as delivery/answer.png, got none; ...
    """
    found: dict[str, Path] = {}
    for name in (DELIVERY.name, *PROBES):
        files = [Path(folder) / name / f"{ANSWER}{suffix}" for suffix in SUFFIXES]
        there = [file for file in files if file.is_file()]
        if len(there) > 1:
            got = " and ".join(file.name for file in there)
            message = f"{one_line(str(folder))}/{name} must hold one answer, got {got}; remove one"
            raise FormatError(message)
        if there:
            found[name] = there[0]
    if not found:
        example = f"{DELIVERY.name}/{ANSWER}.png"
        message = f"{one_line(str(folder))} must hold answers such as {example}, got none; "
        raise FormatError(message + "draw the probes and put the images there")
    return found
