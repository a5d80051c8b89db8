"""Captures of WebGPU are the numbers that were written: rows, channels and half floats are sorted out."""

import numpy as np
import pytest

from tests.webgl.modules import ModuleError

# `write` puts given.bytes, rows from the top, into a texture.
READY = """
    const adapter = await navigator.gpu.requestAdapter();
    const device = await adapter.requestDevice();
    const { width, height, pixel, bytes } = given;
    const write = (texture) => device.queue.writeTexture(
        { texture }, new Uint8Array(bytes), { bytesPerRow: width * pixel }, [width, height]);
    const made = (format, more = {}) => device.createTexture({
        size: [width, height], format, usage: GPUTextureUsage.COPY_SRC | GPUTextureUsage.COPY_DST, ...more });
    const text = (number) => (Number.isFinite(number) ? number : `${number}`);
    const json = (capture) => ({ ...capture, data: Array.from(capture.data, text) });
    const onCanvas = (more = {}) => {
      const canvas = document.createElement("canvas");
      [canvas.width, canvas.height] = [width, height];
      document.body.append(canvas);
      const context = canvas.getContext("webgpu");
      const usage = GPUTextureUsage.RENDER_ATTACHMENT | GPUTextureUsage.COPY_SRC | GPUTextureUsage.COPY_DST;
      context.configure({ device, format: "bgra8unorm", usage, alphaMode: "premultiplied", ...more });
      return context;
    };
"""

TEXTURE = """
    const texture = made("{}");
    write(texture);
    return json(await v.captureWebGPU(device, texture));
"""


def given(image):
    height, width = image.shape[:2]
    pixel = image.dtype.itemsize * image.shape[2]
    return {"width": width, "height": height, "pixel": pixel, "bytes": list(image.tobytes())}


def image_of(capture, dtype=np.uint8):
    return np.array([float(n) for n in capture["data"]], dtype).reshape(
        capture["height"], capture["width"], 4
    )


def codes(height, width):
    return np.random.default_rng(7).integers(0, 256, (height, width, 4), np.uint8)


@pytest.mark.parametrize("width", [1, 7, 64, 65])  # rows of 4, 28, 256 and 260 bytes
@pytest.mark.parametrize(("name", "order"), [("rgba8unorm", [0, 1, 2, 3]), ("bgra8unorm", [2, 1, 0, 3])])
def test_bytes_come_back_in_order(page, width, name, order):
    image = codes(3, width)
    capture = page.run(READY + TEXTURE.format(name), given(image))
    np.testing.assert_array_equal(image_of(capture), image[..., order])
    assert capture["metadata"]["number_format"] == "unorm8"
    assert capture["alpha"] is None


def test_a_target_that_encodes_is_named(page):
    capture = page.run(READY + TEXTURE.format("rgba8unorm-srgb"), given(codes(2, 3)))
    np.testing.assert_array_equal(image_of(capture), codes(2, 3))
    assert capture["metadata"]["target_encoding"] == "srgb"


def test_every_half_float_is_unpacked(page):
    halves = np.arange(2**16, dtype=np.uint16).reshape(128, 128, 4)
    with np.errstate(invalid="ignore"):  # signalling NaN
        expected = halves.view(np.float16).astype(np.float32)
    capture = page.run(READY + TEXTURE.format("rgba16float"), given(halves))
    np.testing.assert_array_equal(image_of(capture, np.float32), expected)


def test_floats_come_back_exactly(page):
    floats = np.random.default_rng(3).normal(size=(5, 9, 4)).astype(np.float32)
    body = """
        const texture = made('rgba32float');
        write(texture);
        return json(await v.captureWebGPU(device, texture, { alpha: "straight" }));
    """
    capture = page.run(READY + body, given(floats))
    np.testing.assert_array_equal(image_of(capture, np.float32), floats)
    assert (capture["alpha"], capture["metadata"]["number_format"]) == ("straight", "float")


def test_a_canvas_is_captured_in_the_task_that_draws(page):
    image = codes(5, 7)
    body = """
        const context = onCanvas();
        const draw = () => write(context.getCurrentTexture());
        return json(await v.captureWebGPU(device, context, { draw, width, height }));
    """
    capture = page.run(READY + body, given(image))
    np.testing.assert_array_equal(image_of(capture), image[..., [2, 1, 0, 3]])
    assert capture["alpha"] == "premultiplied"
    assert capture["metadata"]["source"] == "webgpu canvas"


def test_a_canvas_of_a_later_task_is_refused(page):
    body = """
        const context = onCanvas();
        write(context.getCurrentTexture());
        await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
        return v.captureWebGPU(device, context);
    """
    with pytest.raises(
        ModuleError, match=r"got nothing but zeros; capture in the task that draws: pass \{draw\}"
    ):
        page.run(READY + body, given(codes(5, 7)))


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (
            "made('rgba8unorm', { usage: GPUTextureUsage.COPY_DST })",
            "must include GPUTextureUsage.COPY_SRC, got",
        ),
        ("made('r32float')", "format must be one of rgba8unorm, .*, got r32float"),
        (
            "made('rgba8unorm', { sampleCount: 4, usage: GPUTextureUsage.RENDER_ATTACHMENT })",
            "must have one sample a pixel, got 4",
        ),
        (
            "onCanvas({ usage: GPUTextureUsage.RENDER_ATTACHMENT })",
            "must include GPUTextureUsage.COPY_SRC, got",
        ),
    ],
)
def test_a_texture_that_cannot_be_copied_is_refused(page, make, sentence):
    with pytest.raises(ModuleError, match=sentence):
        page.run(READY + f"return v.captureWebGPU(device, {make});", given(codes(5, 7)))


def test_another_size_is_refused(page):
    body = "return v.captureWebGPU(device, made('rgba8unorm'), { width: 3, height: 5 });"
    with pytest.raises(ModuleError, match=r"must be 3 x 5 pixels, got 7 x 5; set canvas\.width"):
        page.run(READY + body, given(codes(5, 7)))
