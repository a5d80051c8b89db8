"""The stages one by one: what the scene alone says of each, and what leaving it out saves."""

import math
from collections.abc import Sequence
from functools import partial

import numpy as np

from volref.arrays import Booleans, Floats, number, one_of
from volref.errors import SceneError
from volref.planning.record import Occupancy, Stage
from volref.scene.blocks import flag_blocks
from volref.scene.footprint import footprint
from volref.scene.palette import FULL_PALETTE, Palette, palette_of
from volref.scene.radar import RadarVolume
from volref.scene.radar_blocks import flag_radar
from volref.scene.rounding import float32_error
from volref.scene.scene import Scene
from volref.scene.transfer import TransferFunction
from volref.scene.transfer2d import TransferFunction2D
from volref.scene.volume import Volume

# A ray ends when less than this part of the light behind it would arrive.
TERMINATION = 1e-6

# Cells per side of a block of empty space.
BLOCK = 4

# Six segments of a ray are sampled together; three where six would go further than this many voxels.
LONGEST_BLOCK = 4.0

# The part of the tolerance that float32 may take.
FLOAT32_SHARE = 1 / 8

# Above this many samples on one ray the default step is refused rather than left to run for hours.
MOST_DEFAULT_SEGMENTS = 1 << 20

# And above this many any step is: 2^31 samples take a minute and a half on one ray.
MOST_SEGMENTS = 1 << 31

# Segments may be longer than the step by this part of it, and a sample's index be off by this in float32.
REACH_MARGIN, ROUNDED_INDEX = 1e-12, 1e-3

# Skipping costs one look-up per block of segments; with fewer empty blocks than this it does not pay.
LEAST_EMPTY_PART = 0.05

HALF_TIME = "about half the time"


def missing_rays(scene: Scene) -> Stage:
    """Cast no rays outside the rectangle that the volume's box covers on the screen."""
    outside = 1 - footprint(scene).pixels / (scene.width * scene.height)
    reason = f"{outside:.0%} of the pixels lie beside the box of the volume on the screen"
    return Stage("rays that miss", included=False, reason=reason, saves="their rays")


def shows(scene: Scene) -> bool:
    """Tell whether any value of the volume shows."""
    assert scene.volume is not None
    low, high = scene.volume.value_bounds
    if scene.isovalue is not None:
        return low <= scene.isovalue <= high
    return bool(may_be_seen(scene.envelope, np.array(low), np.array(high)))


def cells_stages(scene: Scene) -> list[Stage]:
    """Cross only the cells that count."""
    saves = "their crossings and cubics"
    cells = {
        "composite": "cells that are transparent are not integrated",
        "mip": "blocks whose values some samples of the ray beat already are passed by",
        "minip": "blocks whose values some samples of the ray beat already are passed by",
        "isosurface": "blocks that do not hold the isovalue are passed by",
    }
    stages = []
    if scene.mode in cells:
        stages.append(Stage("empty space", included=True, reason=cells[scene.mode], saves=saves))
    if scene.mode != "composite":
        found = {"isosurface": "the first crossing of the isovalue", "slice": "the value on the plane"}
        words = {"mip": "greatest", "minip": "least", "average": "mean"}
        reason = found.get(scene.mode) or f"the {words[scene.mode]} value of each ray, then looked up once"
        stages.append(Stage("reduction", included=True, reason=reason))
    return stages


def light_stages(scene: Scene) -> list[Stage]:
    """Take gradients and light only if the look of the volume depends on them."""
    reason = "the volume is not lit, and the transfer function is of the value alone"
    gradients = Stage("gradients", included=False, reason=reason, saves="six samples for each one seen")
    if scene.needs_gradient:
        reason = f"{scene.gradient}, where anything is seen"
        gradients = Stage("gradients", included=True, reason=reason)
    if scene.lights_volume:
        model = "phong" if scene.material is None else scene.material.model
        count = len(scene.lights)
        reason = f"{count} light{'s' * (count > 1)}, {model}"
        return [gradients, Stage("lighting", included=True, reason=reason)]
    reason = "the volume answers none" if scene.lights else "no light"
    reason += ": colours are emitted as they are"
    return [gradients, Stage("lighting", included=False, reason=reason)]


def never_needed() -> list[Stage]:
    """Return what no scene of today needs, and why."""
    return [
        Stage("jitter", included=False, reason="rays begin where they meet the volume"),
        Stage("tone mapping", included=False, reason="the image stays in the working space"),
    ]


def sampled_because(scene: Scene) -> str:
    """Say what of a scene the exact integrator does not cover, or nothing."""
    if isinstance(scene.volume, RadarVolume):
        return "a radar volume"
    if isinstance(scene.transfer, TransferFunction2D):
        return "a transfer function of value and gradient"
    if scene.lights_volume and scene.mode == "composite":
        return "a lit volume"
    if scene.needs_gradient and scene.mode == "composite":
        return "gradient opacity"
    return "" if scene.classification == "post" else f"classification {scene.classification!r}"


