"""Memory while rendering volumes from disk: the file is mapped, and nothing holds a second copy of it.

What counts is anonymous memory, which the system cannot take back; pages of a mapped file come and go.  It is
read from /proc/self/status, so these tests need Linux.
"""

import subprocess
import sys

import numpy as np
import pytest

from data_gen.large import write_large

# A thread of its own looks every few milliseconds how much anonymous memory the process has.
RENDER = """
import sys, threading, time
import volref as vr

def anonymous():
    with open("/proc/self/status") as status:
        return int(next(line for line in status if line.startswith("RssAnon")).split()[1])

def watch():
    while True:
        most[0] = max(most[0], anonymous())
        time.sleep(0.002)

most = [anonymous()]
threading.Thread(target=watch, daemon=True).start()
volume = vr.load_volume(sys.argv[1])
transfer = vr.TransferFunction([0, 100, 255], [(1, 1, 1)] * 3, [0, 0.0, 0.05])
center = volume.corners.mean(axis=0)
eye = center + (1.75 * volume.size[0], 0.98 * volume.size[0], 1.37 * volume.size[0])
camera = vr.Camera.look_at(eye, center, (0, 0, 1), 40, 1, 1e4)
out = vr.render(vr.Scene(volume, transfer, camera, 256, 256), method=sys.argv[2], threads=2)
print(out.rgba[..., 3].max(), most[0])
"""

pytestmark = pytest.mark.slow


def rendered(path, method):
    """Return the largest opacity of an image, and the most GiB of anonymous memory that it took."""
    words = [sys.executable, "-c", RENDER, path, method]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    alpha, kibibytes = map(float, done.stdout.split())
    return alpha, kibibytes / 2**20


@pytest.mark.parametrize("method", ["march", "exact"])
def test_a_full_512_cubed_volume_from_disk_takes_half_a_gibibyte(tmp_path, method):
    path = tmp_path / "volume.npy"
    values = np.lib.format.open_memmap(path, mode="w+", dtype=np.uint8, shape=(512, 512, 512))
    along = np.arange(512)
    for z in range(512):
        values[z] = (along[:, None] + along + z) % 256
    del values
    alpha, gibibytes = rendered(path, method)
    assert alpha > 0.5
    assert gibibytes <= 0.5


@pytest.fixture(scope="module")
def large_volume(tmp_path_factory):
    path = tmp_path_factory.mktemp("large") / "volume.npy"
    write_large(path, 1024)
    yield path
    path.unlink()


@pytest.mark.parametrize("method", ["march", "exact"])
def test_a_volume_of_1_gibibyte_from_disk_takes_at_most_six_tenths_of_one(large_volume, method):
    for _ in range(2):  # without the ranges of its blocks beside it, and with them
        alpha, gibibytes = rendered(large_volume, method)
        assert alpha > 0.5
        assert gibibytes <= 0.6
