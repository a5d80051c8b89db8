"""Radars from files: written with h5py and NumPy here, and refused where they are not what they should be."""

import zipfile
from types import SimpleNamespace

import h5py
import numpy as np
import pytest

from tests.radars import KNMI, knmi, uneven
from volref.errors import FormatError, SceneError
from volref.io import load_radar, save_radar
from volref.io.npy import write_npz
from volref.io.radar.contents import Wish
from volref.io.radar.others import contents_of_tree
from volref.scene.radar import RadarVolume

CODES = np.array([[0, 84, 255, 1], [10, 20, 30, 40], [0, 0, 64, 64]], np.uint8)
VALUES = [[-np.inf, 10.0, np.nan, -31.5], [-27.0, -22.0, -17.0, -12.0], [-np.inf, -np.inf, 0.0, 0.0]]
WHAT = {"quantity": "DBZH", "gain": 0.5, "offset": -32.0, "nodata": 255.0, "undetect": 0.0}
WHERE = {"elangle": 0.5, "rstart": 0.25, "rscale": 500.0, "nrays": 3, "nbins": 4, "a1gate": 2}


def put(group, name, said):
    part = group.require_group(name)
    for key, value in said.items():
        if value is None:
            part.attrs.pop(key, None)
        else:
            part.attrs[key] = value


def odim(
    path, *, what=None, where=None, how=None, sweeps=2, codes=CODES, version="V2_2", root=None, libver=None
):
    """Write an ODIM_H5 volume of like sweeps, 1 degree apart; None takes an attribute away."""
    with h5py.File(path, "w", libver=libver) as file:
        file.attrs["Conventions"] = np.bytes_(f"ODIM_H5/{version}")
        put(file, "what", {"date": "20110610", "time": "114002", "object": "PVOL"} | (root or {}))
        put(file, "where", {"lat": 53.0, "lon": 4.8, "height": 50.0})
        for k in range(sweeps):
            sweep = file.create_group(f"dataset{k + 1}")
            put(sweep, "where", WHERE | {"elangle": 0.5 + k} | (where or {}))
            put(sweep, "how", how or {})
            data = sweep.create_group("data1")
            put(data, "what", WHAT | (what or {}))
            if codes is not None:
                data.create_dataset("data", data=codes, compression="gzip")
    return path


def test_an_odim_volume_is_read_as_its_attributes_say(tmp_path):
    radar = load_radar(odim(tmp_path / "a.h5"))
    assert [sweep.elevation for sweep in radar.sweeps] == [0.5, 1.5]
    sweep = radar.sweeps[0]
    np.testing.assert_array_equal(sweep.values, VALUES)
    assert sweep.azimuths.tolist() == [60.0, 180.0, 300.0]
    # rstart is 0.25 km, and gate 0 has its middle half a gate further.
    assert (sweep.first_gate, sweep.gate_spacing) == (500.0, 500.0)
    assert radar.no_echo == -32.0
    assert radar.value_bounds == (-32.0, 10.0)
    assert radar.site == (53.0, 4.8, 50.0)
    assert radar.time == "2011-06-10T11:40:02+00:00"
    assert (radar.quantity, radar.units) == ("DBZH", "dBZ")


def test_the_first_gate_is_stated_in_metres_from_version_2_4_on(tmp_path):
    sweep = load_radar(odim(tmp_path / "a.h5", version="V2_4", where={"rstart": 250.0})).sweeps[0]
    assert sweep.first_gate == 500.0


@pytest.mark.parametrize(
    ("how", "azimuths"),
    [
        ({"startazA": [359.5, 119.5, 239.5], "stopazA": [0.5, 120.5, 240.5]}, [0, 120, 240]),
        ({"startazA": [1.0, 121.0, 241.0], "stopazA": [359.0, 119.0, 239.0]}, [0, 120, 240]),
        ({"azangles": "0.0:2.0,119:121,239:241,"}, [1, 120, 240]),
        ({"azangles": np.array([b"0.0:2.0,119:121,239:241"])}, [1, 120, 240]),
        ({"astart": -60.0}, [0, 120, 240]),
        ({"startazA": [0.0, 120.0, 240.0]}, [60, 180, 300]),
    ],
)
def test_radials_stand_where_they_were_measured(tmp_path, how, azimuths):
    radar = load_radar(odim(tmp_path / "a.h5", how=how))
    assert radar.sweeps[0].azimuths.tolist() == azimuths


