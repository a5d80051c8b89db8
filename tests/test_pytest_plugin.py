"""The plugin for pytest, in runs of pytest of its own."""

import json
import shutil
from xml.etree import ElementTree

import numpy as np
import pytest

import volref as vr
from tests.emulation.scenes import example
from tests.golden.bundles import narrow, written
from tests.test_import import loaded_after
from volref.golden import checking, writing
from volref.golden.keeping import subject_of
from volref.report.judging import write_judging
from volref.report.verdict_images import verdict_images
from volref.report.verdicts.cases import Case

pytest_plugins = "pytester"

TEST = """
import numpy as np

def test_frame(volref_golden):
    volref_golden(
        np.load("frame.npy"), "frame", scene="scene.json", pipeline="texture3d", device="swiftshader"
    )
"""


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    """A scene as a file, what a correct machine draws of it, and its golden."""
    folder = tmp_path_factory.mktemp("drawn")
    subject = subject_of(example(), "texture3d", "swiftshader")
    vr.save_scene(subject.scene, folder / "scene.json")
    image = vr.emulate(subject.scene, "texture3d", "swiftshader").rgba8
    np.save(folder / "frame.npy", image)
    bundle = vr.load_bundle(written(folder / "goldens" / "frame", subject))
    # What a run inside this one imports is forgotten when it ends; so all of it is imported here.
    verdict = vr.check(image[::-1], bundle.acceptance)
    verdict.as_dict()
    verdict_images(bundle.acceptance, verdict)
    write_judging(folder / "page.html", [Case("preloaded", bundle.acceptance, verdict)])
    (folder / "page.html").unlink()
    return folder


@pytest.fixture(autouse=True)
def _narrow_intervals(monkeypatch):
    """Take intervals that cost next to nothing: the plugin does not care."""
    monkeypatch.setattr(writing, "accept", narrow)


@pytest.fixture
def suite(pytester, drawn):
    """A folder with a test, its scene and its image, and no golden yet."""
    for file in drawn.glob("*.*"):
        shutil.copy(file, pytester.path)
    pytester.makepyfile(TEST)
    return pytester


@pytest.fixture
def kept(suite, drawn):
    """The same with the golden."""
    shutil.copytree(drawn / "goldens", suite.path / "goldens")
    return suite


def spoil(folder):
    """Put the image upside down."""
    np.save(folder / "frame.npy", np.load(folder / "frame.npy")[::-1])


def files_of(folder):
    return {file.relative_to(folder).as_posix(): file.read_bytes() for file in folder.rglob("*.*")}


def test_an_image_inside_passes(kept):
    kept.runpytest_inprocess().assert_outcomes(passed=1)


def test_an_image_outside_fails_with_the_verdict_and_without_a_traceback(kept):
    spoil(kept.path)
    result = kept.runpytest_inprocess("-rN")
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["frame: outside: * drawn pixels lie outside; the worst is pixel *"])
    result.stdout.fnmatch_lines(["*The image seems to be upside down: read so, every pixel lies inside.*"])
    result.stdout.no_fnmatch_line("*Traceback*")
    result.stdout.no_fnmatch_line("*pytest_plugin.py*")


def test_images_of_a_failure_are_written_and_named(kept):
    spoil(kept.path)
    result = kept.runpytest_inprocess("--basetemp", str(kept.path / "temporary"))
    result.stdout.fnmatch_lines(["images: *"])
    # Where CI is set, pytest's summary tells it once more.
    [line] = {line for line in result.outlines if line.startswith("images: ")}
    names = {"candidate.png", "nominal.png", "difference.png", "overlay.png", "candidate.npy", "verdict.json"}
    written = files_of(kept.path / "temporary")
    assert {name.rsplit("/")[-1] for name in written} == names
    assert line.removeprefix("images: ").startswith(str(kept.path / "temporary"))
    verdict = json.loads(next(text for name, text in written.items() if name.endswith(".json")))
    assert verdict["status"] == "outside"


def test_a_missing_golden_fails_and_nothing_is_written(suite):
    before = files_of(suite.path)
    result = suite.runpytest_inprocess("-p", "no:cacheprovider")
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(
        ["*goldens/frame must be a golden bundle, got none; make it with pytest --volref-update *"]
    )
    assert {name: data for name, data in files_of(suite.path).items() if "pycache" not in name} == before


def test_update_makes_the_golden_that_passes_from_then_on(suite):
    result = suite.runpytest_inprocess("--volref-update")
    result.assert_outcomes(passed=1)
    result.stdout.fnmatch_lines(["made *goldens/frame: look at *preview.png, then commit the folder"])
    before = files_of(suite.path / "goldens")
    assert "frame/manifest.json" in before
    suite.runpytest_inprocess().assert_outcomes(passed=1)
    again = suite.runpytest_inprocess("--volref-update")
    again.stdout.no_fnmatch_line("*made *")
    assert files_of(suite.path / "goldens") == before


def test_update_does_not_make_a_wrong_image_right(suite):
    spoil(suite.path)
    result = suite.runpytest_inprocess("--volref-update")
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["frame: outside: *"])


@pytest.mark.parametrize(
    ("before", "after", "word"),
    [
        ('"texture3d"', '"x3dom"', "pipeline"),
        ('"swiftshader"', '"llvmpipe"', "device"),
        ('"scene.json"', '"other.json"', "scene"),
    ],
)
def test_a_golden_of_something_else_fails_until_it_is_updated(kept, before, after, word):
    changed = example(opacity=0.4)
    vr.save_scene(changed, kept.path / "other.json")
    kept.makepyfile(TEST.replace(before, after))
    result = kept.runpytest_inprocess()
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines([f"*must be a golden of what the test draws, got one of another {word};*"])
    result.stdout.no_fnmatch_line("*During handling*")
    scene = changed if word == "scene" else example()
    pipeline = "x3dom" if word == "pipeline" else "texture3d"
    device = "llvmpipe" if word == "device" else "swiftshader"
    np.save(kept.path / "frame.npy", vr.emulate(scene, pipeline, device).rgba8)
    kept.runpytest_inprocess("--volref-update").assert_outcomes(passed=1)
    kept.runpytest_inprocess().assert_outcomes(passed=1)


