"""`render(executor=...)`: the same image from threads, processes and Dask workers, some of which die."""

import dataclasses
import logging
import multiprocessing
import os
import pickle
import signal
import tempfile
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from distributed import Client, LocalCluster

import volref as vr
from tests.scenes import camera_towards, colorful_transfer, rough_scene, rough_volume
from volref.io import references
from volref.phantoms.meshes import sphere_mesh
from volref.scene.footprint import Rectangle
from volref.truth import crew, rendering
from volref.truth.choosing import Choice
from volref.truth.parts import tiles

METHODS = {
    "march": {"method": "march", "step": 0.05},
    "exact": {"method": "exact", "tolerance": 1e-6},
}


def scene_of(width=72, height=48, *, mesh):
    """A background, a volume in memory, and a ball in it; 9 tiles."""
    scene = rough_scene(width, height, background=(0.1, 0.2, 0.3, 0.5))
    ball = sphere_mesh(1.5, scene.volume.corners.mean(axis=0), colors=(0.9, 0.4, 0.1))
    return dataclasses.replace(scene, meshes=[ball] if mesh else [])


SCENES = {"with a mesh": scene_of(mesh=True), "without": scene_of(mesh=False)}


@pytest.fixture(scope="module")
def expected():
    """What one thread draws."""
    return {
        (name, method): vr.render(scene, threads=1, **words)
        for name, scene in SCENES.items()
        for method, words in METHODS.items()
    }


def assert_same(out, expected):
    for name in ("rgba", "bound", "distance"):
        assert getattr(out, name).tobytes() == getattr(expected, name).tobytes(), name
    assert out.samples == expected.samples
    assert (out.bound_kind, out.plan.as_dict()) == (expected.bound_kind, expected.plan.as_dict())


@pytest.fixture(autouse=True)
def many_tasks(monkeypatch):
    """As small as tasks get, so that these images have some for everybody."""
    monkeypatch.setattr(crew, "LEAST_RUN", 500)


@pytest.fixture(autouse=True)
def temporary(monkeypatch, tmp_path_factory):
    """A folder for temporary files, in which nothing may be left."""
    folder = tmp_path_factory.mktemp("temporary")
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    yield folder
    assert list(folder.glob("volref-*")) == []


def processes(count):
    """Processes that begin from nothing: forked ones would begin in the middle of our threads."""
    return ProcessPoolExecutor(count, mp_context=multiprocessing.get_context("spawn"))


@pytest.fixture(scope="module")
def pool():
    with processes(2) as executor:
        yield executor


@contextmanager
def dask(workers, threads=1):
    """A Dask client with worker processes of its own; port 0 is any that is free."""
    quiet = {"dashboard_address": ":0", "silence_logs": logging.CRITICAL}
    with (
        LocalCluster(n_workers=workers, threads_per_worker=threads, processes=True, **quiet) as cluster,
        Client(cluster) as connected,
    ):
        yield connected


@pytest.fixture(scope="module")
def client():
    with dask(2) as connected:
        yield connected


def drawn_everywhere(executor, expected, **more):
    for (name, method), out in expected.items():
        assert_same(vr.render(SCENES[name], executor=executor, **METHODS[method], **more), out)


def test_threads_of_ours_and_of_the_user_draw_the_same(expected):
    for threads in (2, 3):
        drawn_everywhere(None, expected, threads=threads)
    for threads in (1, 3):
        with ThreadPoolExecutor(threads) as pool:
            drawn_everywhere(pool, expected)


def test_two_processes_draw_the_same(expected, pool):
    drawn_everywhere(pool, expected)


@pytest.mark.slow
def test_one_process_draws_the_same(expected):
    with processes(1) as one:
        drawn_everywhere(one, expected)
        assert vr.render(SCENES["without"], executor=one).threads == 1


def test_two_dask_workers_draw_the_same(expected, client):
    drawn_everywhere(client.get_executor(), expected)


@pytest.mark.slow
@pytest.mark.parametrize(("workers", "threads"), [(1, 1), (4, 1), (1, 3)])
def test_any_number_of_dask_workers_and_of_their_threads_draws_the_same(expected, workers, threads):
    with dask(workers, threads) as client:
        drawn_everywhere(client.get_executor(), expected)


