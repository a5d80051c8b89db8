"""Small subjects on which faults show, with few steps: a search for a fault draws each a hundred times."""

import dataclasses

import numpy as np

import volref as vr
from tests.emulation.scenes import example
from volref.emulation.device import Device
from volref.oracle.faults.fault import Subject

WIDTH, HEIGHT = 24, 18
BASELINE = vr.pipelines()["texture3d"].with_switches(stepping={"length": 1.5, "opaque_at": 0.95})
FLOATS = BASELINE.with_switches(volume={"format": "float"}, table={"format": "float"})
CONGOTE = vr.pipelines()["congote2012"].with_switches(stepping={"steps": 20})
CLAMPED = CONGOTE.with_switches(volume={"in_tile": "clamped", "slices": "centers", "second_slice": "clamped"})
ARBELAZ = vr.pipelines()["arbelaz2016"].with_switches(stepping={"steps": 20})
PAGE = vr.pipelines()["barbagallo"].with_switches(stepping={"steps": 20}, opacity={"factor": 6.0})
BURKALO = vr.pipelines()["burkalo2022"].with_switches(stepping={"steps": 20})
CEJ = vr.pipelines()["cej2020"].with_switches(stepping={"steps": 16})
ABOVE_ONE = CONGOTE.with_switches(
    accumulation={"rule": "add-alpha", "normalize": "above-one"}, stepping={"opaque_at": None}
)
LIT = BASELINE.with_switches(lighting={"model": "lit", "gradient": "central"})

BACKGROUND = (0.2, 0.1, 0.3, 0.5)


def scene(**more):
    """Return the example of the emulations' tests, larger and denser."""
    return dataclasses.replace(example(opacity=0.9, unit_distance=2.0, **more), width=WIDTH, height=HEIGHT)


def inside():
    """Return it with the eye in the box."""
    plain = scene()
    middle = plain.volume.corners.mean(axis=0)
    camera = vr.Camera.look_at(middle + np.array((1.0, 0.6, 0.4)), middle, (0, 1, 0), 80.0, 0.1, 60.0)
    return dataclasses.replace(plain, camera=camera)


def turned():
    """Return it with its volume turned."""
    plain = scene()
    turn = np.array([(0.8, 0.0, 0.6), (0.0, 1.0, 0.0), (-0.6, 0.0, 0.8)])
    volume = plain.volume
    return dataclasses.replace(
        plain, volume=vr.Volume(volume.values, volume.spacing, volume.origin, direction=turn)
    )


def subject(pipeline, made=None, device="ideal", **more):
    """Return a subject, with start offsets where the program has them."""
    shown = scene() if made is None else made
    size = (1, shown.height, shown.width)
    jitter = np.random.default_rng(3).random(size) if pipeline.stepping.jitter else None
    return Subject(shown, pipeline, Device.named(device), jitter, **more)


def subjects():
    """Return subjects by name; each fault suits one of them."""
    return {
        "baseline": subject(BASELINE, scene(background=BACKGROUND)),
        "floats": subject(FLOATS),
        "meshes": subject(BASELINE, scene(mesh=True)),
        "turned": subject(BASELINE, turned()),
        "inside": subject(BASELINE, inside()),
        "lit": subject(LIT, scene(lit=True)),
        "congote": subject(CONGOTE),
        "clamped": subject(CLAMPED),
        "arbelaz": subject(ARBELAZ, scene(mesh=True)),
        "page": subject(PAGE),
        "burkalo": subject(BURKALO, scene(background=(0.3, 0.3, 0.2, 1.0))),
        "cej": subject(CEJ, scene(lit=True)),
        "above one": subject(ABOVE_ONE),
    }
