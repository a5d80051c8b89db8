"""Where rays enter and leave the box, where their samples lie, and what ends them."""

from dataclasses import dataclass
from typing import Annotated

from volref.emulation.groups.words import FILTERS, STORED
from volref.emulation.switches import Flag, Real, Switches, Whole, Word


@dataclass(frozen=True)
class RaySetup(Switches, group="pipeline.rays"):
    """Where rays enter and leave the box."""

    kind: Annotated[
        str,
        Word(
            "where entry and exit come from",
            {
                "coordinates": "two passes: the box's faces are drawn with texture coordinates as colours",
                "front-face": "one pass: the entry is the varying of the front faces, the rest the eye's",
                "slab": "a test of the ray against the box's six planes",
            },
        ),
    ] = "slab"
    direction: Annotated[
        str,
        Word(
            "how the direction of a slab test's ray is made",
            {
                "eye": "from the eye through the pixel; with parallel rays from the near plane",
                "unproject": "from the near to the far plane, by the inverse of the matrices",
                "focal": "(ndc x times aspect, ndc y, -focal length), turned into the world",
                "focal-square": "(ndc x, ndc y, -focal length): right for square images only",
            },
        ),
    ] = "eye"
    front: Annotated[
        str,
        Word(
            "where two passes take the entry from",
            {"target": "a target of its own, as the exit", "varying": "the varying of the faces being drawn"},
        ),
    ] = "target"
    no_exit: Annotated[
        str,
        Word(
            "what happens where the exit's target has x and y of 0: mostly, where nothing was drawn",
            {"walked": "the ray is walked", "left": "the fragment is transparent black, seed 002"},
        ),
    ] = "walked"
    format: Annotated[str, Word("what a coordinate target holds", STORED)] = "float"
    filter: Annotated[str, Word("how a coordinate target is read", FILTERS)] = "nearest"


@dataclass(frozen=True)
class Stepping(Switches, group="pipeline.stepping"):
    """Where the samples of a ray lie, and what ends it."""

    rule: Annotated[
        str,
        Word(
            "what is the same for all rays",
            {
                "count": "the number of steps between entry and exit",
                "texture-length": "the length of a step in texture space",
                "world-length": "the length of a step in the world",
                "voxel-count": "the samples per voxel, rounded to a whole number of steps for each ray",
            },
        ),
    ] = "world-length"
    steps: Annotated[int, Whole("steps of rule 'count'", low=1)] = 100
    length: Annotated[
        float | None,
        Real(
            "length of a step for the rules of lengths (None: half the least spacing for 'world-length', "
            "1 / steps for 'texture-length'), or in voxels for 'voxel-count' (None: 1)",
            low=1e-9,
        ),
    ] = None
    offset: Annotated[float, Real("where in the first step the first sample lies", high=1.0)] = 0.0
    jitter: Annotated[bool, Flag("whether a number from an image is added to the offset")] = False
    advance: Annotated[
        str,
        Word(
            "how the next position is made, in float32",
            {
                "add": "position += step",
                "parameter": "t += 1 / steps; position = mix(entry, exit, t)",
                "multiply": "position = entry + (i + offset) step",
            },
        ),
    ] = "multiply"
    end: Annotated[
        str,
        Word(
            "what ends a ray",
            {
                "count": "all steps are done",
                "length-before": "the length walked is at least the ray's, before a sample",
                "parameter": "t >= 1, before a sample",
                "length-after": "the length walked is at least the ray's, after a sample",
                "length-left": "no length is left, before a sample",
                "outside": "a coordinate is below 0 or above 1, after a sample",
                "outside-above": "a coordinate of the sample just taken is above 1; faces at 0 are missed",
            },
        ),
    ] = "length-before"
    cap: Annotated[int | None, Whole("most iterations of the loop (None: no cap)", low=1)] = None
    last_step: Annotated[
        str,
        Word(
            "what the last step of rule 'world-length' is",
            {
                "whole": "as long as the others",
                "partial": "what is left up to the exit",
                "dropped": "left out",
                "doubled": "what is left up to the exit, counted twice",
            },
        ),
    ] = "partial"
    skipped: Annotated[int, Whole("steps at the entry that are left out", high=1 << 16)] = 0
    opaque_at: Annotated[float | None, Real("alpha that ends a ray (None: none)", high=2.0)] = None
    opaque_test: Annotated[
        str,
        Word(
            "how alpha is compared with `opaque_at`",
            {"at-least": "alpha >= opaque_at", "above": "alpha > opaque_at"},
        ),
    ] = "at-least"
    stopped: Annotated[
        str,
        Word(
            "what becomes of a ray that alpha has ended",
            {"left": "nothing", "opaque": "its alpha is set to 1, and its colour left as it is"},
        ),
    ] = "left"
