"""The value of a radar at one point, in plain Python: the judge of the array form.

It shares no code with volref: its own geometry, searches and interpolation.  None: nothing is seen there.
"""

import itertools
import math

ON = 1e-9  # as the definition has it: this near to a gate, a radial or a sweep lies on it
WIDEST_GAP = 1.75
EARTH = 6_371_000.0 * 4 / 3


def point_of(slant, azimuth, elevation, beam="straight"):
    a, e = math.radians(azimuth), math.radians(elevation)
    if beam == "straight":
        ground, height = slant * math.cos(e), slant * math.sin(e)
    else:
        height = math.sqrt(slant**2 + EARTH**2 + 2 * slant * EARTH * math.sin(e)) - EARTH
        ground = EARTH * math.asin(slant * math.cos(e) / (EARTH + height))
    return ground * math.sin(a), ground * math.cos(a), height


def polar_of(x, y, z, beam="straight"):
    ground = math.sqrt(x * x + y * y)
    azimuth = math.degrees(math.atan2(x, y)) % 360.0
    if beam == "straight":
        return math.sqrt(ground**2 + z**2), azimuth, math.degrees(math.atan2(z, ground))
    angle = ground / EARTH
    across, up = (EARTH + z) * math.sin(angle), (EARTH + z) * math.cos(angle) - EARTH
    return math.sqrt(across**2 + up**2), azimuth, math.degrees(math.atan2(up, across))


def mixed(pairs):
    """Weighted mean of (weight, value); None if a value with a weight is None."""
    counted = [(w, v) for w, v in pairs if w > 0]
    if any(v is None for _, v in counted):
        return None
    return sum(w * v for w, v in counted)


def shares(part):
    if part < ON:
        return 1.0, 0.0
    return (0.0, 1.0) if part > 1 - ON else (1 - part, part)


def neighbours(azimuths, azimuth):
    """Radials before and after an azimuth, and the share of the way; None where they are too far apart."""
    turned = sorted(((azimuth - a + ON) % 360.0, k) for k, a in enumerate(azimuths))
    before = turned[0][1]
    after = turned[-1][1]
    width = (azimuths[after] - azimuths[before]) % 360.0 or 360.0
    steps = sorted((azimuths[(k + 1) % len(azimuths)] - a) % 360.0 or 360.0 for k, a in enumerate(azimuths))
    middle = (steps[(len(steps) - 1) // 2] + steps[len(steps) // 2]) / 2
    turn = max(turned[0][0] - ON, 0.0)
    if width > WIDEST_GAP * middle and turn > ON:
        return before, after, None
    return before, after, turn / width


def gate_value(gate, no_echo):
    if math.isnan(gate):
        return None
    return no_echo if gate == -math.inf else float(gate)


def along_radial(sweep, radial, slant, no_echo):
    gates = sweep.values[radial]
    place = (slant - sweep.first_gate) / sweep.gate_spacing
    if not -0.5 - ON <= place <= len(gates) - 0.5 + ON:
        return None
    place = min(max(place, 0), len(gates) - 1)
    if abs(place - round(place)) < ON:
        return gate_value(gates[round(place)], no_echo)
    low = int(place)
    part = place - low
    return mixed([(1 - part, gate_value(gates[low], no_echo)), (part, gate_value(gates[low + 1], no_echo))])


def on_sweep(sweep, slant, azimuth, no_echo):
    """Value and elevation of a sweep at a range and azimuth."""
    before, after, part = neighbours(list(sweep.azimuths), azimuth)
    if part is None:
        return None, float(sweep.elevations[before])
    first, second = shares(part)
    elevation = first * sweep.elevations[before] + second * sweep.elevations[after]
    values = [along_radial(sweep, k, slant, no_echo) for k in (before, after)]
    return mixed([(first, values[0]), (second, values[1])]), elevation


def value_at(radar, point):
    x, y, z = (float(p) - o for p, o in zip(point, radar.origin, strict=True))
    slant, azimuth, elevation = polar_of(x, y, z, radar.beam)
    found = [on_sweep(sweep, slant, azimuth, radar.no_echo) for sweep in radar.sweeps]
    for value, tilt in found:
        if abs(elevation - tilt) <= ON:
            return value
    for (low, bottom), (high, top) in itertools.pairwise(found):
        if bottom < elevation < top:
            part = (elevation - bottom) / (top - bottom)
            return mixed([(1 - part, low), (part, high)])
    return None