@pytest.mark.parametrize(
    "how",
    [{"startelA": [0.4, 0.5, 0.6], "stopelA": [0.6, 0.7, 0.8]}, {"elangles": [0.5, 0.6, 0.7]}],
)
def test_elevations_are_each_radial_s_own_or_the_sweep_s(tmp_path, how):
    path = odim(tmp_path / "a.h5", how=how, sweeps=1)
    assert load_radar(path).sweeps[0].elevations.tolist() == pytest.approx([0.5, 0.6, 0.7], abs=1e-15)
    assert load_radar(path, elevations="sweep").sweeps[0].elevations.tolist() == [0.5] * 3


def test_a_quantity_is_chosen_by_its_name_and_sweeps_without_it_are_left_out(tmp_path):
    path = odim(tmp_path / "a.h5", sweeps=3)
    with h5py.File(path, "a") as file:
        put(file["dataset2/data1"], "what", {"quantity": "VRADH"})
        speed = file.create_group("dataset3/data2")
        put(speed, "what", {"quantity": np.array([b"VRADH"]), "gain": 0.25, "offset": -32.0})
        put(speed, "what", {"nodata": 255.0, "undetect": 0.0})
        speed.create_dataset("data", data=CODES)
    assert [s.elevation for s in load_radar(path).sweeps] == [0.5, 2.5]
    speeds = load_radar(path, quantity="VRADH")
    assert [s.elevation for s in speeds.sweeps] == [1.5, 2.5]
    assert (speeds.units, speeds.no_echo) == ("m/s", None)
    assert speeds.sweeps[1].values[1].tolist() == [-29.5, -27.0, -24.5, -22.0]
    with pytest.raises(FormatError, match=r"must hold the quantity 'ZDR', got DBZH, VRADH; pass quantity="):
        load_radar(path, quantity="ZDR")


def test_attributes_stated_for_a_sweep_or_the_file_hold_below(tmp_path):
    path = odim(tmp_path / "a.h5", what={"gain": None, "offset": None}, where={"rscale": None})
    with h5py.File(path, "a") as file:
        put(file, "what", {"gain": 1.0})
        put(file, "where", {"rscale": 250.0})
        for k in (1, 2):
            put(file[f"dataset{k}"], "what", {"offset": 5.0})
    sweep = load_radar(path).sweeps[0]
    assert sweep.values[1].tolist() == [15.0, 25.0, 35.0, 45.0]
    assert sweep.gate_spacing == 250.0


def test_sweeps_are_counted_beyond_nine(tmp_path):
    radar = load_radar(odim(tmp_path / "a.h5", sweeps=12))
    assert [s.elevation for s in radar.sweeps] == [0.5 + k for k in range(12)]


def elsewhere(folder, make):
    """Write a volume whose gates lie in another file, by `make(data group, that file)`."""
    path, other = odim(folder / "a.h5", codes=None), folder / "b.h5"
    with h5py.File(other, "w") as file:
        file.create_dataset("data", data=CODES)
    with h5py.File(path, "a") as file:
        for k in (1, 2):
            make(file[f"dataset{k}/data1"], other)
    return path


def external_link(group, other):
    group["data"] = h5py.ExternalLink(str(other), "data")


def soft_link(group, _):
    group["data"] = h5py.SoftLink("/elsewhere")


def virtual(group, other):
    layout = h5py.VirtualLayout((3, 4), np.uint8)
    layout[:] = h5py.VirtualSource(str(other), "data", (3, 4))
    group.create_virtual_dataset("data", layout)


def external_bytes(group, other):
    group.create_dataset("data", (3, 4), np.uint8, external=[(str(other), 0, 12)])


BIG = (100_000, 100_000)


def huge(path):
    odim(path, codes=None, where={"nrays": BIG[0], "nbins": BIG[1]})
    with h5py.File(path, "a") as file:
        for k in (1, 2):
            file[f"dataset{k}/data1"].create_dataset(
                "data", BIG, np.uint8, chunks=(1000, 1000), compression=9
            )
    return path


