"""Captures of volref's ES modules are the numbers that were drawn, or are refused."""

import io
import json

import numpy as np
import pytest
from PIL import Image

from tests.webgl.modules import ModuleError

WIDTH, HEIGHT = 7, 5  # odd: rows that alignment would move

# A context of `given.version` on the page, pixels drawn one by one, the first row at the top.
DRAWN = """
    const canvas = document.createElement("canvas");
    const { width, height, codes, version, attributes, scale } = given;
    [canvas.width, canvas.height] = [width, height];
    canvas.style.cssText = `display: block; width: ${width * scale}px; height: ${height * scale}px`;
    document.body.append(canvas);
    const gl = canvas.getContext(version === 2 ? "webgl2" : "webgl", attributes);
    const draw = (scaling = (code) => code / 255) => {
      gl.enable(gl.SCISSOR_TEST);
      for (let i = 0; i < width * height; i += 1) {
        gl.scissor(i % width, height - 1 - Math.floor(i / width), 1, 1);
        gl.clearColor(...codes.slice(4 * i, 4 * i + 4).map(scaling));
        gl.clear(gl.COLOR_BUFFER_BIT);
      }
      gl.disable(gl.SCISSOR_TEST);
    };
    const target = (internal, format, type) => {
      const texture = gl.createTexture();
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl[internal], width, height, 0, gl[format], gl[type] ?? type, null);
      const framebuffer = gl.createFramebuffer();
      gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
      return framebuffer;
    };
    const shown = () => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
    const text = (number) => (Number.isFinite(number) ? number : `${number}`);
    const json = (capture) => ({ ...capture, data: Array.from(capture.data, text) });
"""

CANVAS = DRAWN + "return json(v.captureCanvas(gl, { draw, ...given.options }));"
FLOATS = DRAWN + "gl.getExtension('EXT_color_buffer_float'); gl.getExtension('OES_texture_float');"


def codes():
    """Bytes without any symmetry, (HEIGHT, WIDTH, 4)."""
    return np.random.default_rng(7).integers(0, 256, (HEIGHT, WIDTH, 4), np.uint8)


def given(image=None, *, version=2, scale=1, options=None, **attributes):
    image = codes() if image is None else image
    return {
        "width": image.shape[1],
        "height": image.shape[0],
        "codes": image.ravel().tolist(),
        "version": version,
        "attributes": {"antialias": False, **attributes},
        "scale": scale,
        "options": options or {},
    }


def image_of(capture, dtype=np.uint8):
    return np.array([float(n) for n in capture["data"]], dtype).reshape(
        capture["height"], capture["width"], 4
    )


@pytest.mark.parametrize("version", [1, 2])
def test_a_canvas_is_captured_as_it_was_drawn(page, fine_page, version):
    for opened in (page, fine_page):
        for premultiplied in (True, False):
            capture = opened.run(CANVAS, given(version=version, premultipliedAlpha=premultiplied))
            np.testing.assert_array_equal(image_of(capture), codes())
            assert capture["alpha"] == ("premultiplied" if premultiplied else "straight")


def test_a_canvas_without_alpha_is_opaque(page):
    capture = page.run(CANVAS, given(alpha=False))
    np.testing.assert_array_equal(image_of(capture)[..., :3], codes()[..., :3])
    assert set(image_of(capture)[..., 3].ravel()) == {255}
    assert capture["alpha"] == "opaque"


def test_what_the_capture_depends_on_is_beside_it(page):
    about = page.run(CANVAS, given())["metadata"]
    assert "SwiftShader" in about["renderer"]
    assert (about["kind"], about["source"], about["row_0"]) == ("volref capture", "webgl2 canvas", "top")
    assert (about["width"], about["height"], about["device_pixel_ratio"]) == (WIDTH, HEIGHT, 1)
    assert (about["css_width"], about["css_height"]) == (WIDTH, HEIGHT)
    assert (about["number_format"], about["color_space"]) == ("unorm8", "srgb")
    assert about["context_attributes"]["antialias"] is False
    assert about["notes"] == []


def test_a_canvas_in_the_colour_space_of_a_wide_screen_says_so(page):
    wide = DRAWN + "gl.drawingBufferColorSpace = 'display-p3'; return json(v.captureCanvas(gl, { draw }));"
    capture = page.run(wide, given())
    assert capture["metadata"]["color_space"] == "display-p3"
    np.testing.assert_array_equal(image_of(capture), codes())


