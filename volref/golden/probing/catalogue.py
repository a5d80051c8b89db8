"""All probes, in the order in which they are judged: each may build on what those before it settled."""

import itertools
from dataclasses import replace

import numpy as np

from volref.arrays import Floats
from volref.emulation.catalogue import named
from volref.golden.probing import scenes
from volref.golden.probing.probe import Probe, Reading, of_device, of_pipeline, of_scene
from volref.scene.scene import Scene
from volref.scene.volume import Volume

BASELINE, CONGOTE = named("texture3d"), named("congote2012")
SMALL_TABLE = BASELINE.with_switches("texture3d-8-entries", table={"size": 8})
DECODING = BASELINE.with_switches("texture3d-srgb", table={"srgb": True})

# Alphas at which programs are known to stop.
THRESHOLDS = (0.9, 0.95, 0.97, 0.98, 0.99, 0.995, 0.999, None)


def _filters() -> tuple[Reading, ...]:
    kinds = [(None, None), *itertools.product((9, 8, 7, 6, 4), (None, 8))]
    return tuple(
        of_device(
            f"weights {_exactness(weights)}, results {_exactness(results)}",
            {"weight_slack": 0.0},
            weight_bits=weights,
            result_bits=results,
        )
        for weights, results in kinds
    )


def _exactness(bits: int | None) -> str:
    return "as exact as floats" if bits is None else f"of {bits} bits"


def _rasters() -> tuple[Reading, ...]:
    return tuple(
        of_device(
            f"corners on {_grid(bits)}, colours from corners {'on' if planes == 'snapped' else 'off'} it",
            {"snap_slack": 0.0},
            subpixel_bits=bits,
            planes=planes,
        )
        for bits, planes in ((None, "snapped"), *itertools.product((4, 6, 8), ("snapped", "unsnapped")))
    )


def _grid(bits: int | None) -> str:
    return "no grid" if bits is None else f"a grid of 1/{2**bits} pixel"


def _blends() -> tuple[Reading, ...]:
    return (
        of_device("bytes blended in floating point", {"blend_slack": 0.0}, blend="float"),
        of_device("bytes blended in whole numbers", {"blend_slack": 0.0}, blend="integer"),
    )


def _outputs() -> tuple[Reading, ...]:
    return (
        of_device("gl_FragColor takes 32 bits", {}, fragment_color="float32"),
        of_device("gl_FragColor takes 16 bits", {}, fragment_color="float16"),
    )


def _curves() -> tuple[Reading, ...]:
    return (
        of_device("textures decode sRGB by its curve", {}, srgb="curve"),
        of_device("textures decode sRGB by a cubic", {}, srgb="cubic"),
    )


def _tables() -> tuple[Reading, ...]:
    return (
        of_pipeline("value v is looked up at v, entries are texels' centres", "table", "table"),
        of_pipeline("value v is looked up at (v (n - 1) + 1/2) / n", "table", "table", coordinate="centered"),
        of_pipeline("each value takes the nearest entry", "table", "table", filter="nearest"),
    )


def _grids() -> tuple[Reading, ...]:
    return (
        of_scene("the box ends half a voxel beyond the outer voxels", "grid", _unchanged),
        of_scene("the box ends at the outer voxels' centres", "grid", _node_centred),
        of_scene("the texture is drawn from the first voxel's centre to the last one's", "grid", _stretched),
        of_scene("the origin is the box's corner, not a voxel's centre", "grid", _shifted),
    )


def _thresholds() -> tuple[Reading, ...]:
    return tuple(
        of_pipeline(
            "rays are never ended by their alpha" if alpha is None else f"rays end at an alpha of {alpha:g}",
            "termination",
            "stepping",
            opaque_at=alpha,
        )
        for alpha in THRESHOLDS
    )


def _unchanged(scene: Scene) -> Scene:
    return scene


def _node_centred(scene: Scene) -> Scene:
    volume = _volume(scene)
    place = volume.spacing, volume.origin, volume.direction
    return replace(scene, volume=Volume(volume.values, *place, centering="node"))


def _stretched(scene: Scene) -> Scene:
    volume = _volume(scene)
    spacing = np.array(volume.spacing) * [(n - 1) / n for n in volume.size]
    return _placed(scene, spacing, volume.origin + volume.direction @ spacing / 2)


def _shifted(scene: Scene) -> Scene:
    volume = _volume(scene)
    return _placed(scene, np.array(volume.spacing), volume.origin + volume.direction @ volume.spacing / 2)


def _placed(scene: Scene, spacing: Floats, origin: Floats) -> Scene:
    volume = _volume(scene)
    return replace(scene, volume=Volume(volume.values, spacing, origin, volume.direction))


def _volume(scene: Scene) -> Volume:
    assert isinstance(scene.volume, Volume)
    return scene.volume


_ALL = (
    Probe("filter", "how many bits a linear filter has", scenes.magnified, BASELINE, _filters()),
    Probe("raster", "where corners of triangles go", scenes.triangles, BASELINE, _rasters()),
    Probe("blend", "how bytes are blended", scenes.wedge_on_a_background, BASELINE, _blends()),
    Probe("output", "what a fragment's colour is rounded to", scenes.waves, CONGOTE, _outputs()),
    Probe("srgb", "how a texture decodes sRGB", scenes.curve, DECODING, _curves()),
    Probe("table", "where a value is looked up", scenes.waves, SMALL_TABLE, _tables()),
    Probe("grid", "where voxels lie in the box", scenes.dense_letter, BASELINE, _grids()),
    Probe("termination", "which alpha ends a ray", scenes.behind_a_veil, BASELINE, _thresholds()),
)

PROBES: dict[str, Probe] = {probe.name: probe for probe in _ALL}

# The first picture tells how the others were delivered: which way up, with which alpha, encoded or not.
DELIVERY = Probe("delivery", "how pictures get out", scenes.wedge, BASELINE, ())
