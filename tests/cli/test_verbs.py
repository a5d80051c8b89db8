"""`volref compare`, `info`, `convert`, `report`, `demo`."""

import json
import platform
from importlib import metadata

import numpy as np
import pytest
from PIL import Image

import volref
from volref import compare, convert_volume, describe_file, load_volume, read_image, write_image
from volref.cli import main


def run(capsys, *words):
    status = main([str(word) for word in words])
    out, err = capsys.readouterr()
    return status, out, err


@pytest.fixture
def images(tmp_path):
    """Two opaque images whose 8-bit codes differ by 2 levels in one pixel; paths of PNG files."""
    codes = np.full((12, 14, 4), 255, np.uint8)
    codes[..., :3] = np.random.default_rng(1).integers(0, 250, (12, 14, 3))
    # 82/255 - 80/255 is more than 2/255 in float64.
    codes[5, 9, 1] = 80
    other = codes.copy()
    other[5, 9, 1] = 82
    paths = tmp_path / "a.png", tmp_path / "b.png"
    for path, array in zip(paths, (codes, other), strict=True):
        Image.fromarray(array).save(path)
    return paths


# --- compare


def test_equal_images_are_status_0_and_others_1(images, capsys):
    a, b = images
    status, out, err = run(capsys, "compare", a, a)
    assert (status, err) == (0, "")
    assert "the images are identical" in out
    assert out.endswith("same (no tolerance: any difference counts)\n")
    status, out, err = run(capsys, "compare", a, b)
    assert (status, err) == (1, "")
    assert out == f"{compare(read_image(a), read_image(b))}\ndiffers (no tolerance: any difference counts)\n"


def test_the_least_difference_counts_without_a_tolerance(tmp_path, capsys):
    image = np.full((2, 2, 4), 0.5)
    write_image(tmp_path / "a.npy", image)
    image[0, 0, 0] = np.nextafter(0.5, 1)
    write_image(tmp_path / "b.npy", image)
    assert run(capsys, "compare", tmp_path / "a.npy", tmp_path / "b.npy")[0] == 1


@pytest.mark.parametrize(("levels", "status"), [(1, 1), (2, 0), (3, 0)])
def test_a_tolerance_in_levels_of_code_values_counts_them(levels, status, images, capsys):
    found, out, _ = run(capsys, "compare", *images, "--codes", "--max", f"{levels}/255")
    assert found == status
    assert out.splitlines()[-1].endswith("an unjustified tolerance)")


def test_json_says_whether_they_are_the_same_and_that_the_tolerance_is_unjustified(images, capsys):
    status, out, err = run(capsys, "compare", *images, "--codes", "--max", "1/255", "--json")
    found = json.loads(out)
    assert (status, err, found["same"]) == (1, "", False)
    assert found["tolerance"] == {"max": 1 / 255, "justified": False}
    expected = compare(*(read_image(path, encoding="none") for path in images), encoding="srgb")
    assert {**expected.as_dict(), "same": False, "tolerance": found["tolerance"]} == {
        name: tuple(value) if isinstance(value, list) else value for name, value in found.items()
    }
    assert found["worst_pixel"] == [9, 5]
    _, out, _ = run(capsys, "compare", images[0], images[0], "--json")
    assert (json.loads(out)["same"], json.loads(out)["tolerance"]) == (True, None)


def test_the_difference_image_is_white_where_the_difference_is_largest(images, tmp_path, capsys):
    target = tmp_path / "difference.png"
    status, _, err = run(capsys, "compare", *images, "--codes", "--diff", target)
    expected = np.zeros((12, 14), np.uint8)
    expected[5, 9] = 255
    with Image.open(target) as image:
        np.testing.assert_array_equal(np.asarray(image), expected)
    assert status == 1
    assert f"white is a difference of {2 / 255:.6g}" in err
    status, out, _ = run(capsys, "compare", *images, "--diff", target, "--json")
    assert (status, out) == (
        2,
        "",
    )  # refused before the work: no document that a reader would take for a result
    status, _, _ = run(capsys, "compare", images[0], images[0], "--diff", target, "--force")
    with Image.open(target) as image:
        assert (status, image.getextrema()) == (0, (0, 0))


