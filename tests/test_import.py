"""What is loaded before anything is asked for."""

import subprocess
import sys

import pytest

DEAR = ("scipy", "trimesh", "colour", "PIL", "matplotlib", "tqdm", "nibabel", "nrrd")

HELP = "from volref.cli import main; main(['--help']); main(['render', '--help'])"


def loaded_after(program):
    listing = "\nimport sys; print('LOADED', *sorted(sys.modules))"
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", program + listing], capture_output=True, text=True, check=True
    )
    return set(done.stdout.rsplit("LOADED", 1)[1].split())


@pytest.mark.parametrize("program", ["import volref", HELP], ids=["import", "help"])
def test_neither_import_nor_help_loads_a_dear_package(program):
    loaded = loaded_after(program)
    assert "volref" in loaded
    assert not loaded & set(DEAR)
