"""What is loaded before anything is asked for."""

import subprocess
import sys

import pytest

import volref

DEAR = ("scipy", "trimesh", "colour", "PIL", "matplotlib", "tqdm", "nibabel", "nrrd", "distributed")

HELP = "from volref.cli import main; main(['--help']); main(['render', '--help'])"


def loaded_after(program):
    listing = "\nimport sys; print('LOADED', *sorted(sys.modules))"
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", program + listing], capture_output=True, text=True, check=True
    )
    return set(done.stdout.rsplit("LOADED", 1)[1].split())


@pytest.mark.parametrize("program", ["import volref", "from volref import *", HELP])
def test_neither_import_nor_help_loads_a_dear_package(program):
    loaded = loaded_after(program)
    assert "volref" in loaded
    assert not loaded & set(DEAR)


def test_help_does_not_even_load_numpy():
    assert "numpy" not in loaded_after(HELP)


def test_every_public_name_is_there():
    assert all(getattr(volref, name) is not None for name in volref.__all__)
    assert set(volref.__all__) <= set(dir(volref))
    with pytest.raises(AttributeError, match="no attribute 'rendre'"):
        _ = volref.rendre