def test_images_of_two_sizes_are_refused(images, tmp_path, capsys):
    write_image(tmp_path / "small.png", np.zeros((3, 4, 4)))
    status, out, err = run(capsys, "compare", images[0], tmp_path / "small.png")
    assert (status, out) == (2, "")
    assert "12 x 14 x 4 and 3 x 4 x 4; render both alike" in err


def test_a_negative_tolerance_is_refused(images, capsys):
    status, _, err = run(capsys, "compare", *images, "--max", "-0.1")
    assert (status, err) == (2, "volref: --max must be at least 0, got -0.1; give a larger number\n")


# --- info and convert


@pytest.fixture
def volume_file(tmp_path):
    np.save(tmp_path / "v.npy", np.arange(30, dtype=np.uint8).reshape(2, 3, 5))
    return tmp_path / "v.npy"


def test_info_prints_what_the_library_describes(volume_file, scene_file, capsys):
    status, out, err = run(capsys, "info", volume_file, scene_file, "--json")
    assert (status, json.loads(out), err) == (0, [describe_file(volume_file), describe_file(scene_file)], "")
    status, out, err = run(capsys, "info", volume_file)
    assert (status, err) == (0, "")
    assert "\nsize          5 3 2\n" in out
    assert "\nvalue_range   0 29\n" in out


def test_info_describes_the_good_files_beside_a_bad_one(volume_file, tmp_path, capsys):
    status, out, err = run(capsys, "info", tmp_path / "none.npy", volume_file, "--json")
    assert (status, [about["file"] for about in json.loads(out)]) == (2, ["v.npy"])
    assert err.count("\n") == 1


def test_a_file_without_a_header_is_described_by_hand(tmp_path, capsys):
    raw = tmp_path / "v.raw"
    raw.write_bytes(b"head" + np.arange(24, dtype="<i2").tobytes())
    told = ("-D", "size=4,3,2", "-D", "dtype=int16", "-D", "byte_order=little", "-D", "skip=4")
    status, out, _ = run(capsys, "info", raw, *told, "-D", "spacing=1,2,0.5", "--json")
    assert (status, json.loads(out)[0]["spacing"]) == (0, [1.0, 2.0, 0.5])
    target = tmp_path / "v.npz"
    status, out, err = run(capsys, "convert", raw, target, *told, "-D", "spacing=1,2,0.5")
    assert (status, out, err) == (0, "", f"volref: wrote {target}\n")
    volume = load_volume(target)
    np.testing.assert_array_equal(volume.values, np.arange(24).reshape(2, 3, 4))
    assert volume.spacing == (1.0, 2.0, 0.5)


@pytest.mark.parametrize("key", ["path", "overwrite", "max_bytes", "nan", "layout", "sise", ""])
@pytest.mark.parametrize("verb", ["info", "convert"])
def test_a_statement_that_no_reader_knows_is_refused(verb, key, volume_file, tmp_path, capsys):
    files = [volume_file] if verb == "info" else [volume_file, tmp_path / "w.npz"]
    status, out, err = run(capsys, verb, *files, "-D", f"{key}=1")
    assert (status, out) == (2, "")
    assert err.count("\n") == 1
    assert not (tmp_path / "w.npz").exists()


@pytest.mark.parametrize("value", ["", "x", "null", "true", "1", "-1", "1,2", "NaN", "[[1]]", "{}", "1e999"])
@pytest.mark.parametrize("key", ["spacing", "origin", "direction", "centering"])
def test_a_statement_of_the_wrong_kind_is_refused(key, value, volume_file, capsys):
    status, out, err = run(capsys, "info", volume_file, "-D", f"{key}={value}")
    assert (status, out) == (2, "")
    assert err.count("\n") == 1


def test_convert_is_the_conversion_of_the_library(volume_file, tmp_path, capsys):
    target = tmp_path / "v.nrrd"
    assert run(capsys, "convert", volume_file, target, "-q") == (0, "", "")
    convert_volume(volume_file, tmp_path / "w.nrrd")
    assert target.read_bytes() == (tmp_path / "w.nrrd").read_bytes()
    assert run(capsys, "convert", volume_file, target)[0] == 2
    assert run(capsys, "convert", volume_file, target, "--force")[0] == 0


