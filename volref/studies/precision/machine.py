"""The machine on which something was timed, in a few words."""

import os
import platform
from dataclasses import dataclass
from pathlib import Path

import numpy as np

CPU_INFO = Path("/proc/cpuinfo")


@dataclass(frozen=True)
class Machine:
    """Processor, its cores, system, and the versions of Python and NumPy."""

    processor: str
    cores: int
    system: str
    python: str
    numpy: str

    def __str__(self) -> str:
        """Return one line."""
        cores = f"{self.cores} core{'s' * (self.cores != 1)}"
        return f"{self.processor}, {cores}, {self.system}, Python {self.python}, NumPy {self.numpy}"


def this_machine() -> Machine:
    """Return the machine this runs on."""
    return Machine(
        processor_name(),
        os.cpu_count() or 1,
        f"{platform.system()} {platform.machine()}",
        platform.python_version(),
        np.__version__,
    )


def processor_name(cpu_info: Path = CPU_INFO) -> str:
    """Return the processor's model name as Linux states it in `cpu_info`, else what Python knows of it."""
    try:
        lines = cpu_info.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        lines = []
    named = (line.partition(":")[2] for line in lines if line.startswith("model name"))
    return " ".join(next(named, platform.processor()).split()) or platform.machine()
