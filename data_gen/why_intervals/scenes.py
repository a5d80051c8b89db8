"""The scenes of the experiment: scans, specimens, and three charts, each over an opaque background.

An opaque background makes the canvas a plain picture of red, green and blue: what a screenshot holds.
"""

import dataclasses
import json
from collections.abc import Callable
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

import numpy as np

import volref as vr
from data_gen.gallery.scans import CT, PRESETS, STENT, scan, seen_from
from volref.emulation.catalogue import named
from volref.emulation.device import Device
from volref.emulation.pipeline import Pipeline
from volref.golden.charts.catalogue import CHARTS
from volref.oracle.faults.fault import Subject
from volref.phantoms.fields import marschner_lobb
from volref.phantoms.meshes import torus_mesh
from volref.phantoms.specimens import BLOOD_HU, CALCIUM_HU, FAT_HU, filaments, vessel
from volref.phantoms.views import view_around

DATA = Path("tests") / "data"
PIXELS = 96

# Whole bytes: 51, 51 and 102.
BACKGROUND = (0.2, 0.2, 0.4, 1.0)


@dataclass(frozen=True)
class Case:
    """A scene with the program that draws it; `make` reads or makes the volume."""

    name: str
    title: str
    pipeline: Pipeline
    make: Callable[[], vr.Scene]

    def subject(self, device: Device) -> Subject:
        """Return the scene on a machine."""
        chart = CHARTS.get(self.name)
        scene = dataclasses.replace(self.make(), background=BACKGROUND)
        return Subject(scene, self.pipeline, device, None if chart is None else chart.jitter(scene))


def head() -> vr.Scene:
    """Return the head of the demo, every third voxel, its mesh left out."""
    return dataclasses.replace(head_with_mesh(), meshes=())


def head_with_mesh() -> vr.Scene:
    """Return the head of the demo, every third voxel, with the white matter in it."""
    demo = vr.load_scene(Path(str(resources.files("volref").joinpath("demo_data", "scene.json"))))
    assert isinstance(demo.volume, vr.Volume)
    return dataclasses.replace(demo, volume=_thinned(demo.volume, (3, 3, 3)), width=PIXELS, height=PIXELS)


def chest() -> vr.Scene:
    """Return a chest, every fourth voxel of a slice, by a preset of 3D Slicer."""
    volume = _thinned(scan(DATA / CT), (1, 4, 4))
    look = _preset("CT-Chest-Contrast-Enhanced", volume)
    return vr.Scene(volume, look, seen_from(volume, 20.0, 20.0, 330.0), PIXELS, PIXELS)


def stent() -> vr.Scene:
    """Return a stent graft, every fourth voxel along the body and every second across."""
    volume = _thinned(scan(DATA / STENT), (4, 2, 2))
    colors = [(0.6, 0.1, 0.05), (0.8, 0.3, 0.2), (0.9, 0.75, 0.6), (1.0, 0.95, 0.8), (1.0, 1.0, 1.0)]
    look = vr.TransferFunction.from_opacity([3, 6, 10, 20, 32], colors, [0, 0.1, 0.4, 0.9, 0.9], 4.0)
    return vr.Scene(volume, look, seen_from(volume, 180.0, 8.0, 230.0), PIXELS, PIXELS)


def artery() -> vr.Scene:
    """Return a made-up CT of an aorta with its branches."""
    volume = vessel((40, 30, 60), spacing=3.2)
    values = [FAT_HU, 60.0, 150.0, BLOOD_HU, CALCIUM_HU]
    colors = [(0.8, 0.2, 0.1), (0.8, 0.2, 0.1), (0.9, 0.4, 0.2), (1.0, 0.7, 0.4), (1.0, 1.0, 0.9)]
    look = vr.TransferFunction.from_opacity(values, colors, [0, 0, 0.2, 0.5, 0.9], 3.0)
    return vr.Scene(volume, look, seen_from(volume, 125.0, 10.0, 190.0), PIXELS, PIXELS)


def lit_artery() -> vr.Scene:
    """Return the same with a light and highlights."""
    lights = (vr.Light.ambient((0.3, 0.3, 0.3)), vr.Light.directional((-0.6, -0.5, -1.0), (0.8, 0.8, 0.7)))
    material = vr.Material("blinn-phong", ambient=0.6, diffuse=0.7, specular=0.3, shininess=12.0)
    return dataclasses.replace(artery(), lights=lights, material=material)


