"""How long volref takes to start: medians over processes.  Run: python tests/benchmarks/startup.py [runs]"""

import statistics
import subprocess
import sys
import time

COMMANDS = {
    "python alone": ["-c", "pass"],
    "import numpy": ["-c", "import numpy"],
    "import volref": ["-c", "import volref"],
    "volref --help": ["-m", "volref", "--help"],
    "volref render --help": ["-m", "volref", "render", "--help"],
    "volref report": ["-m", "volref", "report"],
}


def median_milliseconds(words, runs):
    seconds = []
    for _ in range(runs):
        started = time.perf_counter()
        subprocess.run([sys.executable, *words], stdout=subprocess.DEVNULL, check=True)
        seconds.append(time.perf_counter() - started)
    return 1000 * statistics.median(seconds)


if __name__ == "__main__":
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 11
    for name, words in COMMANDS.items():
        print(f"{name:<22} {median_milliseconds(words, runs):6.0f} ms")
