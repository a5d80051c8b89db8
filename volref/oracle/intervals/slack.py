"""How far the arithmetic of a correct machine may be from exact arithmetic.

u is half a unit in the last place of 1: 2^-24 of float32, 2^-11 of float16.  A sum or a product is rounded
correctly, which is off by u times its result.  WebGPU (section 15.7.4.4, "Accuracy of concrete floating point
expressions") allows a division 2.5 units in the last place, which is 5 u, and the root of an inverse square,
by which vectors are normalised, 2; with the freedom "khronos" both count as 5 u.
"""

from dataclasses import dataclass

from volref.emulation.device import Device

UNIT = {"float16": 2.0**-11, "float32": 2.0**-24, "float64": 2.0**-53}

# Units u that a division or a root may be off.
DIVISION = {"none": 0.0, "rounded": 1.0, "khronos": 5.0}

# Errors of log2 (absolute) and exp2 (units 2^-23 at 0, and for each unit of its argument), WebGPU 15.7.4.4.
LOG2_ERROR = 2.0**-21
EXP2_ULPS, EXP2_ULPS_PER_UNIT = 3.0, 2.0


@dataclass(frozen=True)
class Slack:
    """Relative errors of one operation: `control` of positions and lengths, `values` of colours and sums.

    division: of a division or a root among those of positions.  weight: by how much of a texel a filter may
    be off.
    """

    control: float
    division: float
    values: float
    weight: float

    def power(self, exponent: float) -> float:
        """Return by how much x^y may be off for x of 0..1 and an exponent y.

        x^y = exp2(y log2 x): an error d of log2 makes y d ln 2 of it.  With z = y log2 x <= 0, exp2 is off by
        (3 + 2 |z|) 2^-23 2^z; |z| 2^z is at most 1 / (e ln 2) = 0.531.
        """
        if self.values == 0.0:
            return 0.0
        coarse = self.values / UNIT["float32"] if self.values > 5 * UNIT["float32"] else 1.0
        logarithm = exponent * LOG2_ERROR * 0.6932
        product = self.values * 0.531 * 0.6932
        exponential = (EXP2_ULPS + EXP2_ULPS_PER_UNIT * 0.531) * 2.0**-23
        return coarse * (logarithm + exponential) + product


def slack_of(device: Device) -> Slack:
    """Return how far a device's arithmetic may be from exact arithmetic.

    Values that are emulated in float64 are computed in float32 by every GPU.
    """
    some = device.freedom != "none"
    control = UNIT[device.control] if device.control != "float64" else UNIT["float32"]
    values = UNIT["float16"] if device.values == "float16" else UNIT["float32"]
    division = DIVISION[device.freedom] * control
    return Slack(some * control, division, some * values, device.weight_slack)
