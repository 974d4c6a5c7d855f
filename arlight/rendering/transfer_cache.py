"""Keeps what was folded out of an object's shadows on disk, so that the same object is ready at once the next time."""

import hashlib
import os
import tempfile
import zipfile
from contextlib import suppress
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from arlight.rendering.mesh import Mesh
from arlight.rendering.reconstruction import Reconstruction
from arlight.rendering.shadow import PlaneGrid, PlaneShadow
from arlight.rendering.transfer import Transfer, precompute_transfer
from arlight.rendering.visibility import Progress

_VERSION = 1
"""To be raised with every change of what `precompute_transfer` makes of the same input."""
_MOST_FILES = 16
_PATTERN = "transfer-*.npz"
_UNREADABLE = (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile)


def user_cache_folder() -> Path:
    """Where this user's caches lie: $XDG_CACHE_HOME/arlight, by default ~/.cache/arlight."""
    named = os.environ.get("XDG_CACHE_HOME", "")
    # the specification has relative paths ignored
    return (Path(named) if Path(named).is_absolute() else Path("~/.cache").expanduser()) / "arlight"


def kept_transfer(
    folder: Path | None,
    mesh: Mesh,
    reconstruction: Reconstruction,
    directions: int,
    shadow_texels: int,
    progress: Progress | None = None,
) -> Transfer:
    """What `precompute_transfer` makes, read from a file where it was made before.

    A file that is damaged is made anew; a folder that cannot be written does no harm.

    Args:
        folder: of the files; None keeps nothing.
        mesh, reconstruction, directions, shadow_texels, progress: as in `precompute_transfer`.
    """
    if folder is None:
        return precompute_transfer(mesh, reconstruction, directions, shadow_texels, progress)
    path = folder / f"transfer-{_key(mesh, reconstruction, directions, shadow_texels)}.npz"
    grid = PlaneShadow.grid_around(mesh, shadow_texels)
    with suppress(*_UNREADABLE):
        transfer = _read(path, len(mesh.vertices_mm), reconstruction.rows.shape[1], grid)
        if progress is not None:
            progress(1.0)
        return transfer
    transfer = precompute_transfer(mesh, reconstruction, directions, shadow_texels, progress)
    with suppress(OSError):
        _write(path, transfer)
        _forget_oldest(folder)
    return transfer


def _key(mesh: Mesh, reconstruction: Reconstruction, directions: int, shadow_texels: int) -> str:
    """Of all that the transfer depends on, bit by bit."""
    digest = hashlib.sha256(repr((_VERSION, directions, shadow_texels, mesh.closed)).encode())
    arrays = (mesh.vertices_mm, mesh.normals, mesh.faces, reconstruction.rows, reconstruction.prior_weights)
    for array in (*arrays, reconstruction.ground_radiance_row):
        digest.update(repr((array.shape, array.dtype.str)).encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()[:32]


def _read(path: Path, vertices: int, coefficients: int, grid: PlaneGrid) -> Transfer:
    with np.load(path) as content:
        texels = grid.side**2
        return Transfer(
            _checked(content["vertex_rows"], (vertices, coefficients)),
            _checked(content["openness"], (vertices, 9)),
            PlaneShadow(
                grid,
                _checked(content["hidden_rows"], (texels, coefficients)),
                _checked(content["open_row"], (coefficients,)),
                _checked(content["plane_openness"], (grid.side, grid.side)),
            ),
        )


def _checked(array: NDArray[np.float32], shape: tuple[int, ...]) -> NDArray[np.float32]:
    if array.shape != shape or array.dtype != np.float32 or not np.all(np.isfinite(array)):
        raise ValueError(f"expected finite float32 {shape}, found {array.dtype} {array.shape}")
    return array


def _write(path: Path, transfer: Transfer) -> None:
    """Under another name first: who reads meanwhile finds all of it or nothing."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.NamedTemporaryFile(dir=path.parent, suffix=".part", delete=False) as file:
        try:
            np.savez(
                file,
                vertex_rows=transfer.vertex_rows,
                openness=transfer.openness,
                hidden_rows=transfer.shadow.hidden_rows,
                open_row=transfer.shadow.open_row,
                plane_openness=transfer.shadow.openness,
            )
            file.close()
            Path(file.name).replace(path)
        except OSError:
            Path(file.name).unlink(missing_ok=True)
            raise


def _forget_oldest(folder: Path) -> None:
    files = sorted(folder.glob(_PATTERN), key=lambda path: path.stat().st_mtime, reverse=True)
    for path in files[_MOST_FILES:]:
        path.unlink(missing_ok=True)
