"""volref: the ground-truth oracle for GPU volume renderers, in NumPy on the CPU.

    import volref as vr
    scene = vr.load_scene("scene.json")
    out = vr.render(scene)
    out.rgba, out.distance, out.bound, out.seconds

Images are float64 (height, width, 4), row 0 at the top, premultiplied.  Volumes are (nz, ny, nx), points
(x, y, z), worlds right-handed.
"""

from volref.errors import FormatError, SceneError
from volref.io import (
    AtlasLayout,
    convert_volume,
    describe_file,
    load_mesh,
    load_meshes,
    load_raw,
    load_scene,
    load_transfer,
    load_volume,
    read_image,
    save_mesh,
    save_scene,
    save_transfer,
    save_volume,
    scene_schema,
    write_image,
)
from volref.oracle.metrics import Comparison, compare
from volref.planning import Plan, plan
from volref.scene import Camera, Mesh, Scene, TransferFunction, Volume
from volref.truth.rendering import render
from volref.truth.result import Render
from volref.truth.tracing import Trace, trace

__version__ = "0.1.0"

__all__ = [
    "AtlasLayout",
    "Camera",
    "Comparison",
    "FormatError",
    "Mesh",
    "Plan",
    "Render",
    "Scene",
    "SceneError",
    "Trace",
    "TransferFunction",
    "Volume",
    "compare",
    "convert_volume",
    "describe_file",
    "load_mesh",
    "load_meshes",
    "load_raw",
    "load_scene",
    "load_transfer",
    "load_volume",
    "plan",
    "read_image",
    "render",
    "save_mesh",
    "save_scene",
    "save_transfer",
    "save_volume",
    "scene_schema",
    "trace",
    "write_image",
]
