"""Damaged files of every format: each must be refused in one sentence or read, in bounded time and memory.

    python -m tests.io.fuzz [--files 60] [--only SUFFIX] [--keep FOLDER]

makes `--files` damaged files of each format and prints a table.  Files are read by a process of their own, so
that a crash, a hang or a lack of memory of a library is found and not suffered.  What is measured there is
the processor's seconds of a read (others may use the machine) and the memory beyond what the process had
before (Linux only; elsewhere 0).
"""

import argparse
import importlib
import itertools
import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import warnings
import zlib
from dataclasses import dataclass, field
from pathlib import Path
from select import select

import numpy as np

MOST_SECONDS = 5.0
MOST_MEMORY = 200 * 2**20
MAX_BYTES = 2**26
# Addresses that the process may have: files are mapped, libraries reserve more than they use.
ADDRESS_SPACE = 6 * 2**30
LIBRARIES = (
    "h5py",
    "nibabel",
    "nrrd",
    "OpenEXR",
    "pydicom",
    "tifffile",
    "trimesh",
    "zarr",
    "PIL.PngImagePlugin",
)
# What a reader could do wrong, by which the tests see that it would be found.
FAULTY = {
    "abort": lambda _: os.abort(),
    "hang": lambda _: [0 for _ in itertools.count() if False],
    "hog": lambda _: np.ones(2**28, np.uint8).sum(),
    "raise": lambda path: path.name.index("?"),
}


@dataclass
class Findings:
    """What became of the damaged files of one format."""

    files: int = 0
    refused: int = 0
    read: int = 0
    seconds: float = 0.0
    memory: int = 0
    faults: list[str] = field(default_factory=list)


class Reader:
    """A process that reads files, and is started again when one of them has killed it."""

    def __init__(self):
        self.process = None

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stop()

    def stop(self):
        if self.process is not None:
            self.process.kill()
            self.process.wait()
            self.process.stdin.close()
            self.process.stdout.close()
            self.process = None

    def read(self, kind, statement, path):
        """Return what became of a file: "refused", "read", or a fault, with seconds and memory."""
        if self.process is None:
            command = [sys.executable, "-m", "tests.io.fuzz", "--worker"]
            pipe = subprocess.PIPE
            self.process = subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL)
        self.process.stdin.write(json.dumps([kind, statement, str(path)]).encode() + b"\n")
        self.process.stdin.flush()
        # The process stops itself if it is busy; a minute is for one that waits, and for a busy machine.
        ready, _, _ = select([self.process.stdout], [], [], 60.0)
        line = self.process.stdout.readline() if ready else b""
        if line:
            return json.loads(line)
        ended = self.process.wait() if ready else None
        self.stop()
        hung = ended is None or ended == -signal.SIGPROF
        fault = f"hung for {MOST_SECONDS} s" if hung else f"killed the process ({ended})"
        return {"became": fault, "seconds": 0.0, "memory": 0, "decoded": 0}


def fuzz(folder, names, files, *, keep=None):
    """Return the findings of each format, after reading `files` damaged files of it."""
    from tests.damage import damage_path
    from tests.sound_files import SOUND

    findings = {}
    with Reader() as reader:
        for name in names:
            kind, statement, write = SOUND[name]
            sound = folder / "sound" / name
            sound.parent.mkdir(exist_ok=True)
            write(sound)
            found = findings[name] = Findings()
            for number in range(-1, files):
                path = folder / name
                _copy(sound, path)
                if number >= 0:
                    damage_path(path, np.random.default_rng([zlib.crc32(name.encode()), number]))
                _note(found, number, reader.read(kind, statement, path))
                if keep is not None and found.faults and found.faults[-1].startswith(f"#{number} "):
                    _copy(path, keep / f"{number}.{name}")
                _remove(path)
            _remove(sound)
    return findings


def _note(found, number, result):
    """Count what became of a file; number -1 is the sound one, which must be read."""
    became, seconds, memory = result["became"], result["seconds"], result["memory"]
    faults = [] if became in ("refused", "read") else [became]
    faults += ["the sound file was refused"] if number < 0 and became == "refused" else []
    faults += [f"took {seconds:.1f} s"] if seconds > MOST_SECONDS else []
    over = memory - 4 * result["decoded"]
    faults += [f"took {memory >> 20} MiB"] if over > MOST_MEMORY and number >= 0 else []
    found.faults += [f"#{number} {fault}" for fault in faults]
    if number >= 0:
        found.files += 1
        found.refused += became == "refused"
        found.read += became == "read"
        found.seconds, found.memory = max(found.seconds, seconds), max(found.memory, over)


