"""Implicit mip levels: a fragment's level of detail is how far its neighbours' coordinates are apart.

A GPU walks fragments in quads, two by two pixels of one triangle, step by step together; the pixels of a quad
that the triangle does not cover are walked along as helpers, on coordinates beyond its edge.  At each fetch
of the table, with u the place of each lane's value in texels:

    lane 2 | lane 3        rho = max(|u1 - u0|, |u2 - u0|), one for the quad      lambda = log2 rho
    -------+-------
    lane 0 | lane 1        a mix of the levels floor(lambda) and floor(lambda) + 1, each fetched linearly

So a pixel's colour hangs on its neighbours, also on those whose rays have ended: their lanes stay where they
took their last sample.  L lanes, four for each quad; y upwards.
"""

import numpy as np

from volref.arrays import Floats
from volref.emulation.device import Device
from volref.formats import codes_of, decoded
from volref.stages.textures import Texture, fetch_mipmapped, mip_chain
from volref.workspace import Workspace

LANES = 4


def levels_of(table: Texture, *, narrow: bool) -> tuple[Texture, ...]:
    """Return a table and its mip levels, each the mean of two texels of the last, in bytes if it is."""
    chain = [table.texels]
    while max(chain[-1].shape[:2]) > 1:
        level = mip_chain(chain[-1])[1]
        chain.append(decoded(codes_of(level), level.dtype) if narrow else level)
    return tuple(
        Texture(level, "linear", result_bits=table.result_bits, weight_bits=table.weight_bits)
        for level in chain
    )


def classified_in_quads(
    levels: tuple[Texture, ...], place: Floats, device: Device, work: Workspace
) -> Floats:
    """Return colours (4, L) at places (L,) of a table with mip levels, the lanes of a quad side by side."""
    quads = place.reshape(-1, LANES)
    apart = np.abs(quads[:, 1:3] - quads[:, :1]) * place.dtype.type(levels[0].sizes[0])
    detail = level_of_detail(apart.max(axis=1), device).repeat(LANES)
    return fetch_mipmapped(levels, (place, np.full_like(place, 0.5)), detail, work)


def level_of_detail(rho: Floats, device: Device) -> Floats:
    """Return log2 of a footprint in texels, as the device computes it.

    SwiftShader reads off the bits of rho^4 as float32, which are linear between powers of two.
    """
    if device.detail == "bits":
        squared = np.square(rho, dtype=np.float32)
        bits = np.square(squared).view(np.int32).astype(np.float32)
        return np.asarray((bits - np.float32(0x3F800000)) * np.float32(2.0**-25))
    return np.log2(rho)