def unwritten(path):
    odim(path, codes=None, where={"nrays": 5000, "nbins": 5000})
    with h5py.File(path, "a") as file:
        for k in (1, 2):
            file[f"dataset{k}/data1"].create_dataset("data", (5000, 5000), np.uint8, chunks=(100, 100))
    return path


def with_long_attribute(path):
    return odim(path, how={"startazA": np.zeros(200_000), "stopazA": np.zeros(200_000)}, libver="latest")


BAD_ODIM = {
    "no sweep": (lambda f: odim(f / "a.h5", sweeps=0), "must begin|must hold"),
    "no data": (lambda f: odim(f / "a.h5", codes=None), "got no data; write it again"),
    "text": (lambda f: odim(f / "a.h5", codes=np.full((3, 4), b"a")), r"as numbers \(radials, gates\), got"),
    "one axis": (lambda f: odim(f / "a.h5", codes=CODES[0]), r"got uint8 of shape \(4,\)"),
    "other size": (lambda f: odim(f / "a.h5", where={"nbins": 5}), r"3 x 5 gates in .*, got 3 x 4"),
    "no rscale": (
        lambda f: odim(f / "a.h5", where={"rscale": None}),
        "where/rscale of .* as a number, got None",
    ),
    "zero rscale": (lambda f: odim(f / "a.h5", where={"rscale": 0.0}), "gate_spacing must be at least"),
    "NaN gain": (lambda f: odim(f / "a.h5", what={"gain": np.nan}), "sweep.gain must be finite"),
    "text elangle": (lambda f: odim(f / "a.h5", where={"elangle": "low"}), "where/elangle of .* as a number"),
    "infinite elangle": (lambda f: odim(f / "a.h5", where={"elangle": np.inf}), "elevations must be finite"),
    "few azimuths": (
        lambda f: odim(f / "a.h5", how={"startazA": [1.0], "stopazA": [2.0]}),
        "how/startazA as 3 numbers, got 1",
    ),
    "few pairs": (lambda f: odim(f / "a.h5", how={"azangles": "0:1,1:2"}), "hold 3 pairs .* got 2"),
    "odd pairs": (lambda f: odim(f / "a.h5", how={"azangles": "0:1,1:2,x:3"}), "must be a readable ODIM_H5"),
    "external link": (lambda f: elsewhere(f, external_link), "itself, got a ExternalLink"),
    "soft link": (lambda f: elsewhere(f, soft_link), "itself, got a SoftLink"),
    "virtual": (lambda f: elsewhere(f, virtual), "itself, got data in another file"),
    "external bytes": (lambda f: elsewhere(f, external_bytes), "itself, got data in another file"),
    "huge": (lambda f: huge(f / "a.h5"), "at most 2 GiB of memory, got 149 GiB"),
    "unwritten": (lambda f: unwritten(f / "a.h5"), "got 0 compressed bytes, which cannot"),
    "long attribute": (lambda f: with_long_attribute(f / "a.h5"), "in at most 1048576 bytes, got 1600000"),
    "all without data": (lambda f: odim(f / "a.h5", codes=np.full((3, 4), 255, np.uint8)), "gate with data"),
}


@pytest.mark.parametrize("name", BAD_ODIM)
def test_a_bad_odim_file_is_refused_in_one_sentence(tmp_path, name):
    build, says = BAD_ODIM[name]
    with pytest.raises((FormatError, SceneError), match=says) as caught:
        load_radar(build(tmp_path), kind="odim")
    assert "\n" not in str(caught.value)
    assert str(caught.value).count(";") == 1


def test_a_file_cut_anywhere_is_refused(tmp_path):
    whole = odim(tmp_path / "a.h5").read_bytes()
    cut = tmp_path / "cut.h5"
    for length in range(9, len(whole) - 1, 997):
        cut.write_bytes(whole[:length])
        with pytest.raises(FormatError, match="must be a readable"):
            load_radar(cut)