@pytest.mark.parametrize("suffix", [".npy", ".npz", ".nrrd", ".nii.gz"])
def test_a_volume_from_a_file_is_read_from_there(expected, pool, tmp_path, monkeypatch, suffix):
    scene = SCENES["without"]
    path = tmp_path / f"volume{suffix}"
    vr.save_volume(scene.volume, path)

    def never(*_, **__):
        raise AssertionError("written")

    monkeypatch.setattr(tempfile, "TemporaryDirectory", never)
    volume = vr.load_volume(path)
    loaded = vr.Scene(
        volume, scene.transfer, scene.camera, scene.width, scene.height, background=scene.background
    )
    for method, words in METHODS.items():
        out = vr.render(loaded, executor=pool, **words)
        assert_same(out, vr.render(loaded, threads=1, **words))
        if suffix in (".npy", ".npz"):  # others turn the volume, or round its place
            assert out.rgba.tobytes() == expected["without", method].rgba.tobytes()


class Elsewhere(Executor):
    """Another process, played in this one: what goes in and out is pickled, and work is done at once."""

    def __init__(self, first=lambda: None):
        self.first, self.sent = first, []

    def submit(self, function, *words):
        self.sent.append(pickle.dumps((function, words)))
        future = Future()
        future.set_running_or_notify_cancel()
        try:
            function, words = pickle.loads(self.sent[-1])
            future.set_result(pickle.loads(pickle.dumps(function(*words))))
        except vr.FormatError as error:
            future.set_exception(error)
        if len(self.sent) == 1:
            self.first()
        return future


def test_what_is_pickled_draws_the_same(expected):
    drawn_everywhere(Elsewhere(), expected)


@pytest.mark.parametrize("method", METHODS)
def test_a_volume_is_not_sent_and_is_read_once(monkeypatch, method):
    volume = rough_volume(shape=(40, 40, 40))
    scene = vr.Scene(volume, colorful_transfer(), camera_towards(volume), 48, 32)
    opened, read = [], references.read_again
    monkeypatch.setattr(references, "read_again", lambda *words: opened.append(words) or read(*words))
    desk = Elsewhere()
    vr.render(scene, executor=desk, method=method)
    assert (len(opened), len(desk.sent) > 1) == (1, True)
    assert max(map(len, desk.sent)) < volume.values.nbytes / 10


def test_a_plan_goes_along_as_it_is():
    desk, scene = Elsewhere(), SCENES["with a mesh"]
    plans = [vr.plan(scene, **words) for words in METHODS.values()]
    plans += [plan.everything() for plan in plans]
    plans.append(dataclasses.replace(plans[0], step=0.11, termination=1e-3))
    for plan in plans:
        assert_same(vr.render(scene, plan=plan, executor=desk), vr.render(scene, plan=plan, threads=1))


def test_a_long_table_goes_through_a_file():
    values = np.linspace(0, 1, 30_000)
    transfer = vr.TransferFunction(values, np.random.default_rng(0).random((30_000, 3)), values)
    scene, desk = rough_scene(16, 8, transfer=transfer), Elsewhere()
    assert_same(vr.render(scene, method="march", executor=desk), vr.render(scene, method="march"))
    assert max(map(len, desk.sent)) < values.nbytes / 10


@pytest.mark.parametrize("cheaper", ["exact", "march"])
def test_what_auto_chose_is_drawn_by_the_executor(monkeypatch, cheaper):
    scene = SCENES["with a mesh"]
    # Which one is cheaper is measured, so a test has to say it; after a coarse march much is left to mend.
    marching = Choice(vr.plan(scene, method="march", step=0.2), 1.0)
    monkeypatch.setattr(rendering, "choose", lambda *_: marching if cheaper == "march" else None)
    desk = Elsewhere()
    out = vr.render(scene, certified=False, executor=desk)
    assert_same(out, vr.render(scene, certified=False, threads=1))
    assert len(desk.sent) > {"exact": 5, "march": 5}[cheaper]  # tiles; runs, and what is left


def test_with_enough_time_the_image_is_that_of_threads():
    words = {"method": "exact", "tolerance": 1e-6, "max_seconds": 1e6}
    scene = SCENES["with a mesh"]
    assert_same(vr.render(scene, executor=Elsewhere(), **words), vr.render(scene, threads=1, **words))


