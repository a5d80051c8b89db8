"""The benchmarks of the marcher measure what they say, on small scenes; no time is judged here."""

import json

from tests.benchmarks import march, scaling


def test_the_kernels_are_measured_plain_and_planned_in_both_precisions():
    figures = json.loads(json.dumps(march.measure((32,), 16, 1)))
    assert [(row["precision"], row["name"]) for row in figures["rows"]] == [
        (precision, name) for precision in ("float32", "float64") for name in ("plain", "planned")
    ]
    plain, planned = figures["rows"][:2]
    assert plain["taken"] == plain["nominal"] > planned["taken"] > 0
    assert all(row["seconds"] > 0 and row["ratio"] > 0 for row in figures["rows"])
    assert march.march_section(figures).count("| 32^3 |") == 4


def test_the_scaling_is_measured_and_plotted(tmp_path):
    figures = scaling.measure((8, 16), (1.0, 0.5), (8, 9), (1e3, 2e3), side=8, width=16, rounds=1)
    figures = json.loads(json.dumps(figures))
    assert [point["x"] for point in figures["pixels"]] == [64, 256]
    assert set(figures["threads"]) == {"one thread", "two threads", "two processes"}
    assert scaling.scaling_section(figures).count("| ") > 10
    for suffix in (".svg", ".png"):
        scaling.save_plot(figures, tmp_path / f"scaling{suffix}")
        assert (tmp_path / f"scaling{suffix}").stat().st_size > 1000
    assert scaling.slope([{"x": 1.0, "seconds": 2.0}, {"x": 4.0, "seconds": 8.0}]) == 1.0
