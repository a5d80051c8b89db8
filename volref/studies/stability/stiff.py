"""Cases of stiff scenes: spikes, jumps, sheets, and optical depths beyond all reason."""

import math

import numpy as np

from volref.arrays import Floats
from volref.phantoms import closed
from volref.phantoms.fields import linear_ramp
from volref.phantoms.grid import centered_grid
from volref.phantoms.scenes import homogeneous_scene, ramp_scene
from volref.phantoms.separable import separable_image
from volref.phantoms.transfer import steps
from volref.scene import Camera, Mesh, Scene, TransferFunction, Volume
from volref.studies.stability import textbook
from volref.studies.stability.case import EPS, Answer, Case, Measured
from volref.studies.stability.pictures import (
    CERTIFICATE,
    EARLY,
    EARLY_END,
    ROUNDING,
    known,
    marched,
    rounding,
)
from volref.studies.stability.shader import shader_image
from volref.studies.stability.views import COLOR, one_value

FAMILY = "Stiff scenes"


def _spike() -> Measured:
    """Take a ramp of 8 codes per voxel; extinction 1e4 at code 60, 0 up to 59 and from 61, 256 knots.

    Along z the spike is 1/4 voxel wide with optical depth 1250.  The march's step of 1/64 puts 16 samples
    in it, 1 - exp(-1250) of the light, and the colour is one, so rounding is all that is left.
    """
    volume = linear_ramp(9, low=0.0, high=64.0)
    extinction = np.where(np.arange(256) == 60, 1e4, 0.0)
    table = TransferFunction(np.arange(256.0), [COLOR] * 256, extinction)
    scene = Scene(volume, table, _oblique(), 8, 8)
    return known([scene], separable_image(scene), step=1 / 64, march=rounding(64 * 8.2) + EARLY_END)


def _oblique() -> Camera:
    return Camera.look_at((0.7, 0.4, 14.0), (0, 0, 0), (0, 1, 0), 20.0, 0.1, 100.0)


def _sheets() -> Measured:
    """Take extinction 1e4 where the value is above 1/2: at two of four layers of samples, clear between."""
    values = np.zeros((16, 2, 2))
    values[1::4] = values[2::4] = 1.0
    volume = centered_grid((2, 2, 16), 1.0, "node").volume(values)
    table = TransferFunction([0.5, 0.5], [COLOR, COLOR], [0.0, 1e4])
    scene = Scene(volume, table, _down(), 4, 4)
    naive = shader_image(scene, riemann=True)
    limit = rounding(120) + EARLY_END
    return known([scene], separable_image(scene), textbook=naive, step=1 / 8, march=limit, certified=1e-9)


def _thin_sheets() -> Measured:
    """Take eight sheets of optical depth 1, red and blue in turn, with as many clear; edges at samples."""
    grid = centered_grid((2, 2, 17), 1.0, "node")
    volume = grid.volume(np.arange(17.0)[:, None, None])
    shades = np.tile([(1.0, 0.2, 0.1)] * 2 + [(0.1, 0.2, 1.0)] * 2, (4, 1))
    table = steps(np.arange(1.0, 17.0).tolist(), list(shades), [1.0, 0.0] * 8)
    scene = Scene(volume, table, _down(), 4, 4)
    return known([scene], separable_image(scene), step=1 / 6, march=rounding(96), certified=1e-11)


def _down() -> Camera:
    """Return parallel rays along -z from 20, 1/4 apart about the z axis."""
    return Camera.orthographic((0, 0, 20), (0, 0, 0), (0, 1, 0), 1.0, 0.0, 40.0)


def _slab(extinction: float) -> tuple[Scene, Floats]:
    """Return a slab of 6 and its pixels (16, 4)."""
    scene, _ = homogeneous_scene(4, 4, color=COLOR, extinction=extinction, camera=_down(), size=6)
    return scene, np.tile(closed.homogeneous(COLOR, extinction, 6.0), (16, 1))


def _extreme_depth() -> Measured:
    scene, truth = _slab(1e300)
    naive = shader_image(scene, riemann=True)
    return known([scene], truth, textbook=naive, march=rounding(12))