def test_a_canvas_that_the_page_scales_is_noted(page, fine_page):
    assert page.run(CANVAS, given(scale=1.5))["metadata"]["notes"][0].startswith(
        "the page shows the 7 x 5 pixels of the canvas scaled, in 10.5 x 7.5 CSS pixels of 1 device pixels"
    )
    assert fine_page.run(CANVAS, given(scale=0.5))["metadata"]["notes"] == []
    about = fine_page.run(CANVAS, given())["metadata"]
    assert about["device_pixel_ratio"] == 2
    assert "in 7 x 5 CSS pixels of 2 device pixels" in about["notes"][0]


def test_a_canvas_of_another_size_is_refused_and_a_pixel_ratio_is_recognised(page):
    with pytest.raises(
        ModuleError, match=r"must be 14 x 10 pixels, got 7 x 5; that is a pixel ratio of 0\.5, so"
    ):
        page.run(CANVAS, given(options={"width": 14, "height": 10}))
    with pytest.raises(ModuleError, match=r"must be 7 x 6 pixels, got 7 x 5; set canvas\.width"):
        page.run(CANVAS, given(options={"width": 7, "height": 6}))
    assert page.run(CANVAS, given(options={"width": 7, "height": 5}))["width"] == 7


def test_antialiasing_is_refused_unless_allowed_and_then_noted(page):
    with pytest.raises(
        ModuleError, match=r"without antialiasing, got antialias: true, .*\{antialias: false\}"
    ):
        page.run(CANVAS, given(antialias=True))
    capture = page.run(CANVAS, given(antialias=True, options={"allowAntialias": True}))
    assert "was drawn with antialias: true, which" in capture["metadata"]["notes"][0]


def test_a_canvas_that_the_browser_has_cleared_is_refused(page):
    late = DRAWN + "draw(); await shown(); return json(v.captureCanvas(gl, given.options));"
    with pytest.raises(
        ModuleError, match=r"got nothing but zeros; capture in the task that draws: pass \{draw\}"
    ):
        page.run(late, given())
    with pytest.raises(ModuleError, match="got nothing but black; capture in the task"):
        page.run(late, given(alpha=False))
    kept = page.run(late, given(preserveDrawingBuffer=True))
    np.testing.assert_array_equal(image_of(kept), codes())
    nothing = page.run(late, given(options={"allowEmpty": True}))
    assert not image_of(nothing).any()


def test_a_canvas_on_which_nothing_was_drawn_is_refused(page):
    with pytest.raises(ModuleError, match="got nothing but zeros; draw first, or pass"):
        page.run(DRAWN + "return v.captureCanvas(gl)", given(preserveDrawingBuffer=True))


def test_what_draws_later_is_refused(page):
    with pytest.raises(ModuleError, match="draw must have drawn when it returns, got a promise"):
        page.run(DRAWN + "return v.captureCanvas(gl, { draw: async () => draw() })", given())


def test_a_lost_context_is_refused(page):
    lost = "gl.getExtension('WEBGL_lose_context').loseContext(); return v.captureCanvas(gl);"
    with pytest.raises(ModuleError, match="the context must be there, got one that is lost"):
        page.run(DRAWN + lost, given())


def test_an_error_that_the_program_left_is_noted(page):
    capture = page.run(DRAWN + "draw(); gl.enable(1); return json(v.captureCanvas(gl));", given())
    assert capture["metadata"]["notes"] == ["the program had left GL error 0x500 before the capture"]


def test_the_state_of_the_context_neither_matters_nor_changes(page):
    disturbed = """
        draw();
        const other = target("RGBA8", "RGBA", "UNSIGNED_BYTE");
        const before = { PACK_ALIGNMENT: 8, PACK_ROW_LENGTH: 20, PACK_SKIP_ROWS: 2, PACK_SKIP_PIXELS: 1 };
        for (const [name, value] of Object.entries(before)) gl.pixelStorei(gl[name], value);
        const buffer = gl.createBuffer();
        gl.bindBuffer(gl.PIXEL_PACK_BUFFER, buffer);
        gl.readBuffer(gl.NONE);
        const capture = json(v.captureCanvas(gl));
        return { capture, same: [
            gl.getParameter(gl.FRAMEBUFFER_BINDING) === other,
            gl.getParameter(gl.READ_FRAMEBUFFER_BINDING) === other,
            gl.getParameter(gl.PIXEL_PACK_BUFFER_BINDING) === buffer,
            gl.getParameter(gl.READ_BUFFER) === gl.NONE,
            ...Object.entries(before).map(([name, value]) => gl.getParameter(gl[name]) === value),
            gl.getError() === gl.NO_ERROR] };
    """
    answer = page.run(DRAWN + disturbed, given())
    np.testing.assert_array_equal(image_of(answer["capture"]), codes())
    assert all(answer["same"])


