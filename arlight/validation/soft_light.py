"""Captured environments made soft: a sun through glass converges badly, a blurred one is as good a test."""

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from arlight.environment import Environment
from arlight.errors import OutputError
from arlight.fourier import analyse
from arlight.optics import Slab

Array = NDArray[np.float64]

ROWS = 96
SPREAD_DEG = 5.0
_CHUNK = 512


def softened(environment: Environment, spread_deg: float = SPREAD_DEG, rows: int = ROWS) -> Environment:
    """The environment blurred by a Gaussian on the sphere that keeps its power, on a coarse map.

    Args:
        environment: what was captured; its yaw is kept.
        spread_deg: standard deviation along each of the two angles [deg].
        rows: of the map that is returned, half its columns.
    """
    source, source_area = _grid(*environment.radiance.shape[:2])
    target, target_area = _grid(rows, 2 * rows)
    sharpness = 1.0 / np.deg2rad(spread_deg) ** 2
    radiance = np.zeros((len(target), 3), np.float32)
    light = (environment.radiance.reshape(-1, 3) * source_area[:, None]).astype(np.float32)
    target_area = target_area.astype(np.float32)
    for start in range(0, len(source), _CHUNK):
        part = slice(start, start + _CHUNK)
        kernel = np.exp(np.float32(sharpness) * (target @ source[part].T - 1.0).astype(np.float32))
        # each source gives away all of its power, also where the map's pixels are coarse
        radiance += (kernel / (target_area @ kernel)) @ light[part]
    return Environment(radiance.reshape(rows, 2 * rows, 3).astype(np.float32), environment.yaw_rad)


def received_coefficients(environment: Environment, slab: Slab, frequencies: ArrayLike, rows: int = 512) -> Array:
    """L~_n of a map read bilinearly, as a renderer reads it: an integral on a far finer grid than the map's own.

    Args:
        environment: a smooth map.
        slab: the glass.
        frequencies: (k, 2) integers.
        rows: from pole to pole of the grid of directions.

    Returns:
        (k, 3) complex [radiance * sr].
    """
    directions, area = _grid(rows // 2, 2 * rows, pole_deg=90.0)
    weight = area * directions[:, 2] * slab.transmittance(directions[:, 2])
    return np.asarray(
        analyse(environment.radiance_at(directions) * weight[:, None], slab.light_plane(directions), frequencies)
    )


def save_environment(environment: Environment, path: Path | str) -> None:
    """Write a Radiance map; its yaw is not kept in it.

    Raises:
        OutputError: the file cannot be written.
    """
    try:
        written = cv2.imwrite(str(path), np.ascontiguousarray(environment.radiance[..., ::-1]))
    except cv2.error as error:
        raise OutputError(f"{path}: cannot be written; name a .hdr file in an existing folder") from error
    if not written:
        raise OutputError(f"{path}: cannot be written; choose another folder")


def as_stored(environment: Environment, path: Path | str) -> Environment:
    """Write a map and read it again: what follows uses what the file holds, rounded as the format rounds."""
    save_environment(environment, path)
    return Environment.load(path).rotated(environment.yaw_rad)


def _grid(rows: int, columns: int, pole_deg: float = 180.0) -> tuple[Array, Array]:
    """Directions (rows * columns, 3) of a latitude-longitude grid down to an angle, and their solid angles [sr]."""
    step = np.deg2rad(pole_deg) / rows
    theta = (np.arange(rows) + 0.5) * step
    phi = (np.arange(columns) + 0.5) * 2.0 * np.pi / columns
    sine, cosine = np.sin(theta)[:, None], np.cos(theta)[:, None]
    directions = np.stack([sine * np.cos(phi), sine * np.sin(phi), np.broadcast_to(cosine, (rows, columns))], axis=-1)
    area = np.broadcast_to(sine * 2.0 * np.sin(step / 2.0) * (2.0 * np.pi / columns), (rows, columns))
    return directions.reshape(-1, 3), area.reshape(-1)
