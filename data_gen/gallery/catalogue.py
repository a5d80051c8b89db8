"""The sheets of the gallery, and whom to credit for what they are drawn from."""

from data_gen.gallery.classified import classified
from data_gen.gallery.lights import lights
from data_gen.gallery.modes import modes
from data_gen.gallery.radars import RADAR, maps, storms
from data_gen.gallery.scans import CT, HEAD, MAPS, PRESETS, STENT
from data_gen.gallery.sheets import Sheet
from data_gen.gallery.surfaces import NUT, TEAPOT, WHITE_MATTER, surfaces
from data_gen.gallery.tables import color_maps, presets

# Whom to credit for each file, and its licence; tests/data/README.md says more.
MNI = (
    "MNI ICBM152 average, Copyright (C) 1993-2009 Louis Collins, McConnell Brain Imaging Centre, Montreal "
    "Neurological Institute, McGill University; MNI notice"
)
CREDITS = {
    CT: "pyradiomics 3.0.1, (c) 2017 Harvard Medical School; BSD-3-Clause",
    HEAD: MNI,
    STENT: "visvis 1.15.0; BSD-3-Clause",
    RADAR: "Royal Netherlands Meteorological Institute (KNMI), open data (CC BY 4.0 / CC0 by product)",
    WHITE_MATTER: MNI,
    NUT: "PyVista 0.49.1; MIT",
    TEAPOT: "visvis 1.15.0; BSD-3-Clause",
    PRESETS: "3D Slicer's presets as in @cornerstonejs/core 5.14.0; MIT",
    MAPS: "ParaView's colour maps as in @kitware/vtk.js 37.4.3; BSD-3-Clause",
}

SHEETS = (
    Sheet(
        "modes",
        "Modes",
        (CT, STENT, HEAD, PRESETS),
        "A chest, a brain and a stent graft in an aorta, in every mode. The integral of emission and "
        "absorption; the greatest, the least and the mean value along each ray; the surface where a ray "
        "first meets a value, lit; slices. The least value is that of a slab between two clipping "
        "planes: of a whole scan it is that of the air around the patient. Seen from the front, or from "
        "the front and right; the patient's right is on the left. Axial slices are seen from the feet.",
        modes,
        7,
        144,
        palette=True,
    ),
    Sheet(
        "presets",
        "The presets of 3D Slicer",
        (CT, PRESETS),
        "All 26 on one chest, with their own material, under ambient light and a lamp on the camera. "
        "Their colours are shown as they are, not encoded, as in Slicer. A preset finds only what it "
        "was made for: the last five are for magnetic resonance, CT-Air and CT-Chest-Vessels show the "
        "air around the patient, and those called MIP are meant for that mode. CT-Cropped-Volume-Bone "
        "and CT-Soft-Tissue are not shaded and begin in black at the skin. All their gradient opacities "
        "are 1 throughout. Mode composite.",
        presets,
        7,
        160,
        palette=True,
    ),
    Sheet(
        "colormaps",
        "The colour maps of ParaView",
        (HEAD, MAPS),
        "17 maps in their five colour spaces on one axial slice of the brain, from its least value to "
        "its greatest, which lie at the two ends of the bars. Mode slice.",
        color_maps,
        6,
        144,
    ),
    Sheet(
        "transfer",
        "Opacity by value and gradient, early and late",
        (CT, STENT),
        "Above: opacity by value; through a monotone spline; multiplied by a factor that grows with the "
        "gradient's magnitude, so that only borders stay; from a table of value and gradient magnitude "
        "with an arch for each border. Lit. Below: the wires of the stent through a table that jumps, "
        "looked up after interpolation (post), before it (pre) and in the slices before and behind "
        "(per-slice). Mode composite.",
        classified,
        4,
        180,
        palette=True,
    ),
    Sheet(
        "light",
        "Gradients and light",
        (HEAD,),
        "Folds of the brain by three gradients (rows: central differences, Sobel, the analytic gradient "
        "of the cells) and three models of light. The scan's outside has been cut off sharply, voxel by "
        "voxel; Sobel's operator smooths that, and the analytic gradient shows each cell. Last column: "
        "kinds of light. Mode isosurface.",
        lights,
        4,
        144,
        palette=True,
    ),
    Sheet(
        "meshes",
        "Meshes",
        (HEAD, WHITE_MATTER, NUT, TEAPOT),
        "The white matter as glass within the head it belongs to, where every layer lies in the volume "
        "in its order; a nut cut open, with the cap that its cut face needs; the teapot with a texture, "
        "and cut open: it is not closed, and shows its back. Colours are light, encoded as sRGB.",
        surfaces,
        3,
        264,
    ),
    Sheet(
        "radar",
        "Weather radar: maps",
        (RADAR,),
        "Thunderstorms near Den Helder, 10 June 2011, 11:40 UTC, in the colours of the US National "
        "Weather Service; north is up. Left the lowest sweep gate by gate (PPI), with clutter around "
        "the radar, right what lies 2 km above the antenna (CAPPI); grey is where nothing was measured. "
        "A map is looked up, not integrated: it has no error but rounding.",
        maps,
        3,
        200,
    ),
    Sheet(
        "storms",
        "Weather radar: in space",
        (RADAR,),
        "The same storms from the south-east, heights stretched five times by the camera's matrix. The "
        "rings are 50 km apart. Echoes below 5 dBZ are clear, and the stronger the denser; mode "
        "composite, over a textured mesh.",
        storms,
        2,
        200,
    ),
)
