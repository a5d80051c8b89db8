"""volref's ES modules: arrays as NumPy writes them, and the verdicts of Python."""

import dataclasses
import hashlib
import io
import json
import math
import re
import shutil
from types import SimpleNamespace

import numpy as np
import pytest

import volref as vr
from tests.emulation.scenes import example
from tests.webgl.modules import ModuleError
from tests.webgl.verdicts import acceptances, cases, off, write_intervals
from volref.oracle.verdict import Verdict

READ = """
    const { shape, data, type } = v.readNpy(new Uint8Array(given));
    const text = (number) => (Number.isFinite(number) ? number : `${number}`);
    const again = Array.from(v.writeNpy({ shape, data, type }));
    return { shape, type, data: Array.from(data, text), again };
"""


def npy(array, **more):
    file = io.BytesIO()
    np.save(file, array, **more)
    return list(file.getvalue())


@pytest.mark.parametrize("dtype", ["|b1", "|u1", "<i2", "<u2", "<i4", "<f4", "<f8"])
@pytest.mark.parametrize("shape", [(), (3,), (2, 3), (5, 7, 4)])
def test_arrays_go_both_ways_byte_for_byte(page, dtype, shape):
    array = (
        (np.random.default_rng(5).normal(size=shape) * 300).astype(np.float32).astype(np.int32).astype(dtype)
    )
    got = page.run(READ, npy(array))
    assert got["shape"] == list(shape)
    assert got["type"] == dtype
    np.testing.assert_array_equal(np.array(got["data"], dtype).reshape(shape), array)
    assert got["again"] == npy(array)


def test_floats_arrive_with_all_their_digits(page):
    array = np.array([0.1, -0.0, 1e-310, np.pi, 1.7976931348623157e308, np.inf, np.nan])
    got = page.run(READ, npy(array))
    np.testing.assert_array_equal([float(n) for n in got["data"]], array)
    assert got["again"] == npy(array)


@pytest.mark.parametrize(
    ("file", "sentence"),
    [
        (npy(np.zeros(3))[:-1], r"must hold 24 bytes of numbers \(3 <f8\), got 23"),
        ([*npy(np.zeros(3)), 0], "must hold 24 bytes of numbers .*, got 25"),
        (npy(np.zeros(3))[:60], "must hold its header of 118 bytes, got 50; the file is cut short"),
        (npy(np.zeros((3, 2)).T), "must be in C order, got Fortran order"),
        (npy(np.zeros(3, ">f8")), "must have numbers of type .*, got >f8"),
        (npy(np.array([None]), allow_pickle=True), r"must have numbers of type .*, got \|O"),
        (npy(np.zeros(1, [("a", "<f4")])), "must hold plain numbers, got the header"),
        ([80, 75, 3, 4] * 10, r"must be a \.npy file of version 1 or 2, got other bytes"),
        ([], r"must be a \.npy file of version 1 or 2, got other bytes"),
    ],
)
def test_a_file_that_is_no_plain_array_is_refused(page, file, sentence):
    with pytest.raises(ModuleError, match=sentence):
        page.run("return v.readNpy(new Uint8Array(given), 'a.npy');", file)


def test_an_array_that_is_not_of_its_shape_is_not_written(page):
    with pytest.raises(ModuleError, match=r"must hold 6 numbers \(2 x 3\), got 5"):
        page.run("v.writeNpy({ shape: [2, 3], data: new Float32Array(5) });")
    with pytest.raises(ModuleError, match=r"must be a typed array of type .*, got BigInt64Array"):
        page.run("v.writeNpy({ shape: [5], data: new BigInt64Array(5) });")


# What NumPy's powers and the browser's may differ by, in relative terms: a few units in the last place of
# each step from canvas to file, all else is the same arithmetic.
POWERS = 2.0**-46

CHECKED = """
    const bundle = await v.loadBundle("/files/" + given.folder);
    const judge = async ({ file, options }) => {
      const { shape, data } = v.readNpy(await (await fetch("/files/" + file)).arrayBuffer());
      const mask = options.mask?.flat();
      const verdict = v.check({ width: shape[1], height: shape[0], data }, bundle, { ...options, mask });
      const excess = Array.from(verdict.excess, (n) => (Number.isFinite(n) ? n : `${n}`));
      return JSON.parse(JSON.stringify({ ...verdict, excess }));
    };
    return Promise.all(given.cases.map(judge));
"""


