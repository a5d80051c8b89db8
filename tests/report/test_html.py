import base64
import dataclasses
import io

import numpy as np
import pytest
from PIL import Image

import volref as vr
from tests.report.pages import Page
from volref.image import encode_rgba8
from volref.report.figures import figures_of, levels
from volref.report.html import render_page
from volref.report.pictures import distance_map, error_map

HOSTILE = "</title><script>alert(1)</script><img src=x onerror=alert(2)> \"'&amp;"


@pytest.fixture(scope="module")
def scene():
    values = np.random.default_rng(3).integers(0, 200, (6, 7, 8), np.uint8)
    transfer = vr.TransferFunction([0, 200], [(0.1, 0.2, 0.9), (1, 0.5, 0)], [0, 0.3])
    camera = vr.Camera.look_at((20, 3, 2), (3, 3, 2), (0, 0, 1), 30.0, 1.0, 100.0)
    mesh = vr.Mesh([(4, 0, 0), (4, 6, 0), (4, 3, 5)], [(0, 1, 2)], colors=(0.9, 0.3, 0.1))
    return vr.Scene(vr.Volume(values), transfer, camera, 24, 16, meshes=[mesh])


@pytest.fixture(scope="module")
def out(scene):
    return vr.render(scene, method="exact", threads=1)


@pytest.fixture(scope="module")
def march(scene):
    return vr.render(scene, method="march", threads=1)


@pytest.fixture(scope="module")
def html(scene, out):
    return render_page(
        scene,
        out,
        title="A page",
        lead="What it shows.",
        figures=[("reading", "1.25 s")],
        repeat=[("Again", "volref render scene.json")],
        notice="Copyright somebody",
    )


def pixels_of(attributes):
    head, _, data = attributes["src"].partition(",")
    assert head == "data:image/png;base64"
    with Image.open(io.BytesIO(base64.b64decode(data))) as image:
        return np.asarray(image)


def test_the_page_is_well_formed_and_has_one_title_and_one_heading(html):
    page = Page(html)
    assert html.startswith("<!doctype html>")
    assert page.texts("title") == page.texts("h1") == ["A page"]
    assert page.all("html")[0][0]["lang"] == "en"
    assert len(page.all("main")) == 1


def test_headings_go_down_one_step_at_a_time(html):
    ranks = [int(tag[1]) for tag, _, _ in Page(html).elements if tag in ("h1", "h2", "h3")]
    assert ranks[0] == 1
    assert max(np.diff(ranks)) == 1


def test_the_page_needs_nothing_from_elsewhere(html):
    page = Page(html)
    for tag, attributes, _ in page.elements:
        assert tag not in ("script", "link", "iframe", "object", "base", "form")
        for name, value in attributes.items():
            assert not name.startswith("on")
            if name in ("src", "href", "srcset", "action", "poster", "data", "background"):
                assert value.startswith("data:image/png;base64,")
    for style in page.texts("style"):
        assert "url(" not in style
        assert "@import" not in style
    policies = [a["content"] for a, _ in page.all("meta") if "http-equiv" in a]
    assert policies == ["default-src 'none'; img-src data:; style-src 'unsafe-inline'"]


def test_every_picture_has_words_and_a_size(html, scene):
    pictures = [attributes for attributes, _ in Page(html).all("img")]
    assert len(pictures) == 3
    assert len({picture["alt"] for picture in pictures}) == 3
    for picture in pictures:
        assert len(picture["alt"]) > 10
        assert (int(picture["width"]), int(picture["height"])) == (scene.width, scene.height)


def test_every_label_names_something_that_is_there_once(html):
    page = Page(html)
    ids = [attributes["id"] for _, attributes, _ in page.elements if "id" in attributes]
    assert len(ids) == len(set(ids))
    labels = [attributes["aria-labelledby"] for attributes, _ in page.all("section")]
    assert set(labels) <= set(ids)


def test_what_scrolls_can_be_reached_by_keyboard(html):
    regions = [a for tag, a, _ in Page(html).elements if a.get("class") == "scroll" or tag == "pre"]
    assert all("tabindex" in a for a in regions if a.get("class") != "text")


def test_the_pictures_are_the_results_pixel_for_pixel(html, out):
    image, depth, error = (pixels_of(attributes) for attributes, _ in Page(html).all("img"))
    np.testing.assert_array_equal(image, encode_rgba8(out.rgba))
    np.testing.assert_array_equal(depth, distance_map(out.distance).colors)
    np.testing.assert_array_equal(error, error_map(out.bound).colors)


@pytest.mark.parametrize(
    ("method", "kind", "work"), [("exact", "certified", "piece"), ("march", "estimated", "sample")]
)
def test_the_numbers_on_the_page_are_the_results(scene, method, kind, work):
    out = vr.render(scene, method=method, threads=1)
    page = Page(render_page(scene, out, title="t", figures=[("reading", "1.25 s")]))
    figures = dict(zip(page.texts("dt"), page.texts("dd"), strict=True))
    assert figures == {
        f"{kind} error, largest": f"{levels(out.bound.max())} / 255",
        f"{kind} error, 99% of pixels below": f"{levels(np.quantile(out.bound, 0.99))} / 255",
        f"{kind} error, median": f"{levels(np.median(out.bound))} / 255",
        "pixels within 0.5 / 255": figures["pixels within 0.5 / 255"],
        "rendering": f"{out.seconds:.2f} s",
        "threads": "1",
        f"{work}s": f"{out.samples:,}",
        f"wall time per {work}": f"{out.seconds * 1e9 / out.samples:.0f} ns",
        "reading": "1.25 s",
    }
    share = 100 * np.count_nonzero(out.bound * 510 <= 1) / out.bound.size
    stated = float(figures["pixels within 0.5 / 255"].rstrip("%"))
    assert 0 <= share - stated < 0.1  # rounded down to a tenth of a percent