def test_a_float_target_is_captured_exactly(page, fine_page):
    floats = np.random.default_rng(1).normal(size=(HEIGHT, WIDTH, 4)).astype(np.float32)
    for opened in (page, fine_page):
        for version, kind in ((1, "RGBA"), (2, "RGBA32F")):
            body = f"""
                const framebuffer = target("{kind}", "RGBA", "FLOAT");
                draw((number) => number);
                gl.bindFramebuffer(gl.FRAMEBUFFER, null);
                return json(v.captureTarget(gl, framebuffer, {{ width, height, alpha: "premultiplied" }}));
            """
            capture = opened.run(FLOATS + body, given(floats, version=version))
            np.testing.assert_array_equal(image_of(capture, np.float32), floats)
            about = capture["metadata"]
            assert (about["number_format"], capture["alpha"]) == ("float", "premultiplied")
            assert about["source"] == ("webgl framebuffer" if version == 1 else "webgl2 framebuffer")


def test_infinities_and_nan_of_a_float_target_are_captured(page):
    body = """
        const framebuffer = target("RGBA32F", "RGBA", "FLOAT");
        gl.clearBufferfv(gl.COLOR, 0, [Infinity, -Infinity, NaN, 0.1]);
        return json(v.captureTarget(gl, framebuffer, { width, height }));
    """
    capture = page.run(FLOATS + body, given())
    np.testing.assert_array_equal(
        image_of(capture, np.float32)[0, 0], np.float32([np.inf, -np.inf, np.nan, 0.1])
    )
    assert capture["alpha"] is None


def test_half_and_byte_targets_are_captured_exactly(page):
    cases = {
        ("RGBA16F", "HALF_FLOAT"): ("half", "none", np.float32(np.float16(codes() / 255))),
        ("RGBA8", "UNSIGNED_BYTE"): ("unorm8", "none", codes()),
        ("SRGB8_ALPHA8", "UNSIGNED_BYTE"): ("unorm8", "srgb", None),
    }
    for (internal, kind), (form, encoding, expected) in cases.items():
        body = f"""
            const framebuffer = target("{internal}", "RGBA", "{kind}");
            draw();
            return json(v.captureTarget(gl, framebuffer, {{ width, height }}));
        """
        capture = page.run(FLOATS + body, given())
        about = capture["metadata"]
        assert (about["number_format"], about["target_encoding"]) == (form, encoding)
        if expected is not None:
            np.testing.assert_array_equal(image_of(capture, expected.dtype), expected)


def test_one_of_several_attachments_is_captured(page):
    body = """
        const framebuffer = target("RGBA8", "RGBA", "UNSIGNED_BYTE");
        const second = gl.createTexture();
        gl.bindTexture(gl.TEXTURE_2D, second);
        gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA8, width, height);
        gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT1, gl.TEXTURE_2D, second, 0);
        gl.drawBuffers([gl.NONE, gl.COLOR_ATTACHMENT1]);
        draw();
        const size = { width, height };
        return [0, 1].map((attachment) => json(v.captureTarget(gl, framebuffer, { ...size, attachment })));
    """
    first, second = page.run(DRAWN + body, given())
    assert not image_of(first).any()
    np.testing.assert_array_equal(image_of(second), codes())


