"""Where a radar beam goes: from range, azimuth and elevation to the world, and back.

World: metres, x east, y north, z up, seen from the antenna.  Azimuth runs clockwise from north, elevation
upwards from the horizon, both in degrees; the range is the slant range, along the beam.

    "straight"     x = r cos(e) sin(a),  y = r cos(e) cos(a),  z = r sin(e)
                   no refraction, no curvature of the earth: the two bend the beam opposite ways
    "4/3-earth"    a straight beam over an earth of radius R = 4/3 of the true one, which is what refraction
                   in a standard atmosphere amounts to; x and y are the distance s along the ground times
                   sin(a) and cos(a), z is the height h above the antenna

        h = sqrt(r^2 + R^2 + 2 r R sin e) - R        s = R asin(r cos e / (R + h))

(Doviak and Zrnic, Doppler Radar and Weather Observations, 2nd ed. 1993, eq. 2.28b and 2.28c).
"""

import numpy as np

from volref.arrays import LARGEST_LENGTH, Floats

BEAMS = ("straight", "4/3-earth")

# 4/3 of the mean radius of the earth, metres.
EFFECTIVE_RADIUS = 4 / 3 * 6_371_000.0

# Beyond this range, metres, the model of a beam that bends evenly means nothing.
LARGEST_RANGE = 3_000_000.0


def world_of_beam(
    slant: Floats, azimuth: Floats, elevation: Floats, beam: str
) -> tuple[Floats, Floats, Floats]:
    """Return x, y, z (m) from the antenna of points on beams; the arguments broadcast.

    Examples
    --------
    >>> north_and_up = world_of_beam(np.array(1000.0), np.array(0.0), np.array(30.0), "straight")
    >>> [round(float(p), 6) for p in north_and_up]
    [0.0, 866.025404, 500.0]
    >>> [round(float(p), 1) for p in world_of_beam(np.array(1e5), np.array(90.0), np.array(0.0), "4/3-earth")]
    [99995.4, 0.0, 588.6]
    """
    bearing, tilt = np.radians(azimuth), np.radians(elevation)
    ground, height = slant * np.cos(tilt), slant * np.sin(tilt)
    if beam == "4/3-earth":
        radius = EFFECTIVE_RADIUS
        # h = sqrt(...) - R written without the difference of two large numbers.
        bent = slant * slant + 2 * radius * height
        height = bent / (np.sqrt(radius * radius + bent) + radius)
        ground = radius * np.arctan2(ground, radius + slant * np.sin(tilt))
    return ground * np.sin(bearing), ground * np.cos(bearing), np.asarray(height)


def beam_of_world(x: Floats, y: Floats, z: Floats, beam: str) -> tuple[Floats, Floats, Floats]:
    """Return slant range (m), azimuth (degrees, 0 to 360) and elevation of points from the antenna.

    Examples
    --------
    >>> [float(p) for p in beam_of_world(np.array(-3.0), np.array(0.0), np.array(4.0), "straight")]
    [5.0, 270.0, 53.13010235415598]
    """
    slant, ground, height = chord_of_world(x, y, z, beam)
    return slant, azimuth_of(x, y), elevation_of(ground, height)


def chord_of_world(x: Floats, y: Floats, z: Floats, beam: str) -> tuple[Floats, Floats, Floats]:
    """Return the length (m) of straight lines from the antenna to points, how far they go along and up.

    Along and up are those of the ground at the antenna.  Over the 4/3 earth, with p = s / R the angle at its
    centre, the line is the beam, and

        r^2 = h^2 + 4 R (R + h) sin^2(p/2)      along = (R + h) sin p      up = h - 2 (R + h) sin^2(p/2)
    """
    ground = np.sqrt(x * x + y * y)
    if beam == "straight":
        return np.sqrt(x * x + y * y + z * z), ground, z
    radius = EFFECTIVE_RADIUS
    half_sine = np.sin(ground * (0.5 / radius))
    above = radius + z
    drop = 2 * above * half_sine * half_sine
    slant = np.sqrt(np.maximum(z * z + 2 * radius * drop, 0.0))
    # sin p = 2 sin(p/2) cos(p/2), up to half the way around the earth.
    return slant, above * 2 * half_sine * np.sqrt(1 - half_sine * half_sine), z - drop


def azimuth_of(x: Floats, y: Floats) -> Floats:
    """Return the azimuth (degrees, 0 to 360) of points seen from the antenna; 0 straight above it.

    By an arcus tangent of one number: it takes a third of the time of one of two.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        # Not -0, whose quotient would point the other way.
        turn = np.arctan(y / (x + 0.0))
    turn *= -180 / np.pi
    turn += np.where(x >= 0, 90.0, 270.0)
    return np.asarray(np.where(np.isnan(turn), 0.0, turn))


def elevation_of(ground: Floats, height: Floats) -> Floats:
    """Return the elevation (degrees) of what lies `ground` >= 0 along and `height` up; 0 at the antenna."""
    with np.errstate(divide="ignore", invalid="ignore"):
        rise = np.arctan(height / ground)
    rise *= 180 / np.pi
    return np.asarray(np.where(np.isnan(rise), 0.0, rise))


def lowest_point(elevation: Floats) -> Floats:
    """Return the range (m) at which a beam over the 4/3 earth is lowest; 0 if it does not look down."""
    return np.maximum(-EFFECTIVE_RADIUS * np.sin(np.radians(elevation)), 0.0)


def widest_ring(slant: float, beam: str) -> float:
    """Return the greatest distance along the ground (m) of the points at a slant range, at any elevation."""
    if beam == "straight":
        return slant
    return float(EFFECTIVE_RADIUS * np.arcsin(slant / EFFECTIVE_RADIUS))


def slant_of_ground(ground: Floats, elevation: Floats, beam: str) -> Floats:
    """Return the slant range (m) at which beams reach a distance along the ground; 1e60 where they never do.

    With p = s / R, by the law of sines: r = R sin p / cos(e + p); over a flat earth r = s / cos e.

    Examples
    --------
    >>> slant_of_ground(np.array(1000.0), np.array(60.0), "straight").round(6).item()
    2000.0
    """
    tilt = np.radians(elevation)
    over, across = ground, np.cos(tilt)
    if beam == "4/3-earth":
        angle = ground / EFFECTIVE_RADIUS
        over, across = EFFECTIVE_RADIUS * np.sin(angle), np.cos(tilt + angle)
    slant: Floats = np.divide(over, across, out=np.full(np.shape(over), LARGEST_LENGTH), where=across > 0)
    return slant
