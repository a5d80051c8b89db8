"""Choices that several groups share: what a target or a texture holds, how it is read."""

STORED = {
    "unorm8": "8 bits from 0 to 1",
    "half": "16-bit floating point",
    "float": "32-bit floating point",
    "exact": "64-bit floating point, what no GPU has",
}
FILTERS = {"nearest": "the texel that holds the coordinate", "linear": "between the texels around it"}