def _copy(source, target):
    target.parent.mkdir(parents=True, exist_ok=True)
    _remove(target)
    if source.is_dir():
        shutil.copytree(source, target)
    else:
        shutil.copyfile(source, target)


def _remove(path):
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def table(findings):
    """Return the findings as a Markdown table, and the faults under it."""
    lines = ["| file | damaged | refused | read | slowest, s | most memory, MiB | faults |"]
    lines += ["| --- | --- | --- | --- | --- | --- | --- |"]
    for name, found in findings.items():
        figures = f"{found.files} | {found.refused} | {found.read} | {found.seconds:.2f}"
        lines.append(f"| {name} | {figures} | {max(found.memory, 0) / 2**20:.0f} | {len(found.faults)} |")
    every = findings.values()
    sums = [sum(getattr(found, name) for found in every) for name in ("files", "refused", "read")]
    slowest, most = max(found.seconds for found in every), max(found.memory for found in every)
    count = sum(len(found.faults) for found in every)
    lines.append(f"| all | {' | '.join(map(str, sums))} | {slowest:.2f} | {most / 2**20:.0f} | {count} |")
    lines += [f"{name} {fault}" for name, found in findings.items() for fault in found.faults]
    return "\n".join(lines)


def work():
    """Read the files named on standard input, and say on standard output what became of each."""
    warnings.simplefilter("ignore")
    resource.setrlimit(resource.RLIMIT_AS, (ADDRESS_SPACE, ADDRESS_SPACE))
    for name in LIBRARIES:
        importlib.import_module(name)
    # Libraries may print; the answers have the standard output to themselves.
    answers, sys.stdout = sys.stdout, sys.stderr
    for line in sys.stdin:
        kind, statement, path = json.loads(line)
        # Without a handler the signal ends the process, even one that is stuck in a library.
        signal.setitimer(signal.ITIMER_PROF, MOST_SECONDS)
        answers.write(json.dumps(_result(kind, statement, Path(path))) + "\n")
        answers.flush()
        signal.setitimer(signal.ITIMER_PROF, 0.0)


def _result(kind, statement, path):
    from tests.bad_files import LOADERS
    from volref.errors import FormatError, SceneError
    from volref.io import load_radar

    load = {**LOADERS, **FAULTY, "radar": load_radar}[kind]
    limit = {} if kind in ("transfer", *FAULTY) else {"max_bytes": MAX_BYTES}
    decoded, before = 0, _peak_memory(reset=True)
    start = time.process_time()
    try:
        decoded = _bytes_of(load(path, **statement, **limit))
        became = "read"
    except (FormatError, SceneError) as error:
        one = str(error).count("; ") == 1 and "\n" not in str(error)
        became = "refused" if one else f"was refused in other than one sentence: {error}"
    except BaseException as error:  # noqa: BLE001  # whatever else comes out is the fault looked for
        became = f"raised {type(error).__name__}: {error}"
    seconds = time.process_time() - start
    return {"became": became, "seconds": seconds, "memory": _peak_memory() - before, "decoded": decoded}


def _bytes_of(loaded):
    """Return the bytes of the numbers in what a loader returned."""
    arrays = [loaded, getattr(loaded, "values", None), getattr(loaded, "vertices", None)]
    arrays += [sweep.values for sweep in getattr(loaded, "sweeps", ())]
    return sum(array.nbytes for array in arrays if isinstance(array, np.ndarray))


def _peak_memory(*, reset=False):
    """Return the most memory the process has had since the last reset, in bytes; 0 where it is not told."""
    try:
        if reset:
            Path("/proc/self/clear_refs").write_text("5")
        lines = Path("/proc/self/status").read_text().splitlines()
    except OSError:
        return 0
    return next((int(line.split()[1]) * 1024 for line in lines if line.startswith("VmHWM:")), 0)


def main():
    """Run and print; 1 if a fault was found."""
    parser = argparse.ArgumentParser(prog="python -m tests.io.fuzz", description=__doc__.split("\n")[0])
    parser.add_argument("--files", type=int, default=60, help="damaged files of each format")
    parser.add_argument("--only", action="append", help="a name of the table; may be given several times")
    parser.add_argument("--keep", type=Path, help="folder for the files that showed a fault")
    parser.add_argument("--worker", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.worker:
        work()
        return 0
    from tests.sound_files import SOUND

    with tempfile.TemporaryDirectory() as folder:
        findings = fuzz(Path(folder), options.only or list(SOUND), options.files, keep=options.keep)
    print(table(findings))
    return 1 if any(found.faults for found in findings.values()) else 0


if __name__ == "__main__":
    sys.exit(main())