def test_a_golden_alone_is_enough(kept):
    kept.makepyfile("def test_frame(volref_golden):\n    volref_golden('frame.npy', 'frame')")
    kept.runpytest_inprocess().assert_outcomes(passed=1)


def test_an_interrupted_update_leaves_no_half_golden(suite, monkeypatch):
    def stopped(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(writing, "accept", stopped)
    with pytest.raises(KeyboardInterrupt):
        suite.runpytest_inprocess("--volref-update")
    assert list((suite.path / "goldens").rglob("*")) == []


def test_a_damaged_golden_fails_in_a_sentence(kept):
    (kept.path / "goldens" / "frame" / "expected" / "lo.npy").write_bytes(b"?")
    result = kept.runpytest_inprocess()
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["expected/lo.npy must be the file that the manifest lists, got 1 bytes *"])


def test_the_report_has_all_verdicts_and_the_images_of_what_failed(kept):
    kept.makepyfile(TEST + TEST.replace("test_frame", "test_flipped").replace('npy")', 'npy")[::-1]'))
    result = kept.runpytest_inprocess("--volref-report", "out")
    result.assert_outcomes(passed=1, failed=1)
    result.stdout.fnmatch_lines(["page of verdicts: out/index.html"])
    page = (kept.path / "out" / "index.html").read_text(encoding="utf-8")
    assert "test_flipped" in page
    assert "test_frame" in page
    folders = [file.parent for file in (kept.path / "out").rglob("overlay.png")]
    assert len(folders) == 1
    assert "test_flipped" in str(folders[0])


def test_junit_is_told_the_verdict(kept):
    spoil(kept.path)
    kept.runpytest_inprocess("--junitxml", "junit.xml")
    found = ElementTree.parse(kept.path / "junit.xml").iter("property")
    properties = {one.get("name"): one.get("value") for one in found}
    assert properties["volref_golden"] == "frame"
    assert properties["volref_status"] == "outside"
    assert int(properties["volref_outside"]) > 0
    assert properties["volref_worst"].startswith("pixel (")


def test_goldens_lie_where_the_setting_says(kept):
    (kept.path / "goldens").rename(kept.path / "expected_images")
    kept.makeini("[pytest]\nvolref_goldens = expected_images")
    kept.runpytest_inprocess().assert_outcomes(passed=1)


def test_a_golden_has_the_name_of_its_test_by_default(kept):
    goldens = kept.path / "goldens"
    shutil.copytree(goldens / "frame", goldens / "test_views-1-a-b")
    kept.makepyfile("""
        import pytest

        @pytest.mark.parametrize(("x", "y"), [(1, "a/b")])
        def test_views(volref_golden, x, y):
            volref_golden("frame.npy")
    """)
    kept.runpytest_inprocess().assert_outcomes(passed=1)


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        ("(image); volref_golden(image)", "must be used once in a test, got 'test_frame' again; give each"),
        ("(image, '../frame')", "must be of letters, digits, '.', '_' and '-', got '../frame'; rename it"),
        ("(image, 'frame', tolerance=0.1)", "must be told of scene, pipeline, *, got 'tolerance'; leave it"),
        ("(image, 'frame', scene='scene.json')", "scene, pipeline and device together, got no pipeline; add"),
        ("(image, 'frame', jitter=None)", "scene, pipeline and device together, got no scene; add"),
        ("(image[:5], 'frame')", "candidate must be 16 x 12 pixels as the scene, got 16 x 5; draw the scene"),
        ("('nothing.npy', 'frame')", "nothing.npy must be a file that exists, got no such file"),
        ("(image, 'frame', alpha='half')", "alpha must be 'premultiplied' or 'straight' or 'ignored', got"),
    ],
)
def test_bad_use_fails_in_one_sentence(kept, call, sentence):
    shutil.copytree(kept.path / "goldens" / "frame", kept.path / "goldens" / "test_frame")
    kept.makepyfile(f"""
        import numpy as np

        def test_frame(volref_golden):
            image = np.load("frame.npy")
            volref_golden{call}
    """)
    result = kept.runpytest_inprocess()
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines([f"*{sentence}*"])
    result.stdout.no_fnmatch_line("*Traceback*")


def test_what_only_low_quality_filters_explain_passes_with_a_warning(kept, monkeypatch):
    golden = vr.load_bundle(kept.path / "goldens" / "frame").acceptance
    coarse = vr.check(np.load(kept.path / "frame.npy"), golden)
    object.__setattr__(coarse, "status", "inside only with low-quality filtering")
    monkeypatch.setattr(checking, "check_bundle", lambda *_, **__: coarse)
    result = kept.runpytest_inprocess("-W", "default")
    result.assert_outcomes(passed=1, warnings=1)


def test_neither_the_plugin_nor_its_options_load_numpy():
    loaded = loaded_after("import volref.pytest_plugin")
    assert "volref.pytest_plugin" in loaded
    assert "numpy" not in loaded


def test_pytest_finds_the_plugin_by_itself(pytester):
    pytester.runpytest_inprocess("--help").stdout.fnmatch_lines(["*--volref-update*"])
