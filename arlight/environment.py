"""Captured environments: latitude-longitude maps of distant radiance, and their true coefficients.

Frame: the probe's. Row 0 is the zenith (+z); the centre of column c has the azimuth 2 pi (c + 1/2)/width + yaw,
counted from +x toward +y.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from arlight.errors import EnvironmentMapError
from arlight.fourier import analyse
from arlight.optics import Slab

Array = NDArray[np.float64]

_EXR_MAGIC = b"\x76\x2f\x31\x01"


@dataclass(frozen=True, slots=True)
class Environment:
    """Radiance from every direction of the sphere."""

    radiance: NDArray[np.float32]
    """(rows, columns, 3) linear RGB radiance; 1 is what the camera records as full scale."""
    yaw_rad: float = 0.0
    """How far the map is turned about +z, counter-clockwise from above [rad]."""

    @classmethod
    def load(cls, path: Path | str) -> "Environment":
        """Read a Radiance (.hdr) or OpenEXR (.exr) latitude-longitude map.

        Raises:
            EnvironmentMapError: the file is missing, unreadable, not 2:1, or holds negative or infinite radiance.
        """
        return cls(_read_radiance(Path(path)))

    def rotated(self, yaw_rad: float) -> "Environment":
        """The same environment turned by `yaw_rad` about +z; exact, nothing is resampled."""
        return replace(self, yaw_rad=self.yaw_rad + yaw_rad)

    def scaled(self, exposure: float) -> "Environment":
        """The same environment, its radiance multiplied by `exposure`."""
        return replace(self, radiance=(self.radiance * np.float32(exposure)))

    def samples(self) -> tuple[Array, Array]:
        """The map's pixels above the horizon as small distant lights.

        Returns:
            directions (s, 3), unit vectors toward the light, and radiance times solid angle (s, 3) [radiance * sr].
        """
        rows, columns = self.radiance.shape[:2]
        theta = (np.arange(rows // 2) + 0.5) * np.pi / rows
        phi = (np.arange(columns) + 0.5) * 2.0 * np.pi / columns + self.yaw_rad
        sine, cosine = np.sin(theta)[:, None], np.cos(theta)[:, None]
        directions = np.stack(
            [sine * np.cos(phi), sine * np.sin(phi), np.broadcast_to(cosine, (len(theta), columns))], axis=-1
        )
        solid_angle = sine * (np.pi / rows) * (2.0 * np.pi / columns)
        light = self.radiance[: rows // 2].astype(float) * solid_angle[..., None]
        return directions.reshape(-1, 3), light.reshape(-1, 3)

    def radiance_at(self, directions: ArrayLike) -> Array:
        """Radiance (..., 3) from unit directions (..., 3), bilinear between the map's pixels."""
        w = np.asarray(directions, float)
        rows, columns = self.radiance.shape[:2]
        theta = np.arccos(np.clip(w[..., 2], -1.0, 1.0))
        phi = np.arctan2(w[..., 1], w[..., 0]) - self.yaw_rad
        y = np.clip(theta / np.pi * rows - 0.5, 0.0, rows - 1.0)
        x = (phi / (2.0 * np.pi) * columns - 0.5) % columns
        y0 = np.minimum(y.astype(int), rows - 2)
        x0 = x.astype(int) % columns
        x1 = (x0 + 1) % columns
        fy, fx = (y - y0)[..., None], (x - np.floor(x))[..., None]
        r = self.radiance
        top = r[y0, x0] * (1.0 - fx) + r[y0, x1] * fx
        bottom = r[y0 + 1, x0] * (1.0 - fx) + r[y0 + 1, x1] * fx
        return top * (1.0 - fy) + bottom * fy

    def irradiance(self) -> Array:
        """Irradiance (3,) on the upward-facing plane, nothing in front of it [radiance * sr]."""
        directions, light = self.samples()
        return directions[:, 2] @ light

    def coefficients(self, slab: Slab, frequencies: ArrayLike) -> NDArray[np.complex128]:
        """True Fourier coefficients L~_n of the received lighting, by direct summation over the map's pixels.

        Args:
            slab: the glass the light passes.
            frequencies: (k, 2) integers.

        Returns:
            (k, 3) complex [radiance * sr].
        """
        directions, light = self.samples()
        cosine = directions[:, 2]
        received = light * (cosine * slab.transmittance(cosine))[:, None]
        return analyse(received, slab.light_plane(directions), frequencies)


def blend(first: Environment, second: Environment, share: float) -> Environment:
    """Cross-fade: (1 - share) of the first environment plus share of the second, resampled to the first's grid."""
    if share == 0.0:
        return first
    rows, columns = first.radiance.shape[:2]
    theta = (np.arange(rows) + 0.5)[:, None] * np.pi / rows
    phi = (np.arange(columns) + 0.5)[None, :] * 2.0 * np.pi / columns + first.yaw_rad
    directions = np.stack(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.broadcast_to(np.cos(theta), (rows, columns))],
        axis=-1,
    )
    mixed = (1.0 - share) * first.radiance + share * second.radiance_at(directions)
    return replace(first, radiance=mixed.astype(np.float32))


def _read_radiance(path: Path) -> NDArray[np.float32]:
    if not path.is_file():
        raise EnvironmentMapError(f"{path}: no such environment; expected a latitude-longitude .hdr or .exr file")
    try:
        with path.open("rb") as file:
            is_exr = file.read(len(_EXR_MAGIC)) == _EXR_MAGIC
    except OSError as error:
        raise EnvironmentMapError(f"{path}: cannot be read ({error.strerror})") from error
    radiance = _decode_exr(path) if is_exr else _decode_hdr(path)
    rows, columns = radiance.shape[:2]
    if columns != 2 * rows or rows % 2 or rows < 4:
        raise EnvironmentMapError(
            f"{path}: expected a latitude-longitude map twice as wide as high with an even number of rows, "
            f"found {columns} x {rows}; resize it to 2:1"
        )
    if not np.all(np.isfinite(radiance)) or radiance.min() < 0.0:
        raise EnvironmentMapError(f"{path}: radiance must be finite and not negative; clean the map first")
    return radiance


def _decode_hdr(path: Path) -> NDArray[np.float32]:
    try:
        image = cv2.imread(str(path), cv2.IMREAD_ANYCOLOR | cv2.IMREAD_ANYDEPTH)
    except cv2.error as error:
        raise EnvironmentMapError(f"{path}: not a readable .hdr or .exr image; export the map again") from error
    if image is None or image.ndim != 3 or image.dtype != np.float32:
        # eight-bit pictures end at white: their lamps are missing
        raise EnvironmentMapError(f"{path}: not a readable .hdr or .exr colour image; export the map again")
    return np.ascontiguousarray(image[..., 2::-1])


def _decode_exr(path: Path) -> NDArray[np.float32]:
    # not by OpenCV: its packages are built without OpenEXR; here, because most environments are .hdr files
    import OpenEXR

    try:
        channels = OpenEXR.File(str(path), separate_channels=True).channels()
    except (RuntimeError, ValueError) as error:
        raise EnvironmentMapError(f"{path}: the OpenEXR image cannot be read; export the map again") from error
    missing = {"R", "G", "B"} - channels.keys()
    if missing:
        raise EnvironmentMapError(
            f"{path}: expected the channels R, G and B, found {', '.join(sorted(channels)) or 'none'}; "
            "export the map as plain RGB"
        )
    return np.stack([np.asarray(channels[name].pixels, np.float32) for name in "RGB"], axis=-1)