@pytest.mark.parametrize("method", METHODS)
def test_without_time_nothing_is_begun(method):
    desk, scene = Elsewhere(), SCENES["with a mesh"]
    out = vr.render(scene, executor=desk, max_seconds=1e-9, **METHODS[method])
    assert (len(desk.sent), out.samples, out.met_tolerance) == (0, 0, False)
    assert out.rgba.tobytes() == vr.render(scene, max_seconds=1e-9, **METHODS[method]).rgba.tobytes()


def test_where_the_volume_does_not_show_nothing_is_sent():
    clear = vr.TransferFunction([0, 1], [(1, 1, 1)] * 2, [0, 0])
    scene = dataclasses.replace(SCENES["with a mesh"], transfer=clear)
    only_a_mesh = dataclasses.replace(scene, volume=None, transfer=None)
    desk = Elsewhere()
    images = [vr.render(each, executor=desk).rgba for each in (scene, only_a_mesh)]
    assert (desk.sent, images[0].tobytes()) == ([], images[1].tobytes())
    assert images[0].any()


def test_progress_counts_the_tasks():
    seen = []
    desk = Elsewhere()
    vr.render(
        SCENES["without"],
        executor=desk,
        method="exact",
        progress=lambda done, total: seen.append((done, total)),
    )
    assert seen == [(i, len(desk.sent)) for i in range(1, len(desk.sent) + 1)]


def test_a_large_image_has_few_tasks_and_a_small_one_some_for_everybody():
    assert crew._parts_per_task(tiles(scene_of(64, 48, mesh=False), Rectangle(0, 64, 0, 48))) == 1
    for side, least, most in ((512, 64, 64), (1024, 64, 64), (4096, 1024, 1024)):
        parts = tiles(scene_of(side, side, mesh=False), Rectangle(0, side, 0, side))
        assert least <= len(parts.grouped(crew._parts_per_task(parts))) <= most


# --- files that are not what they were


@pytest.fixture
def loaded(tmp_path):
    """A scene from a file, and the file of its volume."""
    vr.save_scene(SCENES["without"], tmp_path / "scene.json")
    np.savez(tmp_path / "other.npz", volume=SCENES["without"].volume.values)
    scene = vr.load_scene(tmp_path / "scene.json")
    volume = vr.load_volume(tmp_path / "other.npz")
    return dataclasses.replace(scene, volume=volume), tmp_path / "other.npz"


def meddle(monkeypatch, with_file):
    """Do something to a file after it was referred to and before a worker reads it."""
    make = crew.errand_of

    def errand_of(*words):
        errand = make(*words)
        with_file(Path(errand.volume.file.path))
        return errand

    monkeypatch.setattr(crew, "errand_of", errand_of)


