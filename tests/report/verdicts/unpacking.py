"""The numbers of a page read back, by other means than the page's script."""

import base64
import zlib

import numpy as np

NAMES = ("width", "height", "factor", "parts")


def unpacked(about, text):
    """Return fields (h, w, 4) of whole numbers, marks, width codes, and places (h, w, 2) as (x, y)."""
    width, height, factor, parts = (int(about[name]) for name in NAMES)
    count, data = width * height, zlib.decompress(base64.b64decode(text))
    size = 1 if parts == 1 else 4
    at = 0

    def planes(bytes_each, length):
        nonlocal at
        block = data[at : at + bytes_each * length]
        at += len(block)
        return [sum(block[k * length + i] << 8 * k for k in range(bytes_each)) for i in range(length)]

    def signed(number):
        number %= 256**size
        return number - 256**size if size == 4 and number >= 2**31 else number

    fields, base = {}, []
    for name in about["fields"].split():
        read = planes(size, 4 * count)
        if name == "nominal":
            for i in range(4 * count):
                read[i] = signed(read[i] + (read[i - 1] if i % count else 0))
            base = read
        else:
            read = [signed(a + b) for a, b in zip(read, base, strict=True)]
        fields[name] = np.array(read).reshape(4, height, width).transpose(1, 2, 0)
    marks = np.array(planes(1, count)).reshape(height, width)
    widths = np.array(planes(2, count)).reshape(height, width)
    inside = [planes(1, count) if factor > 1 else [0] * count for _ in range(2)]
    assert at == len(data)
    rows, columns = (np.array(part).reshape(height, width) for part in inside)
    y, x = np.mgrid[0:height, 0:width] * factor
    return fields, marks, widths, np.stack([x + columns, y + rows], axis=-1)