def _faint_light() -> Measured:
    """Take the colour of a slab of extinction 1e-30; its alpha, 1 - T, is 0 to rounding."""
    scene, truth = _slab(1e-30)
    found = Answer("march", marched(scene)[:, :3], 16 * EPS)
    return Measured(truth[:, :3], shader_image(scene)[:, :3], (found,))


def _early_end() -> Measured:
    """Take a slab of optical depth 40, of which a ray need not see the end."""
    scene, truth = _slab(40 / 6)
    naive = shader_image(scene, step=1 / 64)
    limit = EARLY_END + rounding(48, 40 / 6, 23)
    return known([scene], truth, textbook=naive, step=1 / 8, march=limit)


def _opaque_at_once() -> Measured:
    """Take opacity 1 in the whole volume, per length of 1 and of 100: nothing of the background shows."""
    volume = Volume(np.full((4, 4, 4), 0.5), origin=(-1.5, -1.5, -1.5))
    background = (0.2, 0.2, 0.2, 1.0)
    inside = separable_image(Scene(volume, one_value(1.0), _oblique(), 8, 8))[..., 3:] > 0
    scenes = [
        Scene(
            volume,
            TransferFunction([0.5], [COLOR], None, [1.0], unit),
            _oblique(),
            8,
            8,
            background=background,
        )
        for unit in (1.0, 100.0)
    ]
    truth = np.where(inside, (*COLOR, 1.0), background)
    return known(scenes, np.stack([truth, truth]), march=rounding(1))


def _jump_to_opaque() -> Measured:
    """Let a ramp from 0 to 1 over a way of 8 jump to opacity 1 at 0.55, from an opacity of 0.2 and blue."""
    volume = linear_ramp((2, 2, 9), low=1.0, high=0.0)
    blue = (0.1, 0.2, 1.0)
    table = TransferFunction([0.55, 0.55], [blue, COLOR], opacity=[0.2, 1.0])
    scene = Scene(volume, table, _down(), 4, 4)
    front = closed.linear_opacity(blue, 0.2, 0.2, 0.55 * 8)
    truth = np.tile(closed.over(front, np.array([*COLOR, 1.0])), (16, 1))
    step = 1 / 64
    return known([scene], truth, step=step, march=1 - 0.8**step, certified=1e-11)


def _toward_opacity_one() -> Measured:
    """Let the opacity rise to 1 along the ray: its logarithm diverges there, the integral of it does not."""
    volume = linear_ramp((2, 2, 9), low=1.0, high=0.0)
    table = TransferFunction.from_opacity([0, 1], [COLOR, COLOR], [0.0, 1.0])
    camera = Camera.orthographic((0, 0, 20), (0, 0, 0), (0, 1, 0), 1.0, 0.0, 40.0)
    scene = Scene(volume, table, camera, 4, 4)
    truth = np.tile(closed.linear_opacity(COLOR, 0.0, 1.0, 8.0), (16, 1))
    # The depth is 8 (1 - e^-8 of light passes); the midpoint rule misses less than 1/2 step of a logarithm.
    step = 1 / 64
    return known([scene], truth, step=step, certified=1e-3, march=math.exp(-8) * math.log(2) / 2 * step * 2)


def _surface_on_the_entry() -> Measured:
    """Put a wall on the very face where rays enter a dense volume: the span up to it has no length."""
    wall = Mesh([(-9, -9, 2), (9, -9, 2), (0, 9, 2)], [(0, 1, 2)], colors=(0.1, 0.3, 1.0))
    volume = Volume(np.full((4, 4, 4), 0.5), origin=(-1.5, -1.5, -1.5))
    scene = Scene(volume, one_value(1e3), _down(), 4, 4, [wall])
    truth = np.tile([0.1, 0.3, 1.0, 1.0], (16, 1))
    one_step = np.tile(closed.over(closed.homogeneous(COLOR, 1e3, 0.5), truth[0]), (16, 1))
    # The distances of the wall and of the face, 18, are off by 8 ulp each.
    limit = 1e3 * 16 * EPS * 18
    # Nobody can tell a span below the rounding of the face's distance, 3/2 eps of it, from none.
    return known([scene], truth, textbook=one_step, march=limit, certified=1e3 * 1.5 * EPS * 18, slack=limit)


