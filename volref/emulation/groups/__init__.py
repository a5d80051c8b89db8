"""The decisions of a GPU program that draws a volume, as groups of switches.

`volref/emulation/pipeline.py` puts them together, in the order in which a program takes them.
"""

from volref.emulation.groups.rays import RaySetup, Stepping
from volref.emulation.groups.samples import Accumulation, Lighting, SampleOpacity
from volref.emulation.groups.targets import MeshCut, Output
from volref.emulation.groups.textures import TableTexture, VolumeTexture

__all__ = [
    "Accumulation",
    "Lighting",
    "MeshCut",
    "Output",
    "RaySetup",
    "SampleOpacity",
    "Stepping",
    "TableTexture",
    "VolumeTexture",
]