def test_an_estimate_is_called_one(scene, march):
    page = Page(render_page(scene, march, title="t"))
    text = " ".join(page.texts("section"))
    assert "An estimate, not a proven bound" in text
    assert "ertified" not in text
    assert page.texts("strong")[0].startswith("Estimated error at most")


def test_certified_is_said_with_what_it_means(html):
    page = Page(html)
    assert page.texts("strong")[0].startswith("Certified error at most")
    assert any(text.startswith("Certified means proven: no pixel is further") for text in page.texts("p"))
    assert "stimate" not in " ".join(page.texts("section"))


@pytest.mark.parametrize(
    ("kind", "words"), [("certified", "Certified error at most"), ("none", "Error unknown; rendered in")]
)
def test_the_sentence_under_the_picture_says_what_the_error_is(scene, out, kind, words):
    page = Page(render_page(scene, dataclasses.replace(out, bound_kind=kind), title="t"))
    assert page.texts("strong")[0].startswith(words)
    assert any("error, largest" in name for name in page.texts("dt")) == (kind == "certified")


@pytest.mark.parametrize("method", ["exact", "march"])
def test_each_stage_of_the_plan_is_told_with_its_reason(scene, method):
    out = vr.render(scene, method=method, threads=1)
    rows = [text for text in Page(render_page(scene, out, title="t")).texts("tr") if text]
    for stage in out.plan.stages:
        place = "in" if stage.included else "left out"
        assert f"{stage.name}{place}{stage.reason}" in rows


def test_the_exact_method_has_no_step(scene, html, march):
    told = next(text for text in Page(html).texts("p") if text.startswith("Method exact: rays are cut"))
    assert "there is no step. Stages left out: " in told
    marched = Page(render_page(scene, march, title="t"))
    told = next(text for text in marched.texts("p") if text.startswith("Method march: "))
    assert f"a sample every {march.plan.step:g} world units, at most {march.plan.most_segments}" in told
    bare = dataclasses.replace(scene, volume=None, transfer=None)
    page = Page(render_page(bare, vr.render(bare, method="exact", threads=1), title="t"))
    assert any(text.startswith("Method exact. Stages left out: volume") for text in page.texts("p"))


def test_what_was_left_out_is_named(scene):
    clear = dataclasses.replace(scene, meshes=())
    page = Page(render_page(clear, vr.render(clear, method="exact", threads=1), title="t"))
    told = next(text for text in page.texts("p") if text.startswith("Method exact"))
    assert "Stages left out: meshes," in told
    assert "No ray meets a surface." in page.texts("p")


def test_the_facts_of_the_scene_are_on_the_page(html):
    page = Page(html)
    text = " ".join(page.texts("td"))
    assert "8 x 7 x 6 voxels, uint8" in text
    assert "1 triangles, 3 vertices; colour: uniform" in text
    assert "perspective, 30.0 degrees high; at (20, 3, 2), looking along (-1, 0, 0)" in text
    assert vr.__version__ in page.texts("td")


def test_a_scene_of_meshes_only_has_a_page(scene):
    bare = dataclasses.replace(scene, volume=None, transfer=None)
    page = Page(render_page(bare, vr.render(bare, method="exact", threads=1), title="t"))
    assert "wall time per sample" not in page.texts("dt")
    assert "volume" not in page.texts("th")[-8:]


def test_text_from_outside_stays_text(scene, out):
    page = Page(
        render_page(
            scene,
            out,
            title=HOSTILE,
            lead=HOSTILE,
            alt=HOSTILE,
            unit=HOSTILE,
            figures=[(HOSTILE, HOSTILE)],
            repeat=[(HOSTILE, HOSTILE)],
            notice=HOSTILE,
        )
    )
    assert page.texts("title") == page.texts("h1") == [HOSTILE]
    assert page.texts("dd")[-1] == HOSTILE
    assert page.texts("code") == [HOSTILE]
    assert page.all("img")[0][0]["alt"] == HOSTILE
    assert page.all("script") == []
    assert len(page.all("img")) == 3


def test_figures_hold_each_number_of_the_result(out):
    figures = figures_of(out)
    ordered = sorted(out.bound.reshape(-1).tolist())
    assert figures.error_max == ordered[-1]
    # An even number of pixels: the median is the mean of the middle two.
    middle = len(ordered) // 2
    assert figures.error_median == (ordered[middle - 1] + ordered[middle]) / 2
    assert ordered[int(0.99 * (len(ordered) - 1))] <= figures.error_p99 <= figures.error_max
    assert figures.ns_per_sample == pytest.approx(1e9 * out.seconds / out.samples)
