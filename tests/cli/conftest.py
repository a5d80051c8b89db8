import pytest

from tests.scenes import rough_scene
from volref import save_scene


@pytest.fixture
def scene_file(tmp_path):
    """A small scene with a volume, 24 x 16 pixels, as a path."""
    path = tmp_path / "scene.json"
    save_scene(rough_scene(), path)
    return str(path)
