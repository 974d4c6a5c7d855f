import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from arlight.rendering import transfer_cache
from arlight.rendering.default_object import default_object
from arlight.rendering.reconstruction import reconstruct
from arlight.rendering.transfer_cache import kept_transfer, user_cache_folder


@pytest.fixture(scope="module")
def mesh():
    return default_object(400).placed(40.0)


@pytest.fixture
def made(monkeypatch):
    """Counts how often the shadows are really cast."""
    calls = []
    original = transfer_cache.precompute_transfer

    def counted(*arguments):
        calls.append(arguments)
        return original(*arguments)

    monkeypatch.setattr(transfer_cache, "precompute_transfer", counted)
    return calls


def same(one, other):
    pairs = [(one.vertex_rows, other.vertex_rows), (one.openness, other.openness)]
    pairs += [
        (getattr(one.shadow, name), getattr(other.shadow, name)) for name in ("hidden_rows", "open_row", "openness")
    ]
    return one.shadow.grid == other.shadow.grid and all(np.array_equal(*pair) for pair in pairs)


def test_the_second_time_it_is_read(tmp_path, made, mesh, reconstruction):
    folder = tmp_path / "not" / "there"
    first = kept_transfer(folder, mesh, reconstruction, 32, 16)
    shares = []
    second = kept_transfer(folder, mesh, reconstruction, 32, 16, shares.append)
    assert len(made) == 1
    assert same(first, second)
    assert shares == [1.0]
    assert [path.suffix for path in folder.iterdir()] == [".npz"]


def test_whatever_it_depends_on_makes_another(tmp_path, made, mesh, reconstruction, probe):
    moved = mesh.vertices_mm.copy()
    moved[7, 2] += 1e-9
    others = [
        (mesh, reconstruction, 32, 16),
        (replace(mesh, vertices_mm=moved), reconstruction, 32, 16),
        (replace(mesh, faces=mesh.faces[:-1]), reconstruction, 32, 16),
        (replace(mesh, closed=False), reconstruction, 32, 16),
        (mesh, reconstruct(probe.slab, probe.frequencies, 0.31), 32, 16),
        (mesh, reconstruct(probe.slab, probe.frequencies[:9]), 32, 16),
        (mesh, reconstruction, 33, 16),
        (mesh, reconstruction, 32, 17),
    ]
    for arguments in others:
        kept_transfer(tmp_path, *arguments)
    assert len(made) == len(others)


@pytest.mark.parametrize("kept", [slice(0), slice(2000), slice(-9), slice(9, None)])
def test_a_damaged_file_is_made_anew(tmp_path, made, mesh, reconstruction, kept):
    first = kept_transfer(tmp_path, mesh, reconstruction, 32, 16)
    (path,) = tmp_path.iterdir()
    path.write_bytes(path.read_bytes()[kept])
    assert same(kept_transfer(tmp_path, mesh, reconstruction, 32, 16), first)
    assert same(kept_transfer(tmp_path, mesh, reconstruction, 32, 16), first)
    assert len(made) == 2


@pytest.mark.parametrize("spoilt", ["vertex_rows", "open_row"])
def test_a_file_with_other_content_is_made_anew(tmp_path, made, mesh, reconstruction, spoilt):
    kept_transfer(tmp_path, mesh, reconstruction, 32, 16)
    (path,) = tmp_path.iterdir()
    with np.load(path) as content:
        arrays = dict(content)
    for change in (lambda a: a[..., :-1], lambda a: a.astype(float), lambda a: np.full_like(a, np.nan)):
        np.savez(path, **(arrays | {spoilt: change(arrays[spoilt])}))
        kept_transfer(tmp_path, mesh, reconstruction, 32, 16)
    np.savez(path, **{name: array for name, array in arrays.items() if name != spoilt})
    kept_transfer(tmp_path, mesh, reconstruction, 32, 16)
    assert len(made) == 5


def test_a_folder_that_cannot_be_written_does_no_harm(tmp_path, made, mesh, reconstruction):
    occupied = tmp_path / "file"
    occupied.write_text("no folder")
    for folder in (occupied, occupied / "below", None):
        kept_transfer(folder, mesh, reconstruction, 32, 16)
    assert len(made) == 3
    assert occupied.read_text() == "no folder"


def test_the_oldest_files_are_forgotten(tmp_path, made, mesh, reconstruction, monkeypatch):
    monkeypatch.setattr(transfer_cache, "_MOST_FILES", 2)
    for age, texels in ((3, 8), (2, 9), (1, 10)):
        kept_transfer(tmp_path, mesh, reconstruction, 32, texels)
        newest = max(tmp_path.iterdir(), key=lambda path: path.stat().st_mtime)
        os.utime(newest, (1e9 - age, 1e9 - age))
    assert len(list(tmp_path.iterdir())) == 2
    kept_transfer(tmp_path, mesh, reconstruction, 32, 10)
    assert len(made) == 3
    kept_transfer(tmp_path, mesh, reconstruction, 32, 8)
    assert len(made) == 4


@pytest.mark.parametrize(
    ("named", "expected"),
    [("/somewhere", "/somewhere/arlight"), ("", "~/.cache/arlight"), ("here", "~/.cache/arlight")],
)
def test_the_folder_follows_the_environment(monkeypatch, named, expected):
    monkeypatch.setenv("XDG_CACHE_HOME", named)
    assert user_cache_folder() == Path(expected).expanduser()
