"""Reading and writing users' files: scenes, volumes, meshes, transfer functions, images."""

from volref.io.animation import write_animation
from volref.io.atlas import AtlasLayout
from volref.io.atomic import atomic_path
from volref.io.cameras import load_camera, save_camera
from volref.io.convert import convert_volume, save_volume
from volref.io.documents import scene_schema
from volref.io.images import read_image, write_image
from volref.io.info import describe_file
from volref.io.jitter import load_jitter
from volref.io.meshes import load_mesh, load_meshes, save_mesh
from volref.io.png import write_png
from volref.io.radar.door import load_radar, save_radar
from volref.io.raw import load_raw
from volref.io.scenes import load_scene, save_scene
from volref.io.series import load_series
from volref.io.transfer import load_preset, load_transfer, save_transfer
from volref.io.volumes import load_volume

__all__ = [
    "AtlasLayout",
    "atomic_path",
    "convert_volume",
    "describe_file",
    "load_camera",
    "load_jitter",
    "load_mesh",
    "load_meshes",
    "load_preset",
    "load_radar",
    "load_raw",
    "load_scene",
    "load_series",
    "load_transfer",
    "load_volume",
    "read_image",
    "save_camera",
    "save_mesh",
    "save_radar",
    "save_scene",
    "save_transfer",
    "save_volume",
    "scene_schema",
    "write_animation",
    "write_image",
    "write_png",
]
