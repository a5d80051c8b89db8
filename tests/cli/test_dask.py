"""`volref render --dask`: workers do it, and what is wrong with their address is said in one line."""

import builtins
import json
import os
import signal
import subprocess
import sys

import numpy as np
import pytest
from distributed import KilledWorker, LocalCluster

import volref
from tests.scenes import rough_scene
from volref.cli import main


def run(capsys, *words):
    status = main([str(word) for word in words])
    out, err = capsys.readouterr()
    return status, out, err


def render(capsys, scene_file, tmp_path, address, *more):
    return run(capsys, "render", scene_file, "-o", tmp_path / "image.npy", "--dask", address, *more)


def test_workers_of_this_machine_render_the_image(scene_file, tmp_path, capsys):
    status, out, err = render(capsys, scene_file, tmp_path, "local:2", "--json")
    expected = volref.render(volref.load_scene(scene_file))
    np.testing.assert_array_equal(np.load(tmp_path / "image.npy"), expected.rgba)
    assert (status, json.loads(out)["samples"]) == (0, expected.samples)
    assert json.loads(out)["threads"] in (1, 2)
    assert err.count("\n") == 1


@pytest.mark.slow
def test_workers_of_a_scheduler_render_the_image(scene_file, tmp_path, capsys):
    with LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=":0") as cluster:
        status, _, err = render(capsys, scene_file, tmp_path, cluster.scheduler_address)
        # Whose cluster it is goes on with it.
        assert [worker.name for worker in cluster.scheduler.workers.values()] == [0]
    expected = volref.render(volref.load_scene(scene_file))
    np.testing.assert_array_equal(np.load(tmp_path / "image.npy"), expected.rgba)
    assert (status, err.count("\n")) == (0, 1)


@pytest.mark.parametrize(
    ("address", "message"),
    [
        ("local:", "must have a number of workers from 1 to 1024, got ''; write for instance local:4"),
        ("local:0", "must have a number of workers from 1"),
        ("local:many", "got 'many'"),
        ("somewhere", "must name a scheduler that answers, got 'somewhere' (missing port"),
        ("ftp://somewhere:21", "(unknown address scheme 'ftp'"),
        (
            "tcp://127.0.0.1:9",
            "got 'tcp://127.0.0.1:9' (Connection refused); start one with 'dask scheduler'",
        ),
    ],
)
def test_an_address_that_is_none_is_refused_in_one_line(address, message, scene_file, tmp_path, capsys):
    status, out, err = render(capsys, scene_file, tmp_path, address)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert message in err
    assert not (tmp_path / "image.npy").exists()


def test_without_dask_the_command_that_installs_it_is_said(scene_file, tmp_path, capsys, monkeypatch):
    imported = builtins.__import__

    def without(name, *words):
        if name == "distributed":
            raise ModuleNotFoundError(name=name)
        return imported(name, *words)

    monkeypatch.setattr(builtins, "__import__", without)
    assert render(capsys, scene_file, tmp_path, "local") == (
        2,
        "",
        "volref: distributed must be installed to use --dask, got no module 'distributed'; "
        "run: pip install 'volref[distributed]'\n",
    )


def test_workers_that_die_of_a_task_are_told_in_one_line(scene_file, tmp_path, capsys, monkeypatch):
    def die(*_, **__):
        raise KilledWorker("a task", "the last of four", 3)

    monkeypatch.setattr("volref.render", die)
    status, out, err = render(capsys, scene_file, tmp_path, "local:1")
    assert (status, out) == (2, "")
    assert err == (
        "volref: --dask workers must outlive their tasks, got 4 that died of the same one; "
        "give each more memory, or start fewer on a machine\n"
    )


@pytest.mark.slow
def test_ctrl_c_ends_in_one_line_and_leaves_neither_file_nor_process(tmp_path):
    volref.save_scene(rough_scene(256, 192), tmp_path / "scene.json")
    before = sorted(tmp_path.iterdir())
    program = (
        "import sys, volref.cli, volref.cli.render as verb\n"
        "from contextlib import contextmanager\n"
        "@contextmanager\n"
        "def progress(*_, **__):\n"
        "    yield lambda done, total: print(done, flush=True)\n"
        "verb.progress = progress\n"
        "sys.exit(volref.cli.main())\n"
    )
    words = ["render", "scene.json", "-o", "image.npy", "--tolerance", "1e-9", "--dask", "local:2"]
    process = subprocess.Popen(
        [sys.executable, "-c", program, *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=tmp_path,
        env={**os.environ, "TMPDIR": str(tmp_path)},
        start_new_session=True,
    )
    assert process.stdout.readline() == "1\n"
    os.killpg(process.pid, signal.SIGINT)  # to workers too, as a terminal does
    _, err = process.communicate()  # returns once no process has the streams any more
    assert (process.returncode, err) == (130, "volref: interrupted; no file was left half written\n")
    assert sorted(path for path in tmp_path.iterdir() if not path.name.startswith("dask-")) == before
