"""How far the programs are from the truth on one scene, and what of that is their step and their bits."""

import dataclasses
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

import volref as vr
from volref.arrays import Floats
from volref.emulation.limit import refined, widened

# Thickness in the scene's mm for which the tables' opacity is meant: thin enough that it nearly adds up.
UNIT_DISTANCE = 2.0

# How much finer the step is that stands for one that is fine enough.
FINER = 8


@dataclass(frozen=True, eq=False)
class Case:
    """A program on the scene that it can draw, with its opacity matched to the scene's."""

    pipeline: vr.Pipeline
    scene: vr.Scene


@dataclass(frozen=True)
class Distance:
    """Mean and 99 % of the differences of all channels, and their largest, in 1/255."""

    mean: float
    p99: float
    most: float


@cache
def demo_scene(demo: Path, pixels: int) -> vr.Scene:
    """Return the head of the demo, its table given by opacities, over opaque black."""
    scene = vr.load_scene(demo)
    table = _table(scene, UNIT_DISTANCE)
    return dataclasses.replace(
        scene, transfer=table, width=pixels, height=pixels, meshes=(), background=(0.0, 0.0, 0.0, 1.0)
    )


def _table(scene: vr.Scene, unit_distance: float) -> vr.TransferFunction:
    """Return the scene's transfer function, whose opacities are meant for another distance."""
    transfer = scene.transfer
    assert isinstance(transfer, vr.TransferFunction)
    extinction = transfer.extinction
    return vr.TransferFunction(transfer.values, transfer.colors, extinction, unit_distance=unit_distance)


def case_of(name: str, scene: vr.Scene, mesh: vr.Mesh) -> Case:
    """Return the case of a pipeline: with the mesh if it draws meshes, its opacity that of the scene."""
    pipeline = vr.pipelines()[name]
    if pipeline.meshes.kind != "none":
        scene = dataclasses.replace(scene, meshes=(mesh,))
    if pipeline.opacity.rule == "as-is":
        # A table whose opacities are meant for a step of the program, as its user would make it.
        assert isinstance(scene.volume, vr.Volume)
        side = np.mean([n * s for n, s in zip(scene.volume.size, scene.volume.spacing, strict=True)])
        step = float(side) * (pipeline.stepping.length or 1 / pipeline.stepping.steps)
        scene = dataclasses.replace(scene, transfer=_table(scene, step))
    return Case(pipeline, scene)


def distances(case: Case, truth: Floats) -> dict[str, Distance]:
    """Return how far the image is from the truth as it is, with exact targets, and with a fine step too."""
    exact = widened(case.pipeline)
    variants = {
        "as it is": case.pipeline.with_switches(output={"tone_map": "none", "gamma": 1.0}),
        "exact targets": exact,
        "and a fine step": refined(case.scene, exact, FINER),
    }
    return {
        label: distance(vr.emulate(case.scene, pipeline).rgba, truth) for label, pipeline in variants.items()
    }


def distance(image: Floats, truth: Floats) -> Distance:
    """Return how far the colours of an image, as a screen shows them, are from the truth's.

    Examples
    --------
    >>> distance(np.array([[[0.1, 0.0, 9.0, 0.0]]]), np.array([[[0.0, 0.0, 1.0, 1.0]]]))
    Distance(mean=8.5, p99=24.99, most=25.5)
    """
    apart = 255 * np.abs(np.clip(np.nan_to_num(image[..., :3]), 0.0, 1.0) - truth[..., :3])
    mean, p99, most = apart.mean(), np.quantile(apart, 0.99), apart.max()
    return Distance(float(round(mean, 3)), float(round(p99, 3)), float(round(most, 3)))