def _constant_on_a_jump() -> Measured:
    """Give a field of 0.1 a table that is clear below 0.1 and not from 0.1 on."""
    value = float(np.float32(0.1))
    volume = Volume(np.full((6, 6, 6), value), origin=(-2.5, -2.5, -2.5))
    table = TransferFunction([value, value], [COLOR, COLOR], [0.0, 0.3])
    scene, same = (Scene(volume, t, _oblique(), 8, 8) for t in (table, one_value(0.3)))
    truth = separable_image(same)
    fractions = np.random.default_rng(1).random((3, 64))
    seen = textbook.weighted_corners(np.full(8, value), fractions) >= value
    return known([scene], truth, textbook=truth.reshape(-1, 4) * seen[:, None], march=rounding(40, 0.3, 20))


def _nearly_linear_root() -> Measured:
    """Put a jump at 0.4 into s + bend s (1 - s), s the way along the diagonal of a cell's face."""
    bend = 2.0**-50
    half = (1 + bend) / 2  # corner values 0, half, half, 1: s + bend (s - s^2) along the diagonal
    values = np.repeat([[[0.0], [half]], [[half], [1.0]]], 2, axis=2)
    table = TransferFunction([0.4, 0.4], [COLOR, COLOR], [0.0, 1.0])
    camera = Camera.orthographic((0.5, -1, -1), (0.5, 1, 1), (1, 0, 0), 0.5, 0.0, 10.0)
    scene = Scene(Volume(values, centering="node"), table, camera, 1, 1)
    root = 0.4 - 0.24 * bend  # 0.4 = s + bend s (1 - s), to first order in bend
    way = math.sqrt(2)
    truth = closed.homogeneous(COLOR, 1.0, way * (1 - root))
    naive = closed.homogeneous(COLOR, 1.0, way * (1 - textbook.quadratic_root(-bend, 1 + bend, -0.4)))
    step = 1e-3
    return known([scene], truth, textbook=naive[None], step=step, march=step / 2 + 1e-12)


def _steep_ramp() -> Measured:
    """Let the extinction run from 0 to 1e4 over a volume 5 deep, seen from its thin side."""
    table = TransferFunction([0, 1], [(0.9, 0.1, 0.2), (0.1, 0.6, 1.0)], [0.0, 1e4])
    camera = Camera.look_at((0.7, 0.4, -14.0), (0, 0, 0), (0, 1, 0), 20.0, 0.1, 100.0)
    scene, pixels = ramp_scene(8, 8, transfer=table, camera=camera)
    return known([scene], pixels, step=1 / 2048, textbook=shader_image(scene))


PIECES = "linear pieces along every ray; phantoms.separable.separable_image"
SHADER = "the shader, at half a voxel"