def more_than_values(scene: Scene, modes: Sequence[str] = ("composite",)) -> str:
    """Say what of a scene is more than values on a grid up to an opaque surface, in one of `modes`."""
    if sampled_because(scene):
        return sampled_because(scene)
    if scene.mode not in modes:
        return f"mode {scene.mode!r}"
    if scene.lights_volume:
        return "lights on an isosurface"
    if scene.clip:
        return "clipping planes"
    return "transparent meshes" if any(mesh.transparent for mesh in scene.meshes) else ""


def colour_stage(scene: Scene) -> tuple[Palette, Stage]:
    """Look up each colour channel only once, and none that is constant where anything is seen."""
    if sampled_because(scene):
        reason = f"all channels are looked up in {sampled_because(scene)}"
        return FULL_PALETTE, Stage("colour", included=True, reason=reason)
    palette, name = palette_of(scene.envelope), "colour"
    left_out = 3 - len(palette.looked_up)
    saves = f"{left_out} of 4 channels of look-up and compositing"
    if left_out == 0:
        return palette, Stage(name, included=True, reason="red, green and blue differ")
    if left_out < 3:
        grey = palette.source == (0, 0, 0)
        reason = "grey: one channel" if grey else f"{len(palette.looked_up)} channels that differ and vary"
        return palette, Stage(name, included=True, reason=reason, saves=saves)
    words = ", ".join(f"{value:g}" for value in palette.constant)
    reason = f"({words}) wherever anything is seen: it follows from the opacity"
    return palette, Stage(name, included=False, reason=reason, saves=saves)


def precision_of(
    scene: Scene, furthest: float, most_segments: int, tolerance: float, precision: str | None
) -> tuple[str, float, Stage]:
    """Choose float32 where what it can change is a small part of the tolerance.

    `furthest` is how many voxels a block of segments goes.
    """
    name = "float64"
    if precision is not None:
        one_of("precision", precision, ("float64", "float32"))
    if precision == "float64":
        return "float64", 0.0, Stage(name, included=True, reason="asked for")
    if sampled_because(scene):
        if precision == "float32":
            message = (
                f"precision must be 'float64' with {sampled_because(scene)}, got 'float32'; leave it out"
            )
            raise SceneError(message)
        return "float64", 0.0, Stage(name, included=True, reason=f"always with {sampled_because(scene)}")
    volume, transfer = scene.gridded
    rounding = float32_error(volume, transfer, diagonal_of(scene), furthest)
    brightest = max(float(transfer.colors.max()), 1.0)
    most = (rounding + most_segments * float(np.finfo(np.float32).eps)) * brightest
    words = (
        f"float32 may change a pixel by {most:.1e}" if math.isfinite(most) else "float32 has no bound here"
    )
    if precision == "float32":
        return "float32", rounding, Stage(name, included=False, reason=f"asked for; {words}", saves=HALF_TIME)
    if most > tolerance * FLOAT32_SHARE:
        return "float64", 0.0, Stage(name, included=True, reason=words)
    reason = f"{words} at most, of a tolerance of {tolerance:.1e}"
    return "float32", rounding, Stage(name, included=False, reason=reason, saves=HALF_TIME)


def meshes_stage(scene: Scene) -> Stage:
    """Draw meshes only if there are any."""
    name = "meshes"
    if not scene.meshes:
        saves = "the z-buffer, the cut of the rays and the colour of the surface"
        return Stage(name, included=False, reason="no mesh", saves=saves)
    triangles = sum(len(mesh.faces) for mesh in scene.meshes)
    count = len(scene.meshes)
    return Stage(name, included=True, reason=f"{count} mesh{'es' * (count > 1)}, {triangles:,} triangles")


def background_stage(scene: Scene) -> Stage:
    """Blend with the background unless it is clear."""
    if any(scene.background):
        return Stage("background", included=True, reason=f"premultiplied RGBA {scene.background}")
    return Stage("background", included=False, reason="clear: nothing to blend with")


def volume_stage(scene: Scene, *, seen: bool) -> Stage:
    """Integrate the volume unless none of its values shows."""
    volume = scene.volume
    assert volume is not None
    low, high = volume.value_bounds
    if not seen:
        reason = f"opacity 0 for every value from {low:g} to {high:g}"
        return Stage("volume", included=False, reason=reason)
    if isinstance(volume, Volume):
        what = f"{' x '.join(map(str, volume.size))} {volume.values.dtype}"
    else:
        what = f"{len(volume.sweeps)} sweeps of a radar"
    reason = f"{what}, values {low:g} to {high:g}"
    return Stage("volume", included=True, reason=reason)


def finest_detail(scene: Scene) -> float:
    """Return the least world distance between neighbouring samples."""
    volume = scene.volume
    assert volume is not None
    return min(volume.spacing) if isinstance(volume, Volume) else volume.gate_length


