"""The pass criteria of well-known projects, as rules on measures, and where each was read."""

from collections.abc import Callable
from dataclasses import dataclass

from data_gen.why_intervals.measures import Measures


@dataclass(frozen=True)
class Criterion:
    """What a project asks of an image.

    name, rule
        The project, and what must hold, in words.
    source
        Repository and commit, or package, and the file.
    passes
        Whether an image of these measures passes.
    measure, rises
        The measure that decides, and whether a larger one is better.
    """

    name: str
    rule: str
    source: str
    passes: Callable[[Measures], bool]
    measure: str
    rises: bool = False


CRITERIA = (
    Criterion(
        "vispy",
        "correlation ≥ 0.9",
        "vispy/vispy@04f6ed13, vispy/testing/image_tester.py",
        lambda m: m["correlation"] >= 0.9,
        "correlation",
        rises=True,
    ),
    Criterion(
        "ANARI CTS",
        "SSIM > 0.7 and PSNR > 20 dB",
        "KhronosGroup/ANARI-SDK@1a0c067e, cts/ctsUtility.py",
        lambda m: m["ssim"] > 0.7 and m["psnr"] > 20,
        "psnr",
        rises=True,
    ),
    Criterion(
        "vtk.js",
        "pixelmatch 0.1 on < 5 % of pixels",
        "Kitware/vtk-js, Sources/Testing/testUtils.js",
        lambda m: m["mismatch_strict"] < 0.05,
        "mismatch_strict",
    ),
    Criterion(
        "Babylon.js",
        "pixelmatch 0.1 on ≤ 2.5 % of pixels",
        "BabylonJS/Babylon.js@0b582d2e, packages/tools/tests/test/visualization/visualization.utils.ts",
        lambda m: m["mismatch_strict"] <= 0.025,
        "mismatch_strict",
    ),
    Criterion(
        "dEQP",
        "fuzzyCompare ≤ 0.05",
        "KhronosGroup/VK-GL-CTS@1a78b8c3, framework/common/tcuFuzzyImageCompare.cpp",
        lambda m: m["fuzzy"] <= 0.05,
        "fuzzy",
    ),
    Criterion(
        "VTK",
        "TIGHT_VALID ≤ 0.05",
        "PyPI vtk, vtkTesting; Kitware/ParaView, Documentation/release/dev/imaging-testing-framework.md",
        lambda m: m["vtk"] <= 0.05,
        "vtk",
    ),
    Criterion(
        "three.js",
        "pixelmatch 0.1 on < 0.3 % of pixels",
        "mrdoob/three.js@bf32e00b, test/e2e/puppeteer.js",
        lambda m: m["mismatch_strict"] < 0.003,
        "mismatch_strict",
    ),
    Criterion(
        "wgpu",
        "mean FLIP ≤ 0.01",
        "gfx-rs/wgpu@03432365, tests/src/image.rs",
        lambda m: m["flip"] <= 0.01,
        "flip",
    ),
    Criterion(
        "pytest-mpl",
        "RMS ≤ 2/255",
        "PyPI pytest-mpl 0.19.0, pytest_mpl/plugin.py; matplotlib.testing.compare",
        lambda m: m["rms"] <= 2,
        "rms",
    ),
    Criterion(
        "Playwright",
        "pixelmatch 0.2 on no pixel",
        "microsoft/playwright@19dcc5bb, packages/playwright-core/src/server/utils/comparators.ts",
        lambda m: m["mismatch_playwright"] == 0,
        "mismatch_playwright",
    ),
    Criterion(
        "Blender",
        "> 0.016 on ≤ 1 % of pixels",
        "blender/blender@002f5b82, tests/python/modules/render_report.py",
        lambda m: m["above_blender"] <= 0.01,
        "above_blender",
    ),
    Criterion(
        "WebGPU CTS",
        "≤ 7/255 everywhere",
        "gpuweb/cts, src/webgpu/shader/execution/expression/call/builtin/texture_utils.ts",
        lambda m: m["max"] <= 7,
        "max",
    ),
    Criterion(
        "pygfx",
        "≤ 1/255 everywhere",
        "pygfx/pygfx@01d25d3c, examples/tests/test_examples.py",
        lambda m: m["max"] <= 1,
        "max",
    ),
    Criterion(
        "matplotlib",
        "equal bytes",
        "matplotlib.testing.decorators.image_comparison, tol=0",
        lambda m: m["max"] == 0,
        "max",
    ),
)

# Of each measure, whether a larger one is better.
RISES = {criterion.measure: criterion.rises for criterion in CRITERIA} | {"ssim": True}
