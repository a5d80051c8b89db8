"""Seed 001, section 4: the radar of Congote and others 2012, its sweeps looked up in spherical coordinates.

`congote2012-radar-printed` is the chapter to the letter, eq. 1 to 20; `congote2012-radar` has them put right,
and what the chapter does not say (the seam at the first column, the border of a sweep's rows) decided so that
it tends to volref's own truth of straight beams.  Bytes are dBZ as weather services code them: code / 2 - 32.
"""

import dataclasses

from volref.emulation.catalogue.congote import PRINTED as CARTESIAN_PRINTED
from volref.emulation.catalogue.congote import WORKING as CARTESIAN
from volref.emulation.pipeline import Pipeline


def _for_radars(pipeline: Pipeline, name: str, what: str, **volume: str) -> Pipeline:
    changed = pipeline.with_switches(name, volume={"tiles_across": 1, **volume})
    source = f"Congote et al. 2012, Volume Ray Casting in WebGL, section 4, eq. 1 to 20 {what}"
    title = "two passes over an RGB8 colour cube, sweeps of a radar stacked in one image"
    return dataclasses.replace(changed, title=title, source=source, domain=(-32.0, 95.5))


WORKING = _for_radars(
    CARTESIAN, "congote2012-radar", "put right", geometry="spherical", in_tile="clamped", seam="wrapped"
)
PRINTED = _for_radars(
    CARTESIAN_PRINTED, "congote2012-radar-printed", "as printed", geometry="spherical-printed"
)

PIPELINES = (WORKING, PRINTED)
