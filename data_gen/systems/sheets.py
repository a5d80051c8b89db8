"""One sheet of pictures for each page in docs/systems: truth, images, differences and targets."""

import dataclasses
from collections.abc import Iterator, Mapping

import numpy as np

import volref as vr
from data_gen.gallery.sheets import Tile
from data_gen.systems.figures import Case
from volref.arrays import Bytes, Floats
from volref.image import bytes_from_unit

# Pages and the pipelines of each.
PAGES: Mapping[str, tuple[str, ...]] = {
    "texture3d": ("texture3d",),
    "congote2012": ("congote2012", "congote2012-printed"),
    "arbelaz2016": ("arbelaz2016", "arbelaz2016-printed"),
    "barbagallo": ("barbagallo", "barbagallo-article"),
    "burkalo2022": ("burkalo2022", "burkalo2022-printed", "mpilia2018"),
    "cej2020": ("cej2020", "cej2020-printed"),
    "vpt_eam": ("vpt-eam",),
    "x3dom": ("x3dom",),
}

# By what differences are multiplied to be seen.
STRONGER = 8

# A target of distances is cleared to more than this.
CLEARED = 1e20

# From ahead on the left and above, for what answers lights.
LIGHTS = (vr.Light.ambient((0.3, 0.3, 0.3)), vr.Light.directional((-1.0, -0.6, -0.9), color=(1.2, 1.2, 1.2)))


def tiles_of(cases: list[Case], truths: list[Floats]) -> Iterator[Tile]:
    """Yield the truth, the image of each program and its difference, its targets, and it lit if it can be."""
    yield Tile("truth", picture(truths[0]))
    for case, truth in zip(cases, truths, strict=True):
        name = case.pipeline.name
        drawn = vr.emulate(case.scene, case.pipeline)
        yield Tile(name, picture(drawn.rgba))
        apart = STRONGER * np.abs(np.nan_to_num(light_of(case).rgba) - truth)
        yield Tile(f"off the truth, x {STRONGER}", picture(apart))
        for target, values in list(drawn.passes.items())[:-1]:
            if values.ndim == 3 and case is cases[0]:
                yield Tile(target.replace("_", " "), picture(shown(values)))
        if case.pipeline.lighting.model != "none":
            lit = dataclasses.replace(case.scene, lights=LIGHTS, material=vr.Material("lambert"))
            yield Tile(f"{name}, lit", picture(vr.emulate(lit, case.pipeline).rgba))


def light_of(case: Case) -> vr.Emulation:
    """Return the image of a program before its tone map, which is what the truth can be held against."""
    pipeline = case.pipeline.with_switches(output={"tone_map": "none", "gamma": 1.0})
    return vr.emulate(case.scene, pipeline)


def shown(target: Floats) -> Floats:
    """Return a target (H, W, channels) as colours: one channel as grey, white where it is least."""
    if target.shape[-1] > 1:
        return target
    finite = np.where(np.abs(target) < CLEARED, target, np.nan)
    low, high = np.nanmin(finite), np.nanmax(finite)
    grey = np.nan_to_num((high - finite) / max(high - low, 1e-30))
    return np.repeat(grey, 3, axis=-1)


def picture(image: Floats) -> Bytes:
    """Return the colours of an image (H, W, 3 or 4) as bytes."""
    return bytes_from_unit(np.nan_to_num(image[..., :3]))