def threads() -> vr.Scene:
    """Return a made-up stack of a light microscope, long voxels, thin bright threads."""
    volume = filaments((48, 48, 24))
    colors = [(0.1, 0.3, 0.2), (0.1, 0.8, 0.4), (0.9, 1.0, 0.6)]
    look = vr.TransferFunction.from_opacity([110, 160, 400], colors, [0.0, 0.3, 0.8], 2.0)
    return vr.Scene(volume, look, view_around(volume, -30.0, 35.0, distance=110.0), PIXELS, PIXELS)


def threads_and_ring() -> vr.Scene:
    """Return the same with an opaque ring among the threads."""
    scene = threads()
    middle = scene.volume.corners.mean(axis=0)
    ring = torus_mesh(14.0, 4.0, middle, colors=(1.0, 0.6, 0.2))
    return dataclasses.replace(scene, meshes=(ring,))


def waves() -> vr.Scene:
    """Return the field of Marschner and Lobb, thin around its middle value."""
    volume = marschner_lobb()
    colors = [(0.2, 0.2, 1.0), (0.2, 0.8, 1.0), (1.0, 0.8, 0.2), (1.0, 0.4, 0.2), (1.0, 0.4, 0.2)]
    size = float(np.ptp(volume.corners, axis=0).max())
    values, opacities = [0.0, 0.35, 0.5, 0.65, 1.0], [0.0, 0.0, 0.8, 0.02, 0.02]
    look = vr.TransferFunction.from_opacity(values, colors, opacities, size / 20)
    return vr.Scene(volume, look, view_around(volume, 30.0, 35.0), PIXELS, PIXELS)


def _thinned(volume: vr.Volume, every: tuple[int, int, int]) -> vr.Volume:
    """Return every so many voxels along z, y and x."""
    z, y, x = every
    sx, sy, sz = volume.spacing
    kept = volume.values[::z, ::y, ::x]
    return dataclasses.replace(volume, values=kept, spacing=(sx * x, sy * y, sz * z))


def _preset(name: str, volume: vr.Volume) -> vr.TransferFunction:
    """Return the opacities and colours of one of 3D Slicer's presets, opacity for the least spacing."""
    presets = json.loads((DATA / PRESETS).read_text(encoding="utf-8"))
    preset = next(one for one in presets if one["name"] == name)
    opacity = np.array([float(word) for word in preset["scalarOpacity"].split()][1:]).reshape(-1, 2)
    color = np.array([float(word) for word in preset["colorTransfer"].split()][1:]).reshape(-1, 4)
    values = np.union1d(opacity[:, 0], color[:, 0])
    values = values[(values >= opacity[0, 0]) & (values <= opacity[-1, 0])]
    colors = np.stack([np.interp(values, color[:, 0], color[:, 1 + k]) for k in range(3)], axis=-1)
    opacities = np.interp(values, opacity[:, 0], opacity[:, 1])
    return vr.TransferFunction.from_opacity(values, colors, opacities, min(volume.spacing))


BASELINE = named("texture3d")
LIT = BASELINE.with_switches("texture3d-lit", lighting={"model": "lit", "gradient": "central"})

_ALL = (
    Case("head", "head (MRI)", BASELINE, head),
    Case("chest", "chest (CT)", BASELINE, chest),
    Case("stent", "stent (CT)", BASELINE, stent),
    Case("artery", "artery (made up)", BASELINE, artery),
    Case("threads", "threads (made up)", BASELINE, threads),
    Case("waves", "Marschner-Lobb", BASELINE, waves),
    Case("lit-artery", "artery, lit", LIT, lit_artery),
    Case("head-with-mesh", "head with a mesh", BASELINE, head_with_mesh),
    Case("artery-atlas", "artery in an atlas", named("congote2012"), artery),
    Case("threads-and-ring", "threads in an atlas, with a ring", named("arbelaz2016"), threads_and_ring),
    *(
        Case(name, f"chart: {CHARTS[name].title}", CHARTS[name].pipeline, CHARTS[name].make)
        for name in ("opaque-border", "bright-back", "lit-turned")
    ),
)

CASES: dict[str, Case] = {case.name: case for case in _ALL}
