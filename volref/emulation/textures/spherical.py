"""From a position in the cube around a radar to its sweeps in a texture (seed 001, section 4, eq. 18 to 20).

n points; all arrays are (n,), in the control type of the device.  The radar is at (1/2, 1/2, 1/2), north is
y, up is z.  With q = p - 1/2, put right and as printed:

    r     = |q|                     |q|                     eq. 18
    phi   = atan(q_y, q_x) + pi     atan(y, x) + pi         eq. 19
    theta = acos(q_z / r)           acos(z / phi)           eq. 20
    u     = 3/4 - phi / 2 pi - turn phi / 2 pi              no equation: a reading
    tilt  = pi / 2 - theta          pi / 2 - theta          no equation: a reading

phi runs anticlockwise from the west; radars count clockwise from north.  The sweeps around a tilt are
searched; eq. 5 to 17 do the rest, with M_x = 1 and M_y = S tiles.  Outside the sweeps and the gates the value
is 0.
"""

import numpy as np

from volref.arrays import Booleans, Floats
from volref.emulation.device import Device
from volref.emulation.groups import VolumeTexture
from volref.emulation.textures.angles import arccosine, arctangent
from volref.emulation.textures.radar_image import PolarGrid
from volref.emulation.textures.slices import SlicePair, in_atlas


def spherical(position: Floats, device: Device, *, printed: bool) -> tuple[Floats, Floats, Floats]:
    """Return r, phi and theta (n,) of points (3, n) in texture space, by eq. 18 to 20; theta may be NaN.

    Examples
    --------
    To the east of the antenna and as high above it:

    >>> east = np.array([[0.75], [0.5], [0.75]], np.float32)
    >>> [round(np.degrees(angle).item(), 3) for angle in spherical(east, Device(), printed=False)[1:]]
    [180.0, 45.0]
    >>> [round(np.degrees(angle).item(), 3) for angle in spherical(east, Device(), printed=True)[1:]]
    [213.69, 78.399]
    """
    kind = position.dtype.type
    q = position - kind(0.5)
    r = np.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2])
    x, y, z = position if printed else q
    phi = arctangent(device, y, x) + kind(np.pi)
    with np.errstate(invalid="ignore", divide="ignore"):
        theta = arccosine(device, z / (phi if printed else r))
    return np.asarray(r), phi, theta


def sweep_pair(
    switches: VolumeTexture, grid: PolarGrid, position: Floats, device: Device
) -> tuple[SlicePair, Booleans]:
    """Return the sweeps below and above points (3, n), where these lie in them, and which lie between any.

    Examples
    --------
    Half-way between the second and the third of four sweeps, an eighth of a turn from north, in the middle
    of the range:

    >>> grid = PolarGrid(np.array([-0.2, -0.1, 0.1, 0.2]), 0.0, 0.5, 0.0, 360, 400)
    >>> rules = VolumeTexture(layout="atlas", tiles_across=1, geometry="spherical")
    >>> way = 0.25 * np.sqrt(0.5)
    >>> pair, seen = sweep_pair(rules, grid, np.array([[0.5 + way], [0.5 + way], [0.5]]), Device())
    >>> seen.item(), pair.first.item(), [round(part.item(), 6) for part in pair[2:]]
    (True, 1.0, [0.5, 0.125, 0.375, 0.125, 0.625])
    """
    printed = switches.geometry == "spherical-printed"
    r, phi, theta = spherical(position, device, printed=printed)
    tilt = position.dtype.type(np.pi / 2) - theta
    return placed_between(switches, grid, (position, r, phi), tilt)


def placed_between(
    switches: VolumeTexture, grid: PolarGrid, place: tuple[Floats, Floats, Floats], tilt: Floats
) -> tuple[SlicePair, Booleans]:
    """Return the same of points (3, n), their r and phi (n,), and elevations (n,)."""
    position, r, phi = place
    kind = position.dtype.type
    share_of_turn = phi * kind(0.5 / np.pi)
    if switches.geometry != "spherical-printed":
        share_of_turn = (kind(0.75) - share_of_turn) - kind(grid.turn)
        share_of_turn = share_of_turn - np.floor(share_of_turn)
    along = (r - kind(grid.start)) / kind(grid.span)
    tilts = grid.tilts.astype(kind)
    first = np.clip(np.searchsorted(tilts, tilt, side="right") - 1, 0, max(len(tilts) - 2, 0))
    above = np.minimum(first + 1, len(tilts) - 1)
    seen = (tilt >= tilts[0]) & (tilt <= tilts[-1]) & (above > first)
    seen &= (along >= 0) & (along <= 1)
    with np.errstate(invalid="ignore", divide="ignore"):
        share = (tilt - tilts[first]) / (tilts[above] - tilts[first])
    lower = first.astype(position.dtype)
    if switches.between == "x":
        share = share_of_turn * kind(len(tilts)) - lower
    inside = _column(switches, grid, share_of_turn), _row(switches, grid, along)
    upper = lower + kind(1)
    coordinates = in_atlas(switches, (lower, upper), inside, (1, len(tilts)))
    return SlicePair(lower, upper, share, *coordinates), seen


def _column(switches: VolumeTexture, grid: PolarGrid, share_of_turn: Floats) -> Floats:
    """Return where 0..1 of a turn lies across the image."""
    if switches.seam == "clamped":
        return share_of_turn
    kind = share_of_turn.dtype.type
    return np.asarray((share_of_turn * kind(grid.columns) + kind(1)) / kind(grid.columns + 2))


def _row(switches: VolumeTexture, grid: PolarGrid, along: Floats) -> Floats:
    """Return where 0..1 of the range lies in a sweep."""
    if switches.in_tile == "bleeds":
        return along
    kind = along.dtype.type
    half = kind(0.5 / grid.gates)
    return np.minimum(np.maximum(along, half), kind(1) - half)