CASES = (
    Case(
        "spike-one-knot-wide",
        FAMILY,
        "Is a spike of the table seen that is a quarter of a voxel wide, with an optical depth of 1250?",
        PIECES,
        f"{SHADER}: its samples step over the spike on half the rays",
        f"march, with 16 samples in the spike: rounding, and {EARLY}.  exact: {CERTIFICATE}",
        _spike,
    ),
    Case(
        "steep-ramp",
        FAMILY,
        "From extinction 0 to 1e4 along the ray, with the colours running too?",
        PIECES,
        f"{SHADER}: the light ends within the first step",
        f"march: its largest estimate.  exact: {CERTIFICATE}",
        _steep_ramp,
    ),
    Case(
        "opaque-and-clear-sheets",
        FAMILY,
        "Through sheets of optical depth 1e4 and clear gaps in turn, is only the first seen?",
        PIECES,
        f"{SHADER}, with opacity = extinction x length",
        f"march: rounding, and {EARLY}.  exact: its certificate, at most 1e-9: it counts that jumps of 1e4 "
        "are placed to some 1e-14 of a voxel only",
        _sheets,
    ),
    Case(
        "thin-sheets-of-two-colours",
        FAMILY,
        "Through eight sheets of optical depth 1, red and blue in turn, with gaps?",
        PIECES,
        SHADER,
        f"march, with steps that end on the sheets' edges: {ROUNDING}.  exact: its certificate, at most "
        "1e-11: it counts that 16 jumps, at values up to 16, are each placed to some 1e-13 of a voxel only",
        _thin_sheets,
    ),
    Case(
        "extinction-1e300",
        FAMILY,
        "At an extinction of 1e300?",
        "c (1 - exp(-6e300)) = c; phantoms.closed.homogeneous",
        f"{SHADER}, with opacity = extinction x length",
        f"march: {ROUNDING}.  exact: {CERTIFICATE}",
        _extreme_depth,
    ),
    Case(
        "colour-at-extinction-1e-30",
        FAMILY,
        "At an extinction of 1e-30, does the premultiplied colour keep its digits?",
        "6e-30 c; phantoms.closed.homogeneous",
        f"{SHADER}: 1 - exp(-5e-31) is 0",
        "12 weights of the same sign, each off by 3 ulp, and their sum by 12 halves",
        _faint_light,
        "relative",
    ),
    Case(
        "optical-depth-40",
        FAMILY,
        "Is a slab of optical depth 40 opaque although rays end early?",
        "c (1 - exp(-40)); phantoms.closed.homogeneous",
        "the shader, at 1/64 of a voxel: rays end at a transmittance of 1e-3, with an alpha of 0.999",
        "1e-6, the most that an early end may leave (half an 8-bit level is 2e-3), and rounding",
        _early_end,
    ),
    Case(
        "opacity-1-throughout",
        FAMILY,
        "With opacity 1 in all of the volume, per length of 1 or of 100, is the background hidden?",
        "the table's colour on the box, the background beside it",
        f"{SHADER}: log(1 - 1)",
        f"march: {ROUNDING}.  exact: {CERTIFICATE}",
        _opaque_at_once,
    ),
    Case(
        "jump-to-opacity-1",
        FAMILY,
        "Where the table jumps from opacity 0.2 to 1, does the ray end there, in the colour that it meets?",
        "1 - 0.8^4.4 of blue over the opaque colour",
        f"{SHADER}: the surface lies within a step",
        "march: the opacity, 1 - 0.8^step, of the step in which the jump lies.  exact: its certificate, at "
        "most 1e-11: where two cells meet, what is opaque may lie in either",
        _jump_to_opaque,
    ),
    Case(
        "opacity-0-to-1-along-the-ray",
        FAMILY,
        "Where the opacity rises to 1 at the end of the ray, and its extinction to infinity?",
        "tau = 8 int -log(1 - a) da = 8; phantoms.closed.linear_opacity",
        SHADER,
        "march: a midpoint rule for a logarithm misses (log 2) / 2 of its last step, here of exp(-8).  "
        "exact: its certificate, at most 1e-3: at the very end of the ray, where the value is 1 within "
        "rounding, it cannot tell whether the ray is stopped, and exp(-8) of the light gets there",
        _toward_opacity_one,
    ),
    Case(
        "wall-on-the-entry-face",
        FAMILY,
        "Is a wall on the very face where rays enter a volume of extinction 1000 in front of it?",
        "the wall's colour: the span up to it has no length",
        "a shader that takes at least one step, of half a voxel",
        "the distances of face and wall, 18, are off by 8 ulp each, times the extinction.  exact: beside "
        "that its certificate, itself at most 3/2 eps of the distance times the extinction",
        _surface_on_the_entry,
    ),
    Case(
        "constant-field-on-a-jump",
        FAMILY,
        "Of a field that is 0.1 throughout, with a table that jumps at 0.1, are there no holes?",
        "c (1 - exp(-sigma chord)) by scalar code",
        "eight corners times eight weights in float32: 0.09999999 at half the places, and clear",
        f"march: {ROUNDING}.  exact: {CERTIFICATE}",
        _constant_on_a_jump,
    ),
    Case(
        "nearly-linear-root",
        FAMILY,
        "Where does a field with a curvature of 1e-15 cross 0.4?",
        "at s = 0.4 - 0.24 bend of the way, to first order in the bend (the next is 1e-30)",
        "(-b + sqrt(b^2 - 4 a c)) / (2 a) with a = 1e-15, which finds 0.375",
        f"march: half a step of extinction 1.  exact: {CERTIFICATE}",
        _nearly_linear_root,
    ),
)