def verdicts_of(page, folder, images):
    """Return the browser's verdicts on images, by the bundle in a folder that the page sees."""
    asked = []
    for number, (image, options) in enumerate(images):
        np.save(page.files / f"image_{number}.npy", np.ascontiguousarray(image))
        asked.append({"file": f"image_{number}.npy", "options": options})
    return page.run(CHECKED, {"folder": folder, "cases": asked})


def assert_same(got, verdict):
    """Compare a verdict of the browser with Python's."""
    expected = verdict.as_dict()
    del expected["metrics"]
    excess = np.array([float(number) for number in got.pop("excess")]).reshape(verdict.excess.shape)
    worst, far = got.pop("worst"), expected.pop("worst")
    assert got == expected
    np.testing.assert_allclose(excess, verdict.excess, rtol=POWERS, atol=POWERS)
    assert (worst is None) == (far is None)
    if far is not None:
        assert {k: worst[k] for k in ("x", "y", "channel")} == {k: far[k] for k in ("x", "y", "channel")}
        for one in ("value", "lo", "hi", "excess"):
            expected = far[one] and pytest.approx(far[one], rel=POWERS, abs=POWERS)
            assert worst[one] == expected


@pytest.fixture
def _without_metrics(monkeypatch):
    """Leave out of Python's verdicts what judges nothing."""
    monkeypatch.setattr(Verdict, "metrics", SimpleNamespace(as_dict=dict))


def assert_verdicts_agree(page, folder, acceptance, images):
    """Judge images in the browser and in Python; return the statuses that came up."""
    statuses = set()
    for got, (image, options) in zip(verdicts_of(page, folder, images), images, strict=True):
        asked = {**options, "mask": np.array(options["mask"])} if "mask" in options else options
        verdict = vr.check(image, acceptance, **asked)
        statuses.add(verdict.status)
        assert_same(got, verdict)
    return statuses


@pytest.mark.usefixtures("_without_metrics")
def test_verdicts_are_those_of_python_to_the_word(page):
    canvas, kinds = acceptances()
    images = cases(canvas)
    assert len(images) >= 50
    statuses = set()
    for number, (name, acceptance) in enumerate(kinds.items()):
        write_intervals(page.files / name, acceptance)
        # All of them once, then a quarter for each other kind of canvas.
        statuses |= assert_verdicts_agree(page, name, acceptance, images[number % 4 :: 4 if number else 1])
    assert statuses == {"inside", "inside only with low-quality filtering", "outside", "not comparable"}


@pytest.mark.usefixtures("_without_metrics")
def test_a_bundle_that_volref_writes_gives_the_same_verdicts(page):
    scene = dataclasses.replace(example(), width=20, height=14)
    folder = vr.write_bundle(page.files / "golden", scene, "texture3d", "swiftshader")
    bundle = vr.load_bundle(folder)
    canvas = np.rint(255 * bundle.acceptance.nominal).astype(np.uint8)
    images = [(canvas, {}), (canvas[::-1], {}), (off(canvas, 40), {}), (canvas / 255, {})]
    assert assert_verdicts_agree(page, "golden", bundle.acceptance, images) == {"inside", "outside"}
    loaded = page.run("""
        const { nominal, drawn, verified, width, height } = await v.loadBundle("/files/golden/");
        return { nominal: Array.from(nominal), drawn: Array.from(drawn), verified, width, height };
    """)
    assert (loaded["verified"], loaded["width"], loaded["height"]) == (True, 20, 14)
    np.testing.assert_array_equal(loaded["nominal"], bundle.acceptance.nominal.ravel())
    np.testing.assert_array_equal(loaded["drawn"], bundle.acceptance.drawn.ravel())


@pytest.fixture(scope="module")
def plain(page):
    """Intervals of a canvas of bytes, 13 x 11, as the page's /files/plain."""
    canvas, kinds = acceptances()
    write_intervals(page.files / "plain", kinds["bytes"])
    return canvas, kinds["bytes"]


