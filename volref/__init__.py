"""volref: the ground-truth oracle for GPU volume renderers, in NumPy on the CPU.

    import volref as vr
    scene = vr.load_scene("scene.json")
    out = vr.render(scene)
    out.rgba, out.distance, out.bound, out.seconds

Images are float64 (height, width, 4), row 0 at the top, premultiplied.  Volumes are (nz, ny, nx), points
(x, y, z), worlds right-handed.

The names below are loaded when they are first used, so that `import volref` and `volref --help` cost next
to nothing.
"""

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from volref.emulation.catalogue import pipelines
    from volref.emulation.device import Device
    from volref.emulation.files.candidates import Candidates, load_candidates
    from volref.emulation.files.documents import load_device, load_pipeline, pipeline_schema
    from volref.emulation.passes import emulate
    from volref.emulation.pipeline import Pipeline
    from volref.emulation.result import Emulation
    from volref.errors import FormatError, SceneError
    from volref.golden.bundle import Bundle
    from volref.golden.checking import check_bundle
    from volref.golden.reading import load_bundle
    from volref.golden.writing import write_bundle
    from volref.io import (
        AtlasLayout,
        convert_volume,
        describe_file,
        load_camera,
        load_jitter,
        load_mesh,
        load_meshes,
        load_preset,
        load_radar,
        load_raw,
        load_scene,
        load_series,
        load_transfer,
        load_volume,
        read_image,
        save_camera,
        save_mesh,
        save_radar,
        save_scene,
        save_transfer,
        save_volume,
        scene_schema,
        write_animation,
        write_image,
    )
    from volref.oracle.acceptance import Acceptance
    from volref.oracle.acceptance_files import load_acceptance, save_acceptance
    from volref.oracle.accepting import accept
    from volref.oracle.budgeting import Budget, budget
    from volref.oracle.explanation import Explanation, explain
    from volref.oracle.faults.fault import Subject
    from volref.oracle.metrics import Comparison, compare
    from volref.oracle.shrinking import shrink
    from volref.oracle.tracing import trace
    from volref.oracle.verdict import Verdict, check
    from volref.phantoms.transfer import dbz_transfer
    from volref.planning import Plan, plan
    from volref.scene import (
        Camera,
        Light,
        Material,
        Mesh,
        Plane,
        RadarVolume,
        Scene,
        Series,
        Sweep,
        TransferFunction,
        TransferFunction2D,
        Volume,
        clip_box,
    )
    from volref.scene.arcball import arcball_rotation, drag
    from volref.scene.slices import axis_slice, oblique_slice
    from volref.stages.jitter import jitter_images
    from volref.tonemap import tone_map
    from volref.traces import Trace
    from volref.truth.jittered import render_jittered
    from volref.truth.radar.resampling import resample_radar
    from volref.truth.radar.slices import RadarMap, cappi, ppi
    from volref.truth.rendering import render
    from volref.truth.result import Render
    from volref.truth.series import render_series
    from volref.truth.supersampling import supersample
    from volref.truth.verification import Verification, verify

__version__ = "0.1.0"