@pytest.mark.parametrize(
    ("make", "size", "sentence"),
    [
        ("target('RGBA8', 'RGBA', 'UNSIGNED_BYTE')", (7, 4), "those of the attachment, got 7 x 4; give the"),
        ("target('RGBA8', 'RGBA', 'UNSIGNED_BYTE')", (8, 5), "those of the attachment, got 8 x 5"),
        ("target('RGBA8', 'RGBA', 'UNSIGNED_BYTE')", (0, 0), "those of the attachment, got 0 x 0"),
        ("target('RGBA32F', 'RGBA', 'FLOAT')", (6, 5), "those of the attachment, got 6 x 5"),
        ("target('RGB10_A2', 'RGBA', 'UNSIGNED_INT_2_10_10_10_REV')", (7, 5), "8-bit numbers in 0..1, got"),
        (
            "target('RGBA8UI', 'RGBA_INTEGER', 'UNSIGNED_BYTE')",
            (7, 5),
            "floats or 8-bit numbers in 0..1, got",
        ),
        ("gl.createFramebuffer()", (7, 5), "the framebuffer must be complete, got status"),
        ("many()", (7, 5), "one sample a pixel, got a multisampled one"),
    ],
)
def test_a_target_that_cannot_be_read_as_it_is_is_refused(page, make, size, sentence):
    body = f"""
        const many = () => {{
          const buffer = gl.createRenderbuffer(), framebuffer = gl.createFramebuffer();
          gl.bindRenderbuffer(gl.RENDERBUFFER, buffer);
          gl.renderbufferStorageMultisample(gl.RENDERBUFFER, 4, gl.RGBA8, width, height);
          gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
          gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.RENDERBUFFER, buffer);
          gl.bindFramebuffer(gl.FRAMEBUFFER, null);
          return framebuffer;
        }};
        const framebuffer = {make};
        return v.captureTarget(gl, framebuffer, {{ width: {size[0]}, height: {size[1]} }});
    """
    with pytest.raises(ModuleError, match=sentence):
        page.run(FLOATS + body, given())


def test_a_capture_is_posted_as_files_that_python_reads(page):
    body = """
        const capture = v.captureCanvas(gl, { draw });
        await v.saveNpy(capture, "frame", { url: "/files" });
        await v.savePng(capture, "frame", { url: "/files/" });
        await v.saveMetadata(capture, "frame", { url: "/files" });
    """
    page.run(DRAWN + body, given())
    np.testing.assert_array_equal(np.load(page.files / "frame.npy"), codes())
    with Image.open(page.files / "frame.png") as picture:
        assert picture.mode == "RGBA"
        assert picture.info == {}  # no colour profile, no gamma
        np.testing.assert_array_equal(np.asarray(picture), codes())
    about = json.loads((page.files / "frame.json").read_text(encoding="utf-8"))
    assert about["alpha"] == "premultiplied"


def test_a_capture_is_downloaded_under_its_name(page):
    body = """
        const clicked = [];
        const usual = HTMLAnchorElement.prototype.click;
        HTMLAnchorElement.prototype.click = function () { clicked.push([this.download, this.href]); };
        try {
          const capture = v.captureCanvas(gl, { draw });
          await v.saveNpy(capture, "a frame");
          const bytes = new Uint8Array(await (await fetch(clicked[0][1])).arrayBuffer());
          return [clicked[0][0], Array.from(bytes)];
        } finally { HTMLAnchorElement.prototype.click = usual; }
    """
    name, data = page.run(DRAWN + body, given())
    assert name == "a frame.npy"
    np.testing.assert_array_equal(np.load(io.BytesIO(bytes(data))), codes())


@pytest.mark.parametrize(
    ("url", "got"),
    [
        ("/elsewhere", "/elsewhere/frame.png must take the file, got 404"),
        ("http://127.0.0.1:9", "got Failed to fetch"),
    ],
)
def test_a_post_that_is_not_taken_is_said(page, url, got):
    body = f"await v.savePng(v.captureCanvas(gl, {{ draw }}), 'frame', {{ url: '{url}' }});"
    with pytest.raises(ModuleError, match=got):
        page.run(DRAWN + body, given())


def test_the_browsers_own_png_loses_what_the_modules_keep(page):
    faint = np.zeros((1, 3, 4), np.uint8)
    faint[0] = [(3, 1, 2, 4), (9, 5, 2, 11), (200, 3, 30, 40)]  # the last: colour above alpha
    body = """
        const blob = new Promise((done) => { draw(); canvas.toBlob(done); });
        return Array.from(new Uint8Array(await (await blob).arrayBuffer()));
    """
    with Image.open(io.BytesIO(bytes(page.run(DRAWN + body, given(faint))))) as picture:
        straight = np.asarray(picture).astype(float)
    again = np.rint(straight[..., :3] * straight[..., 3:] / 255)
    assert (again != faint[..., :3]).any()
    np.testing.assert_array_equal(image_of(page.run(CANVAS, given(faint))), faint)