@pytest.mark.parametrize("shape", [(22, 26), (33, 39), (13, 11), (11, 14), (22, 39), (5, 6)])
def test_an_image_of_another_size_is_refused_in_the_words_of_python(page, plain, shape):
    image = np.zeros((*shape, 4), np.uint8)
    with pytest.raises(vr.SceneError) as refused:
        vr.check(image, plain[1])
    with pytest.raises(ModuleError) as said:
        verdicts_of(page, "plain", [(image, {})])
    assert str(said.value) == str(refused.value)


def test_a_capture_without_alpha_is_judged_by_its_colours(page, plain):
    canvas, acceptance = plain
    opaque = canvas.copy()
    opaque[..., 3] = 255
    body = """
        const bundle = await v.loadBundle("/files/plain");
        const image = { width: 13, height: 11, data: new Uint8Array(given), alpha: "opaque" };
        return [v.check(image, bundle), v.check({ ...image, alpha: null }, bundle)].map((one) => one.message);
    """
    expected = [vr.check(image, acceptance).message for image in (opaque[..., :3], opaque)]
    assert page.run(body, opaque.ravel().tolist()) == expected


@pytest.mark.usefixtures("plain")
def test_a_canvas_that_the_page_takes_for_another_kind_is_told(page):
    body = """
        const bundle = await v.loadBundle("/files/plain");
        return ["premultiplied", "straight", "opaque", null].map((alpha) => v.pageWarning({ alpha }, bundle));
    """
    same, other, *unknown = page.run(body)
    assert [same, *unknown] == ["", "", ""]
    assert other.startswith(
        "the program writes premultiplied colours, and the page takes its canvas for straight"
    )


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (
            "v.check({ width: 13, height: 11, data: [1, 2] }, bundle)",
            "3 or 4 bytes or floats a pixel, got Array",
        ),
        ("v.check({ ...image, data: new Uint8Array(7) }, bundle)", "got Uint8Array of 7 numbers for 13 x 11"),
        (
            "v.check(image, bundle, { alpha: 'half' })",
            "alpha must be one of premultiplied, straight, ignored, got",
        ),
        (
            "v.check(image, bundle, { encoding: 'pq' })",
            "encoding must be one of srgb, gamma2.2, none, got 'pq'",
        ),
        (
            "v.check({ ...image, alpha: 'opaque' }, bundle, { alpha: 'straight' })",
            "must be 'ignored' for an image",
        ),
        (
            "v.check(image, bundle, { mask: [1, 0] })",
            "mask must be 13 x 11 pixels as the image, got 2 numbers",
        ),
    ],
)
@pytest.mark.usefixtures("plain")
def test_what_cannot_be_judged_is_refused(page, call, sentence):
    body = f"""
        const bundle = await v.loadBundle("/files/plain");
        const image = {{ width: 13, height: 11, data: new Uint8Array(13 * 11 * 4) }};
        return {call};
    """
    with pytest.raises(ModuleError, match=re.escape(sentence)):
        page.run(body)


def changed(**keys):
    """Return what changes keys of a bundle's manifest."""

    def change(folder):
        file = folder / "manifest.json"
        file.write_text(json.dumps(json.loads(file.read_text(encoding="utf-8")) | keys), encoding="utf-8")

    return change


def with_array(name, array):
    """Return what puts another array in a bundle, with its size and hash in order."""

    def change(folder):
        path = f"expected/{name}.npy"
        np.save(folder / path, array)
        data = (folder / path).read_bytes()
        entry = {"path": path, "bytes": len(data), "sha256": hashlib.sha256(data).hexdigest()}
        files = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))["files"]
        changed(files=[entry if file["path"] == path else file for file in files])(folder)

    return change