def test_the_committed_storms_load_from_npz():
    radar = load_radar(KNMI)
    expected = knmi()
    assert radar.no_echo == -31.5
    assert radar.site == expected.site
    for found, wanted in zip(radar.sweeps, expected.sweeps, strict=True):
        np.testing.assert_array_equal(found.values, wanted.values)
        np.testing.assert_array_equal(found.azimuths, wanted.azimuths)
        assert (found.first_gate, found.gate_spacing) == (wanted.first_gate, wanted.gate_spacing)
        assert found.elevation == wanted.elevation


@pytest.mark.parametrize("beam", ["straight", "4/3-earth"])
def test_what_is_saved_is_loaded_again(tmp_path, beam):
    radar = uneven(4, beam=beam)
    radar = RadarVolume(
        radar.sweeps,
        beam=beam,
        origin=(1, 2, 3),
        site=(4, 5, 6),
        time="2011-06-10T11:40:02+00:00",
        no_echo=-40,
    )
    save_radar(radar, tmp_path / "a.npz")
    again = load_radar(tmp_path / "a.npz")
    for name in ("beam", "origin", "site", "time", "no_echo", "quantity", "units", "value_bounds"):
        assert getattr(again, name) == getattr(radar, name)
    for found, wanted in zip(again.sweeps, radar.sweeps, strict=True):
        for name in ("azimuths", "elevations", "values"):
            np.testing.assert_array_equal(getattr(found, name), getattr(wanted, name))
    with pytest.raises(FormatError, match="must not exist yet"):
        save_radar(radar, tmp_path / "a.npz")
    with pytest.raises(FormatError, match=r"must end in .npz, got '.h5'"):
        save_radar(radar, tmp_path / "a.h5")


def test_a_quantity_without_a_floor_is_saved_as_one(tmp_path):
    speed = RadarVolume(uneven(4).sweeps, quantity="VRADH", units="m/s")
    save_radar(speed, tmp_path / "a.npz")
    again = load_radar(tmp_path / "a.npz", quantity="VRADH")
    assert (again.no_echo, again.units) == (None, "m/s")


def test_what_the_user_states_comes_before_what_the_file_says(tmp_path):
    save_radar(uneven(4), tmp_path / "a.npz")
    radar = load_radar(tmp_path / "a.npz", no_echo=-50, beam="4/3-earth", origin=(1, 2, 3))
    assert (radar.no_echo, radar.beam, radar.origin) == (-50.0, "4/3-earth", (1.0, 2.0, 3.0))


SERIES = {
    "codes": np.stack([np.stack([CODES + k, CODES + k]) for k in range(3)]),
    "elangle": np.array((1.0, 2.0)),
    "rscale_m": np.array(500.0),
    "gain": np.array(0.5),
    "offset": np.array(-32.0),
    "undetect": np.array(0.0),
    "nodata": np.array(255.0),
    "time": np.array(["20200207130000", "20200207130500", "20200207131000"]),
}


def npz(path, **change):
    write_npz(path, {key: np.asarray(value) for key, value in (SERIES | change).items() if value is not None})
    return path


def test_one_volume_of_several_is_chosen_by_its_index(tmp_path):
    path = npz(tmp_path / "a.npz")
    radar = load_radar(path, time=1)
    assert radar.time == "2020-02-07T13:05:00+00:00"
    assert radar.sweeps[1].values[1].tolist() == [-26.5, -21.5, -16.5, -11.5]
    single = npz(tmp_path / "b.npz", codes=SERIES["codes"][0], time=None)
    assert load_radar(single).time is None


def test_radials_and_gates_of_their_own_are_read(tmp_path):
    own = {
        "azimuth_00": [10.5, 130.0, 250.25],
        "elevation_00": [1.0, 1.1, 1.2],
        "range_m_00": [0, 1e3, 2e3, 3e3],
    }
    path = npz(
        tmp_path / "a.npz", codes=None, codes_00=CODES, elangle=None, rscale_m=None, range_folded=1, **own
    )
    sweep = load_radar(path).sweeps[0]
    assert sweep.azimuths.tolist() == [10.5, 130.0, 250.25]
    assert sweep.elevations.tolist() == [1.0, 1.1, 1.2]
    assert (sweep.first_gate, sweep.gate_spacing) == (0.0, 1000.0)
    assert np.isnan(sweep.values[0, 2:]).all()
    assert load_radar(path, elevations="sweep").sweeps[0].elevations.tolist() == [1.1] * 3


