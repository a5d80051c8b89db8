"""Draw all systems on all scenes and say how far emulations are from real WebGL: `python -m tests.webgl`."""

import sys

from tests.webgl.cases import cases, compared
from tests.webgl.engine import engine

ENGINES = ("swiftshader", "llvmpipe")


def main(words: list[str]) -> None:
    """Print the figures of cases whose name holds all words (an implementation may be one of them)."""
    for name in [name for name in ENGINES if name in words] or ENGINES:
        with engine(name) as opened:
            for case in cases():
                if all(word in str(case) for word in words if word not in ENGINES):
                    for target, found in compared(opened, case).items():
                        print(f"{name}, {case}, {target}: {found}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