def step_length(scene: Scene, step: float | None) -> tuple[float, int]:
    """Return the length of a segment, and how many the longest ray has."""
    diagonal = diagonal_of(scene)
    length = finest_detail(scene) / 2 if step is None else number("step", step, above=0)
    if step is None and diagonal > length * MOST_DEFAULT_SEGMENTS:
        message = f"step must be stated for this volume, got the default {length:g}, half the least spacing, "
        message += (
            f"which takes {diagonal / length:.3g} samples on a ray of length {diagonal:.3g}; pass step="
        )
        raise SceneError(message)
    if diagonal > length * MOST_SEGMENTS:
        message = f"step must take at most {MOST_SEGMENTS} samples on a ray of length {diagonal:.3g}, got "
        raise SceneError(message + f"{length:g}; make it longer than {diagonal / MOST_SEGMENTS:.3g}")
    return length, math.ceil(diagonal / length)


def diagonal_of(scene: Scene) -> float:
    """Return the longest way through the volume's box."""
    offsets = scene.corners[:, None] - scene.corners[None]
    return float(np.linalg.norm(offsets, axis=-1).max())


def empty_space(scene: Scene, block: float) -> tuple[Occupancy | None, Stage]:
    """Mark the cells that have something visible within half the length of a block of segments, `block`."""
    volume = scene.volume
    half = block / 2 * (1 + REACH_MARGIN)
    if isinstance(volume, RadarVolume):
        return _empty_air(scene, volume, half)
    assert volume is not None
    # A unit step in the world moves at most this many indices along each axis.
    indices_per_length = np.linalg.norm(volume.index_from_world[:3, :3], axis=1)
    x, y, z = (math.ceil(half * count + ROUNDED_INDEX) for count in indices_per_length)
    name = "empty space"
    if max(x, y, z) > max(volume.size):
        return None, Stage(name, included=False, reason="one block of segments is longer than the volume")
    occupied = flag_blocks(volume, BLOCK, (x, y, z), partial(may_be_seen, scene.envelope))
    empty = 1 - float(occupied.mean())
    reason = f"{empty:.0%} of the {BLOCK}^3 blocks are transparent with their surroundings"
    if empty < LEAST_EMPTY_PART:
        return None, Stage(name, included=False, reason=f"{reason}: looking for them would cost more")
    # One index more than the reach: a "cell" volume begins half an index before its first block.
    layers = (1 + x // BLOCK, 1 + y // BLOCK, 1 + z // BLOCK)
    blocks = np.pad(occupied, [(layers[axis], layers[axis]) for axis in (2, 1, 0)], mode="edge")
    low = (-float(BLOCK * layers[0]), -float(BLOCK * layers[1]), -float(BLOCK * layers[2]))
    return Occupancy(blocks, low, (float(BLOCK),) * 3, half), Stage(
        name, included=True, reason=reason, saves="the samples there"
    )


def _empty_air(scene: Scene, radar: RadarVolume, half: float) -> tuple[Occupancy | None, Stage]:
    """Mark the blocks of the world that have something visible of a radar within `half`."""
    name = "empty space"
    if scene.mode != "composite":
        return None, Stage(name, included=False, reason=f"mode {scene.mode!r} takes all samples of a radar")
    if 2 * half > diagonal_of(scene) / 2:
        return None, Stage(
            name, included=False, reason="one block of segments is longer than the radar's box"
        )
    blocks = flag_radar(radar, half, partial(may_be_seen, scene.envelope))
    empty = 1 - float(blocks.seen.mean())
    x, y, z = blocks.size
    reason = (
        f"{empty:.0%} of the blocks of {x:.3g} x {y:.3g} x {z:.3g} are transparent with their surroundings"
    )
    if empty < LEAST_EMPTY_PART:
        return None, Stage(name, included=False, reason=f"{reason}: looking for them would cost more")
    found = Occupancy(blocks.seen, blocks.low, blocks.size, half)
    return found, Stage(name, included=True, reason=reason, saves="the samples there")


def may_be_seen(transfer: TransferFunction, low: Floats, high: Floats) -> Booleans:
    """Tell whether anything interpolated between samples from `low` to `high` can have an opacity above 0.

    Interpolation may leave the range of its corners by rounding, unless they are all one value.
    """
    slack = np.where(high > low, 8 * np.finfo(np.float64).eps * np.maximum(abs(low), abs(high)), 0.0)
    return transfer.is_visible(low - slack, high + slack)


def early_termination(scene: Scene) -> tuple[float, Stage]:
    """End rays early where their optical depth can be great enough."""
    name, volume = "early termination", scene.volume
    assert volume is not None
    if scene.mode != "composite":
        return 0.0, Stage(name, included=False, reason=f"mode {scene.mode!r} takes all of a ray")
    most = scene.envelope.most_extinction(*volume.value_bounds) * diagonal_of(scene)
    if most < -math.log(TERMINATION):
        reason = f"the optical depth of a ray cannot exceed {most:.3g}"
        return 0.0, Stage(name, included=False, reason=reason)
    reason = f"a ray ends below a transmittance of {TERMINATION:g}, and the bound counts what it left"
    return TERMINATION, Stage(name, included=True, reason=reason, saves="the samples behind it")