def with_bytes(change_bytes):
    """Return what changes the bytes of lo.npy and leaves the manifest as it is."""

    def change(folder):
        file = folder / "expected" / "lo.npy"
        file.write_bytes(change_bytes(file.read_bytes()))

    return change


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda folder: shutil.rmtree(folder), "manifest.json must be at"),
        (
            lambda folder: (folder / "manifest.json").write_text("<html>"),
            "manifest.json must be a JSON document",
        ),
        (changed(format="other"), 'format must be "volref-golden", got "other"; this is no golden bundle'),
        (changed(format_version=2), "format_version must be 1, got 2"),
        (changed(image={"width": 13.5, "height": 11}), "image must have a width and a height"),
        (changed(files=[]), "expected must name files that it lists, got expected/"),
        (changed(expected={}), "expected must name files that it lists, got undefined"),
        (with_bytes(lambda data: data[:-1]), "expected/lo.npy must have 4704 bytes, got 4703"),
        (with_bytes(lambda data: data[:-1] + b"!"), "expected/lo.npy must have SHA-256"),
        (lambda folder: (folder / "expected" / "drawn.npy").unlink(), "expected/drawn.npy must be at"),
        (
            with_array("lo", np.zeros((13, 11, 4))),
            "lo.npy must hold <f8 of shape 11,13,4, got <f8 of shape 13,11,4",
        ),
        (with_array("drawn", np.zeros((11, 13))), "drawn.npy must hold |b1 of shape 11,13, got <f8"),
        (with_array("hi", np.full((11, 13, 4), np.nan)), "hi.npy must hold numbers, got NaN"),
        (
            with_array("lo", np.full((11, 13, 4), 2.0)),
            "lo.npy must not exceed expected/hi.npy, got one that does",
        ),
    ],
)
@pytest.mark.usefixtures("plain")
def test_a_bundle_that_is_not_in_order_is_refused_in_one_sentence(page, change, sentence):
    shutil.rmtree(page.files / "damaged", ignore_errors=True)
    shutil.copytree(page.files / "plain", page.files / "damaged")
    change(page.files / "damaged")
    with pytest.raises(ModuleError, match=re.escape(sentence)):
        page.run("return v.loadBundle('/files/damaged')")


@pytest.mark.parametrize(
    "path", ["../plain/expected/lo.npy", "/files/plain/expected/lo.npy", "expected/.lo.npy"]
)
@pytest.mark.usefixtures("plain")
def test_no_path_of_a_bundle_leaves_its_folder(page, path):
    file = page.files / "plain" / "manifest.json"
    document = json.loads(file.read_text(encoding="utf-8"))
    document["expected"]["lo"] = path
    document["files"].append({"path": path, "bytes": 1, "sha256": ""})
    (page.files / "leaving").mkdir(exist_ok=True)
    (page.files / "leaving" / "manifest.json").write_text(json.dumps(document), encoding="utf-8")
    with pytest.raises(ModuleError, match=re.escape(f"must name files that it lists, got {path}")):
        page.run("return v.loadBundle('/files/leaving')")


@pytest.mark.usefixtures("plain")
def test_without_a_secure_context_hashes_are_not_compared_and_the_bundle_says_so(page):
    body = """
        Object.defineProperty(crypto, "subtle", { value: undefined, configurable: true });
        try { return (await v.loadBundle("/files/plain")).verified; } finally { delete crypto.subtle; }
    """
    assert page.run(body) is False


def test_numbers_are_written_as_python_writes_them(page):
    random = np.random.default_rng(8)
    numbers = np.concatenate(
        [
            random.normal(size=600) * 10.0 ** random.integers(-9, 12, 600),
            random.integers(-(10**7), 10**7, 300) / 16,
            random.integers(-3000, 3000, 300) / 2.0 ** random.integers(1, 12, 300),
            [0.0, -0.0, -1e-9, 0.0005, 0.0625, 0.1875, 999999.5, 9999995.0, 1e22, 1e300, 5e-324],
        ]
    )
    body = """
        const { general, percent, rounded } = await import("/web/volref-numbers.js");
        return given.map((x) => [general(x), percent(x % 1), general(rounded(x, 3))]);
    """
    written = page.run(body, numbers.tolist())
    for number, got in zip(numbers.tolist(), written, strict=True):
        assert got == [f"{number:g}", f"{math.fmod(number, 1):.1%}", f"{round(number, 3):g}"]