@pytest.mark.parametrize(
    ("change", "keywords", "says"),
    [
        ({}, {}, "asked for an index time= from 0 to 2 time, got None"),
        ({}, {"time": 3}, "from 0 to 2 time, got 3"),
        ({"codes": CODES}, {}, r"codes \(sweeps, radials, gates\) or \(times.*got \(3, 4\)"),
        ({"codes": np.ones((201, 1, 1), np.uint8)}, {}, "at most 200 sweeps"),
        ({"codes": None}, {}, "must hold values_00, .* got none"),
        ({"codes": None, "values_00": np.ones(3)}, {}, r"got \[\(3,\)\]"),
        ({"codes": None, "values_00": CODES}, {}, "float32 or float64, got uint8"),
        ({"codes": None, "codes_00": CODES, "elangle": None}, {}, "elevation_00 or elangle, got none"),
        ({"codes": None, "codes_00": CODES, "rscale_m": None}, {}, "rscale_m as one number or one for each"),
        ({"codes": None, "codes_00": CODES, "gain": "a"}, {}, "must hold gain as one number"),
        (
            {"codes": None, "codes_00": CODES, "range_m_00": [0.0, 1.0, 3.0, 4.0]},
            {},
            "range_m_00 in even steps",
        ),
        ({"quantity": "ZDR"}, {"time": 0}, "must hold the quantity 'DBZH', got ZDR"),
        ({"time": ["then", "later", "last"]}, {"time": 0}, "radar.time must be a date and time"),
        ({}, {"time": 0, "max_bytes": 100}, "at most 100 bytes of memory"),
        ({"site_lat_lon_height": [1.0, 2.0]}, {"time": 0}, "radar.site must have shape"),
        ({"codes": SERIES["codes"] * 0 + 255}, {"time": 0}, "must hold a gate with data"),
    ],
)
def test_a_bad_npz_is_refused_in_one_sentence(tmp_path, change, keywords, says):
    with pytest.raises((FormatError, SceneError), match=says) as caught:
        load_radar(npz(tmp_path / "a.npz", **change), **keywords)
    assert str(caught.value).count(";") == 1


@pytest.mark.parametrize(
    ("data", "keywords", "says"),
    [
        (b"not a radar", {}, "must begin like a radar file"),
        (b"BZh91AY", {}, "unpack a compressed file"),
        (b"", {}, "got an empty file"),
        (b"\x89HDF\r\n\x1a\nmore", {}, "must be a readable HDF5 file"),
        (b"PK and no more", {}, "must be a readable .npz file"),
        (b"AR2V0006.", {}, "xradar must be installed"),
        (b"AR2V0006.", {"kind": "word"}, "kind must be 'odim' or 'npz'"),
        (b"AR2V0006.", {"time": 1}, "must hold one volume, got time=1"),
        (b"AR2V0006.", {"max_bytes": 3}, "at most 3 bytes of memory"),
        (b"AR2V0006.", {"elevations": "all"}, "elevations must be 'radial' or 'sweep'"),
        (b"AR2V0006.", {"fill": 0}, "fill must be 'no data' or 'no echo'"),
    ],
)
def test_other_files_are_refused_in_one_sentence(tmp_path, monkeypatch, data, keywords, says):
    # Whether or not it is installed here.
    monkeypatch.setitem(__import__("sys").modules, "xradar", None)
    (tmp_path / "a").write_bytes(data)
    with pytest.raises((FormatError, SceneError), match=says):
        load_radar(tmp_path / "a", **keywords)


def test_an_npz_that_is_too_large_for_its_file_is_refused(tmp_path):
    path = npz(tmp_path / "a.npz", codes=None, codes_00=CODES)
    with zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED) as archive:
        header = b"{'descr': '|u1', 'fortran_order': False, 'shape': (90000, 90000), }".ljust(117) + b"\n"
        archive.writestr("codes_01.npy", b"\x93NUMPY\x01\x00\x76\x00" + header)
    with pytest.raises(FormatError, match="at most 2 GiB of memory"):
        load_radar(path)


