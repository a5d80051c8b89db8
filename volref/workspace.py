"""Buffers that outlive one call, so that the inner loops allocate nothing.

Fresh memory costs a page fault per 4 KiB, which on a marcher's arrays is dearer than the arithmetic.
"""

import numpy as np

from volref.arrays import Numbers


class Workspace:
    """Flat buffers by name and type, grown on demand; one per thread.

    A buffer's content lasts until the same name is asked for again, whatever the length.

    Examples
    --------
    >>> work = Workspace()
    >>> work.get("opacity", 3).shape, work.get("opacity", 2).base is work.get("opacity", 3).base
    ((3,), True)
    """

    def __init__(self) -> None:
        self._buffers: dict[tuple[str, np.dtype[np.generic]], Numbers] = {}

    def get(self, name: str, count: int, dtype: np.typing.DTypeLike = np.float64) -> Numbers:
        """Return the first `count` elements of the buffer `name`: what was last written there, or 0."""
        key = name, np.dtype(dtype)
        buffer = self._buffers.get(key)
        if buffer is None or len(buffer) < count:
            buffer = self._buffers[key] = np.zeros(count, key[1])
        return buffer[:count]
