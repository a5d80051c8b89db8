"""Bundles of older formats are taken over; those of newer ones are refused."""

import numpy as np
import pytest

import volref as vr
from tests.golden.bundles import copied, manifest_of, put_manifest
from volref.golden.manifest import FORMAT_VERSION
from volref.golden.migrations import MIGRATIONS


def as_version_0(document):
    """The manifest as drafts of the format had it."""
    old = {key: value for key, value in document.items() if key != "recipe_sha256"}
    files = {entry["path"]: entry["sha256"] for entry in document["files"]}
    return old | {"format_version": 0, "files": files, "recipe_hash": document["recipe_sha256"]}


def test_there_is_a_step_from_every_older_version():
    assert sorted(MIGRATIONS) == list(range(FORMAT_VERSION))


def test_a_bundle_of_version_0_is_read_as_one_of_now(bundle, tmp_path):
    folder = copied(bundle, tmp_path / "old")
    put_manifest(folder, as_version_0(manifest_of(bundle)))
    old, new = vr.load_bundle(folder), vr.load_bundle(bundle)
    assert old.manifest == new.manifest
    assert np.array_equal(old.acceptance.hi, new.acceptance.hi)


def test_a_damaged_file_of_an_old_bundle_is_refused_all_the_same(bundle, tmp_path):
    folder = copied(bundle, tmp_path / "old")
    put_manifest(folder, as_version_0(manifest_of(bundle)))
    content = (folder / "expected/lo.npy").read_bytes()
    (folder / "expected/lo.npy").write_bytes(content[:-1] + bytes([content[-1] ^ 1]))
    with pytest.raises(vr.FormatError, match="another SHA-256"):
        vr.load_bundle(folder)


@pytest.mark.parametrize("files", [[], None, {"../x": "0"}, {"scene.json": 5}])
def test_an_old_manifest_that_is_none_is_refused_in_one_sentence(bundle, tmp_path, files):
    folder = copied(bundle, tmp_path / "old")
    put_manifest(folder, as_version_0(manifest_of(bundle)) | {"files": files})
    with pytest.raises(vr.FormatError, match=r"^manifest\.json"):
        vr.load_bundle(folder)