__all__ = [
    "Acceptance",
    "AtlasLayout",
    "Budget",
    "Bundle",
    "Camera",
    "Candidates",
    "Comparison",
    "Device",
    "Emulation",
    "Explanation",
    "FormatError",
    "Light",
    "Material",
    "Mesh",
    "Pipeline",
    "Plan",
    "Plane",
    "RadarMap",
    "RadarVolume",
    "Render",
    "Scene",
    "SceneError",
    "Series",
    "Subject",
    "Sweep",
    "Trace",
    "TransferFunction",
    "TransferFunction2D",
    "Verdict",
    "Verification",
    "Volume",
    "accept",
    "arcball_rotation",
    "axis_slice",
    "budget",
    "cappi",
    "check",
    "check_bundle",
    "clip_box",
    "compare",
    "convert_volume",
    "dbz_transfer",
    "describe_file",
    "drag",
    "emulate",
    "explain",
    "jitter_images",
    "load_acceptance",
    "load_bundle",
    "load_camera",
    "load_candidates",
    "load_device",
    "load_jitter",
    "load_mesh",
    "load_meshes",
    "load_pipeline",
    "load_preset",
    "load_radar",
    "load_raw",
    "load_scene",
    "load_series",
    "load_transfer",
    "load_volume",
    "oblique_slice",
    "pipeline_schema",
    "pipelines",
    "plan",
    "ppi",
    "read_image",
    "render",
    "render_jittered",
    "render_series",
    "resample_radar",
    "save_acceptance",
    "save_camera",
    "save_mesh",
    "save_radar",
    "save_scene",
    "save_transfer",
    "save_volume",
    "scene_schema",
    "shrink",
    "supersample",
    "tone_map",
    "trace",
    "verify",
    "write_animation",
    "write_bundle",
    "write_image",
]

# Where the names live; those not listed are in volref.io.
_HOMES = {
    "volref.emulation.catalogue": ("pipelines",),
    "volref.emulation.device": ("Device",),
    "volref.emulation.passes": ("emulate",),
    "volref.emulation.files.candidates": ("Candidates", "load_candidates"),
    "volref.emulation.files.documents": ("load_device", "load_pipeline", "pipeline_schema"),
    "volref.emulation.pipeline": ("Pipeline",),
    "volref.emulation.result": ("Emulation",),
    "volref.errors": ("FormatError", "SceneError"),
    "volref.golden.bundle": ("Bundle",),
    "volref.golden.checking": ("check_bundle",),
    "volref.golden.reading": ("load_bundle",),
    "volref.golden.writing": ("write_bundle",),
    "volref.oracle.acceptance": ("Acceptance",),
    "volref.oracle.acceptance_files": ("load_acceptance", "save_acceptance"),
    "volref.oracle.accepting": ("accept",),
    "volref.oracle.budgeting": ("Budget", "budget"),
    "volref.oracle.faults.fault": ("Subject",),
    "volref.oracle.explanation": ("Explanation", "explain"),
    "volref.oracle.metrics": ("Comparison", "compare"),
    "volref.oracle.shrinking": ("shrink",),
    "volref.oracle.tracing": ("trace",),
    "volref.oracle.verdict": ("Verdict", "check"),
    "volref.phantoms.transfer": ("dbz_transfer",),
    "volref.planning": ("Plan", "plan"),
    "volref.scene": (
        "Camera",
        "Light",
        "Material",
        "Mesh",
        "Plane",
        "RadarVolume",
        "Scene",
        "Series",
        "Sweep",
        "TransferFunction",
        "TransferFunction2D",
        "Volume",
        "clip_box",
    ),
    "volref.scene.arcball": ("arcball_rotation", "drag"),
    "volref.scene.slices": ("axis_slice", "oblique_slice"),
    "volref.tonemap": ("tone_map",),
    "volref.truth.radar.resampling": ("resample_radar",),
    "volref.truth.radar.slices": ("RadarMap", "cappi", "ppi"),
    "volref.truth.rendering": ("render",),
    "volref.stages.jitter": ("jitter_images",),
    "volref.truth.jittered": ("render_jittered",),
    "volref.truth.series": ("render_series",),
    "volref.truth.supersampling": ("supersample",),
    "volref.truth.result": ("Render",),
    "volref.traces": ("Trace",),
    "volref.truth.verification": ("Verification", "verify"),
}
_HOME = dict.fromkeys(__all__, "volref.io") | {name: home for home, names in _HOMES.items() for name in names}


def __getattr__(name: str) -> object:
    """Load a public name from where it lives (PEP 562)."""
    if name not in _HOME:
        message = f"module 'volref' has no attribute {name!r}"
        raise AttributeError(message)
    value: object = getattr(importlib.import_module(_HOME[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """List the public names, loaded or not."""
    return sorted([*globals(), *__all__])
