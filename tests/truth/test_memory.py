import subprocess
import sys

import numpy as np
import pytest

RENDER = """
import resource, sys
import numpy as np
import volref as vr
volume = vr.load_volume(sys.argv[1])
transfer = vr.TransferFunction([0, 100, 255], [(1, 1, 1)] * 3, [0, 0.0, 0.05])
center = volume.corners.mean(axis=0)
camera = vr.Camera.look_at(center + (900, 500, 700), center, (0, 0, 1), 40, 1, 1e4)
out = vr.render(vr.Scene(volume, transfer, camera, 256, 256), method=sys.argv[2])
print(out.rgba[..., 3].max(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


@pytest.mark.slow
@pytest.mark.parametrize("method", ["march", "exact"])
def test_a_512_cubed_volume_from_disk_stays_within_one_and_a_half_gibibytes(tmp_path, method):
    path = tmp_path / "volume.npy"
    values = np.lib.format.open_memmap(path, mode="w+", dtype=np.uint8, shape=(512, 512, 512))
    along = np.arange(512)
    for z in range(512):
        values[z] = (along[:, None] + along + z) % 256
    del values
    words = [sys.executable, "-c", RENDER, path, method]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    alpha, kibibytes = map(float, done.stdout.split())
    assert alpha > 0.5
    assert kibibytes <= 1.5 * 2**20