def test_convert_replaces_nan_only_when_told(tmp_path, capsys):
    np.save(tmp_path / "v.npy", np.array([[[1.0, np.nan]]]))
    assert run(capsys, "convert", tmp_path / "v.npy", tmp_path / "w.npz")[0] == 2
    assert run(capsys, "convert", tmp_path / "v.npy", tmp_path / "w.npz", "--nan", "-3")[0] == 0
    assert load_volume(tmp_path / "w.npz").values.tolist() == [[[1.0, -3.0]]]


# --- report


def test_report_names_every_package_with_its_version(capsys):
    status, out, err = run(capsys, "report", "--json")
    found = json.loads(out)
    assert (status, err) == (0, "")
    assert (found["volref"], found["packages"]["numpy"]) == (volref.__version__, np.__version__)
    assert set(found["packages"]) == {"numpy", "scipy", "pillow", "trimesh", "colour-science"}
    assert found["python"].endswith(platform.python_version())
    assert 1 <= found["cores_usable"] <= found["cores"]
    assert found["extras"]["nifti"]["nibabel"] is not None
    assert not {"all", "test", "docs"} & set(found["extras"])
    assert run(capsys, "report")[1].startswith(f"volref        {volref.__version__}\n")


def test_a_missing_extra_is_null(capsys, monkeypatch):
    real = metadata.version

    def without_tqdm(package):
        if package == "tqdm":
            raise metadata.PackageNotFoundError(package)
        return real(package)

    monkeypatch.setattr("importlib.metadata.version", without_tqdm)
    assert json.loads(run(capsys, "report", "--json")[1])["extras"]["cli"] == {"tqdm": None}


def test_a_source_tree_that_is_not_installed_still_reports(capsys, monkeypatch):
    def missing(package):
        raise metadata.PackageNotFoundError(package)

    monkeypatch.setattr("importlib.metadata.requires", missing)
    found = json.loads(run(capsys, "report", "--json")[1])
    assert (found["packages"], found["extras"]) == ({}, {})


# --- demo


@pytest.fixture
def demo_calls(monkeypatch):
    """Put a stub in place of the demo, which has tests of its own, and keep what it was called with."""
    calls = []

    def run_demo(folder, **options):
        calls.append((folder, options))
        found = {"message": "an image of a head", "files": ["d/a.png", "d/a.html"], "page": "d/a.html"}
        return {**found, "scene": "s/scene.json"}

    monkeypatch.setattr("volref.report.demo.run_demo", run_demo)
    return calls


def test_demo_says_what_it_wrote_and_what_to_open(demo_calls, capsys):
    status, out, err = run(capsys, "demo")
    assert (status, err) == (0, "")
    assert out.splitlines() == [
        "an image of a head",
        "wrote d/a.png, d/a.html",
        "open d/a.html in a browser",
        "the scene, to try the other verbs on: s/scene.json",
    ]
    assert demo_calls == [("volref-demo", {"threads": None, "progress": None, "overwrite": False})]


def test_demo_hands_its_options_on(demo_calls, capsys):
    status, out, _ = run(capsys, "demo", "-o", "there", "--size", "32x24", "-j", "2", "-f", "--json")
    assert (status, json.loads(out)["page"]) == (0, "d/a.html")
    options = {"width": 32, "height": 24, "threads": 2, "progress": None, "overwrite": True}
    assert demo_calls == [("there", options)]


def test_the_demo_itself_takes_these_options(tmp_path, capsys):
    status, out, err = run(capsys, "demo", "-o", tmp_path / "demo", "--size", "24x24", "--json")
    assert (status, err) == (0, "")
    assert all((tmp_path / "demo" / name).exists() for name in ("demo.png", "demo.html"))
    assert json.loads(out)["page"] == str(tmp_path / "demo" / "demo.html")
    assert run(capsys, "demo", "-o", tmp_path / "demo", "--size", "24x24")[0] == 2