class Column(SimpleNamespace):
    """As much of an xarray.DataArray as is read."""

    @property
    def shape(self):
        return self.values.shape

    @property
    def ndim(self):
        return self.values.ndim

    @property
    def dtype(self):
        return self.values.dtype

    @property
    def sizes(self):
        return dict(zip(self.dims, self.shape, strict=True))

    def transpose(self, *dims):
        order = [self.dims.index(name) for name in dims]
        return Column(
            values=self.values.transpose(order), dims=dims, attrs=self.attrs, encoding=self.encoding
        )


def column(values, dims, **attrs):
    return Column(values=np.asarray(values), dims=dims, attrs=attrs, encoding={})


class Group(dict):
    @property
    def data_vars(self):
        return self

    @property
    def children(self):
        return [name for name in self if isinstance(self[name], Group)]

    def to_dataset(self):
        return self


def tree(gates=CODES, dims=("azimuth", "range"), ranges=(500, 1500, 2500, 3500), **attrs):
    said = {"scale_factor": 0.5, "add_offset": -32.0} | attrs
    sweep = Group(
        DBZH=column(gates, dims, **said),
        range=column(ranges, ("range",)),
        azimuth=column((0.5, 120.5, 240.5), ("azimuth",)),
        elevation=column((1.0, 1.1, 1.2), ("azimuth",)),
    )
    where = {
        key: column(value, ()) for key, value in (("latitude", 41.6), ("longitude", -88.0), ("altitude", 202))
    }
    return Group(sweep_0=sweep, time_coverage_start=column("2003-01-01T00:09:21Z", ()), **where)


def read(opened, name="cfradial1", tmp="a.nc", **wish):
    return contents_of_tree(SimpleNamespace(name=tmp), opened, name, Wish("DBZH", 2**31, **wish))


def test_what_xradar_opens_is_read_by_its_codes():
    contents = read(tree(_FillValue=255, _Undetect=0))
    np.testing.assert_array_equal(contents.sweeps[0].values, VALUES)
    assert contents.sweeps[0].first_gate == 500.0
    assert contents.said["no_echo"] == -32.0
    assert contents.said["site"] == [41.6, -88.0, 202.0]
    radar = RadarVolume(contents.sweeps, **contents.said)
    assert radar.time == "2003-01-01T00:09:21Z"


def test_gates_given_range_first_are_turned():
    contents = read(tree(CODES.T, ("range", "time"), _FillValue=255, _Undetect=0))
    np.testing.assert_array_equal(contents.sweeps[0].values, VALUES)


def test_the_two_codes_of_nexrad_are_no_echo_and_no_data():
    values = read(tree(), "nexradlevel2").sweeps[0].values
    assert np.isneginf(values[0, 0])
    assert np.isnan(values[0, 3])
    assert values[0, 2] == 95.5


def test_a_lone_fill_value_means_what_the_user_says():
    assert np.isnan(read(tree(_FillValue=0)).sweeps[0].values[0, 0])
    assert np.isneginf(read(tree(_FillValue=0), fill_is_no_echo=True).sweeps[0].values[0, 0])
    assert read(tree()).sweeps[0].values[0, 0] == -32.0


def test_more_gates_than_a_radar_can_have_are_refused():
    with pytest.raises(FormatError, match="within 600 km, got 700 km by xradar, which misreads"):
        read(tree(ranges=(0, 200e3, 400e3, 600e3)))
    with pytest.raises(FormatError, match="range in even steps"):
        read(tree(ranges=(0, 1, 3, 9)))


def test_a_tree_without_the_quantity_or_with_too_much_of_it_is_refused():
    with pytest.raises(FormatError, match="must hold the quantity 'ZDR', got DBZH"):
        contents_of_tree(SimpleNamespace(name="a.nc"), tree(), "cfradial1", Wish("ZDR", 2**31))
    with pytest.raises(FormatError, match="at most 10 bytes of memory"):
        contents_of_tree(SimpleNamespace(name="a.nc"), tree(), "cfradial1", Wish("DBZH", 10))
    many = Group({f"sweep_{k}": tree()["sweep_0"] for k in range(201)})
    with pytest.raises(FormatError, match="at most 200 sweeps, got 201"):
        read(many)