def write_over(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


@pytest.mark.parametrize("where", ["here", "in a process"])
def test_a_file_that_changed_meanwhile_is_refused(monkeypatch, loaded, pool, where):
    meddle(monkeypatch, write_over)
    executor = Elsewhere() if where == "here" else pool
    with pytest.raises(
        vr.FormatError, match=r"other.npz must stay as it is while it is rendered, got SHA-256"
    ):
        vr.render(loaded[0], executor=executor)


def test_a_file_that_changes_after_it_was_read_is_refused(loaded):
    with pytest.raises(vr.FormatError, match=r"must stay as it is while"):
        vr.render(loaded[0], executor=Elsewhere(first=lambda: write_over(loaded[1])))


def test_a_file_that_changed_before_is_not_referred_to(loaded):
    scene, path = loaded
    write_over(path)
    assert_same(vr.render(scene, executor=Elsewhere()), vr.render(scene, threads=1))
    path.unlink()
    assert_same(vr.render(scene, executor=Elsewhere()), vr.render(scene, threads=1))


@pytest.mark.parametrize("where", ["here", "in a process"])
def test_a_file_that_a_worker_cannot_read_is_refused_with_a_cure(monkeypatch, loaded, pool, where):
    meddle(monkeypatch, Path.unlink)
    executor = Elsewhere() if where == "here" else pool
    message = (
        r"other.npz must be a file that every worker can read, got No such file .* name one .* VOLREF_SHARED"
    )
    with pytest.raises(vr.FormatError, match=message) as refused:
        vr.render(loaded[0], executor=executor)
    assert str(refused.value).count(";") == 1


def test_what_is_written_for_workers_goes_to_the_folder_that_they_share(monkeypatch, tmp_path):
    monkeypatch.setenv("VOLREF_SHARED", str(tmp_path))
    seen = []
    meddle(monkeypatch, seen.append)
    vr.render(SCENES["without"], executor=Elsewhere())
    assert [path.parents[1] for path in seen] == [tmp_path.resolve()]
    assert list(tmp_path.iterdir()) == []
    monkeypatch.setenv("VOLREF_SHARED", str(tmp_path / "nowhere"))
    with pytest.raises(vr.FormatError, match="VOLREF_SHARED must name a folder that can be written to"):
        vr.render(SCENES["without"], executor=Elsewhere())


def test_what_is_no_executor_is_refused(client):
    with pytest.raises(vr.SceneError, match=r"got Client; of a Dask Client pass client.get_executor\(\)"):
        vr.render(SCENES["without"], executor=client)


# --- ends that nobody wanted


def stop_after(count):
    def progress(done, _):
        if done == count:
            raise KeyboardInterrupt

    return progress


@pytest.mark.parametrize("where", ["processes", "dask", "threads", "here"])
def test_ctrl_c_cancels_the_rest_and_leaves_nothing(expected, pool, client, where):
    with ThreadPoolExecutor(1) as one:
        executor = {"processes": pool, "dask": client.get_executor(), "threads": one, "here": None}[where]
        with pytest.raises(KeyboardInterrupt):
            vr.render(SCENES["without"], executor=executor, progress=stop_after(2), **METHODS["exact"])
        # And whoever worked can do so again.
        assert_same(
            vr.render(SCENES["without"], executor=executor, **METHODS["exact"]), expected["without", "exact"]
        )


class Busy(Elsewhere):
    """Another process that ends its first task and has not begun the others."""

    def submit(self, function, *words):
        if not self.sent:
            return super().submit(function, *words)
        self.sent.append(Future())
        return self.sent[-1]


def test_what_has_not_begun_is_cancelled():
    busy = Busy()
    with pytest.raises(KeyboardInterrupt) as raised:
        vr.render(SCENES["without"], executor=busy, progress=stop_after(1))
    assert raised.value.__traceback__ is not None  # it holds all that would be tidied up by chance
    assert [future.cancelled() for future in busy.sent[1:]] == [True] * (len(busy.sent) - 1)


def kill_after_the_first(pid):
    def progress(done, _):
        if done == 1:
            os.kill(pid, signal.SIGKILL)

    return progress


@pytest.mark.parametrize("method", METHODS)
def test_the_image_is_complete_if_a_process_of_a_pool_is_killed(expected, method):
    scene = SCENES["with a mesh"]
    with processes(2) as doomed:
        pid = doomed.submit(os.getpid).result()
        with pytest.warns(RuntimeWarning, match="the executor broke") as told:
            out = vr.render(scene, executor=doomed, progress=kill_after_the_first(pid), **METHODS[method])
    assert_same(out, expected["with a mesh", method])
    assert len(told) == 1


@pytest.mark.parametrize("method", METHODS)
def test_the_image_is_complete_if_a_dask_worker_is_killed(expected, client, method):
    pids = client.run(os.getpid)
    stop = kill_after_the_first(next(iter(pids.values())))
    out = vr.render(SCENES["with a mesh"], executor=client.get_executor(), progress=stop, **METHODS[method])
    assert_same(out, expected["with a mesh", method])
    client.wait_for_workers(2)
    assert set(client.run(os.getpid).values()) != set(pids.values())  # one of them is another by now


def test_a_worker_of_another_version_is_refused(monkeypatch):
    meddle(monkeypatch, lambda _: monkeypatch.setattr(vr, "__version__", "99.0"))
    with pytest.raises(
        vr.FormatError, match=r"workers must have volref 0.* as their client has, got volref 99.0 and"
    ):
        vr.render(SCENES["without"], executor=Elsewhere())
