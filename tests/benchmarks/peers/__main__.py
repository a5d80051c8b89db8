"""`python -m tests.benchmarks.peers`: measure, print, and keep the figures as JSON."""

import argparse
import json
import sys
from pathlib import Path

from tests.benchmarks.peers.comparing import PROBLEMS, compare
from tests.benchmarks.peers.renderers import RENDERERS

RESULTS = Path(__file__).parents[1] / "results" / "peers.json"


def main() -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(description="Other CPU volume renderers beside volref, in one run.")
    parser.add_argument("--problems", default=",".join(PROBLEMS), help="default %(default)s")
    parser.add_argument("--renderers", default=",".join(RENDERERS), help="default %(default)s")
    parser.add_argument("--side", type=int, default=512, help="width of the images in pixels")
    parser.add_argument(
        "--max-seconds", type=float, default=8.0, help="no rung that is expected to take more"
    )
    parser.add_argument("--core", type=int, help="the core to stay on; default the first")
    parser.add_argument("--out", type=Path, default=RESULTS, help="default %(default)s")
    options = parser.parse_args()
    figures = compare(
        options.problems.split(","),
        options.renderers.split(","),
        side=options.side,
        max_seconds=options.max_seconds,
        core=options.core,
        say=lambda line: print(line, file=sys.stderr, flush=True),
    )
    options.out.parent.mkdir(parents=True, exist_ok=True)
    options.out.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
