"""Every pixel of every correct image lies in its interval: real WebGL, no exceptions."""

import pytest

from tests.webgl.cases import cases
from tests.webgl.containing import FLOATS, contained

# Voxels of three lengths, rays that end opaque, slices beyond the outer ones, meshes through the box, lights,
# radars around and above: `python -m tests.webgl.containing` draws all scenes there are.
SCENES = ("turned", "dense", "full", "mesh through", "lit from near", "edges", "radar storm", "radar uneven")

# Known to be wider, on Mesa, whose 8-bit filters and 16-bit colours are steps:
# the next byte of a gradient turns a normal (p99); alpha multiplies a colour of 16 bits (p50).
WIDER = {
    ("llvmpipe", "cej2020"): {"p99": 4.0},
    ("llvmpipe", "cej2020-printed"): {"p99": 4.0},
    ("llvmpipe", "arbelaz2016-printed"): {"p50": 0.5, "p99": 2.1},
}

# Widths in 1/255 that programs which composite by over stay below before bytes; see docs/containment.md.
TIGHT = {"p50": 0.2, "p99": 2.0, "ambiguous": 0.015}


CASES = [
    case for case in cases() if case.scene in SCENES and (case.format != "float" or case.scene in FLOATS)
]


@pytest.mark.parametrize("case", CASES, ids=str)
def test_every_correct_image_lies_in_its_intervals(webgl, case):
    found = contained(webgl, case, webgl.name)
    said = f"{webgl.name}, {case}: {found}"
    print(said)
    assert found.pixels > 500, said
    assert found.outside == 0, said
    if case.format == "float" and case.described().accumulation.rule == "over":
        most = TIGHT | WIDER.get((webgl.name, case.pipeline), {})
        assert found.percentile(50) <= most["p50"], said
        assert found.percentile(99) <= most["p99"], said
        assert found.ambiguous <= most["ambiguous"], said
