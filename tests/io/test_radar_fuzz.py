"""Any bytes at all: radars load or are refused; no other exception, whatever the file holds."""

import functools
import tempfile
from contextlib import suppress
from pathlib import Path

import h5py
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.radars import uneven
from volref.errors import FormatError, SceneError
from volref.io import load_radar, save_radar

CODES = np.arange(12, dtype=np.uint8).reshape(3, 4)


def write_odim(path):
    with h5py.File(path, "w") as file:
        file.attrs["Conventions"] = np.bytes_("ODIM_H5/V2_2")
        for k in (1, 2):
            group = file.create_group(f"dataset{k}/data1")
            group.create_group("what").attrs.update(quantity="DBZH", gain=0.5, offset=-32.0, nodata=255.0)
            where = file[f"dataset{k}"].create_group("where")
            where.attrs.update(elangle=1.0 * k, rstart=0.0, rscale=500.0, nrays=3, nbins=4)
            group.create_dataset("data", data=CODES, compression="gzip")


@functools.cache
def whole(kind):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"a.{kind}"
        write_odim(path) if kind == "h5" else save_radar(uneven(1), path)
        return path.read_bytes()


@pytest.mark.parametrize("kind", ["h5", "npz"])
@settings(max_examples=150, deadline=None)
@given(data=st.data())
def test_a_damaged_radar_loads_or_is_refused_in_one_sentence(kind, data):
    code = bytearray(whole(kind))
    for _ in range(data.draw(st.integers(1, 4))):
        place = data.draw(st.integers(0, len(code) - 1))
        code[place] = data.draw(st.integers(0, 255))
    end = data.draw(st.one_of(st.just(len(code)), st.integers(1, len(code))))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"a.{kind}"
        path.write_bytes(bytes(code[:end]))
        with suppress(FormatError, SceneError):
            load_radar(path)
