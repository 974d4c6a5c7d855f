"""The pinhole camera with lens distortion and vignetting, and rigid poses.

Pixel centres lie at integers; distortion is in OpenCV's order; `camera_from_probe` maps probe millimetres to camera
millimetres (x right, y down, z forward).
"""

import json
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from arlight.errors import CameraError
from arlight.pixel_grid import over_pixels
from arlight.radiometry import Radiometry

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Camera:
    """Intrinsics of the camera that filmed the sheet."""

    image_size: tuple[int, int]
    """(width, height) [px]."""
    camera_matrix: Array
    """(3, 3) intrinsic matrix without skew [px]."""
    distortion: Array
    """(n,) lens distortion in OpenCV's order; zeros for none."""
    vignetting: tuple[float, float, float] | None = None
    """(k1, k2, k3) of the radial gain 1 + k1 r^2 + k2 r^4 + k3 r^6, r the distance from the principal point in half
    diagonals of the picture; None for an even gain."""
    radiometry: Radiometry | None = None
    """How codes stand for light in this camera; None to believe the footage's own transfer curve."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "camera_matrix", np.asarray(self.camera_matrix, float))
        object.__setattr__(self, "distortion", np.asarray(self.distortion, float).reshape(-1))
        _check_intrinsics(self.image_size, self.camera_matrix, self.distortion)
        if self.vignetting is not None:
            object.__setattr__(self, "vignetting", _checked_vignetting(self))

    @classmethod
    def load(cls, path: Path | str) -> "Camera":
        """Read camera.json: image_size, camera_matrix, distortion; vignetting and radiometry where known.

        Raises:
            CameraError: the file is missing, is not JSON, or holds impossible values.
        """
        path = Path(path)
        try:
            content: dict[str, Any] = json.loads(path.read_text())
            width, height = content["image_size"]
            radiometry = content.get("radiometry")
            return cls(
                (int(width), int(height)),
                content["camera_matrix"],
                content.get("distortion", [0.0] * 5),
                content.get("vignetting"),
                None if radiometry is None else Radiometry.of_content(radiometry),
            )
        except OSError as error:
            raise CameraError(f"{path}: cannot be read ({error.strerror}); a camera.json is expected there") from error
        except CameraError as error:
            raise CameraError(f"{path}: {error}") from error
        except (KeyError, TypeError, ValueError) as error:
            raise CameraError(
                f"{path}: expected JSON with image_size [w, h], camera_matrix 3x3 and distortion; found {error!r}"
            ) from error

    def save(self, path: Path | str) -> None:
        """Write camera.json."""
        content: dict[str, Any] = {
            "image_size": list(self.image_size),
            "camera_matrix": self.camera_matrix.tolist(),
            "distortion": self.distortion.tolist(),
        }
        if self.vignetting is not None:
            content["vignetting"] = list(self.vignetting)
        if self.radiometry is not None:
            content["radiometry"] = self.radiometry.content()
        Path(path).write_text(json.dumps(content, indent=1) + "\n")

    def project(self, camera_from_probe: "Pose", points_mm: ArrayLike) -> Array:
        """Pixels (n, 2) of probe-frame points (n, 3) [mm], lens distortion included."""
        points = np.ascontiguousarray(points_mm, float).reshape(-1, 1, 3)
        pixels, _ = cv2.projectPoints(
            points, camera_from_probe.rvec, camera_from_probe.translation, self.camera_matrix, self.distortion
        )
        return np.asarray(pixels, float).reshape(-1, 2)

    def rays(self, pixels: ArrayLike) -> Array:
        """Undistorted normalised image coordinates (n, 2) of pixels (n, 2): the ray is (x, y, 1)."""
        flat = np.ascontiguousarray(pixels, float).reshape(-1, 1, 2)
        if not np.any(self.distortion):
            k = self.camera_matrix
            y = (flat[:, 0, 1] - k[1, 2]) / k[1, 1]
            return np.stack([(flat[:, 0, 0] - k[0, 2]) / k[0, 0], y], axis=-1)
        criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 40, 1e-10)
        undistorted = cv2.undistortPoints(
            flat, self.camera_matrix, self.distortion, R=np.eye(3), P=np.eye(3), criteria=criteria
        )
        return np.asarray(undistorted, float).reshape(-1, 2)

    def with_more_vignetting(self, added: tuple[float, float, float]) -> "Camera":
        """The camera with the radial gain that a calibration found on top of its own."""
        if not any(added):
            return self
        own = self.vignetting or (0.0, 0.0, 0.0)
        return replace(self, vignetting=(own[0] + added[0], own[1] + added[1], own[2] + added[2]))

    def gain(self, pixels: ArrayLike) -> Array:
        """Vignetting (n,) at pixels (n, 2): recorded over incident light, 1 at the principal point."""
        flat = np.asarray(pixels, float).reshape(-1, 2)
        if self.vignetting is None:
            return np.ones(len(flat))
        half_diagonal_px = 0.5 * np.hypot(*self.image_size)
        squared = np.sum((flat - self.camera_matrix[:2, 2]) ** 2, axis=-1) / half_diagonal_px**2
        k1, k2, k3 = self.vignetting
        return 1.0 + squared * (k1 + squared * (k2 + squared * k3))

    @cached_property
    def ray_map(self) -> NDArray[np.float32]:
        """(h, w, 2) undistorted normalised coordinates of every pixel's centre; computed once."""
        return over_pixels(self.rays, self.image_size)


@dataclass(frozen=True)
class Pose:
    """A rigid transform from the probe frame to the camera frame."""

    rotation: Array
    """(3, 3) rotation matrix."""
    translation: Array
    """(3,) [mm]."""

    @classmethod
    def from_rvec(cls, rvec: ArrayLike, translation: ArrayLike) -> "Pose":
        """From a Rodrigues vector (3,) [rad] and a translation (3,) [mm]."""
        rotation, _ = cv2.Rodrigues(np.asarray(rvec, float).reshape(3, 1))
        return cls(np.asarray(rotation, float), np.asarray(translation, float).reshape(3))

    @property
    def rvec(self) -> Array:
        """(3,) Rodrigues vector [rad]."""
        vector, _ = cv2.Rodrigues(np.asarray(self.rotation, float))
        return np.asarray(vector, float).reshape(3)

    @property
    def camera_centre_mm(self) -> Array:
        """(3,) where the camera stands in the probe frame [mm]."""
        return -self.rotation.T @ self.translation

    def transform(self, points_mm: ArrayLike) -> Array:
        """Points (..., 3) of the probe frame in the camera frame [mm]."""
        return np.asarray(points_mm, float) @ self.rotation.T + self.translation

    def view_directions(self, points_mm: ArrayLike) -> Array:
        """Unit vectors (..., 3), probe frame, from points (..., 3) of the probe frame toward the camera."""
        toward = self.camera_centre_mm - np.asarray(points_mm, float)
        return toward / np.linalg.norm(toward, axis=-1, keepdims=True)


def _check_intrinsics(image_size: tuple[int, int], matrix: Array, distortion: Array) -> None:
    if len(image_size) != 2 or min(image_size) < 1:
        raise CameraError(f"image_size must be [width, height] in pixels, found {list(image_size)}")
    if matrix.shape != (3, 3) or not np.all(np.isfinite(matrix)):
        raise CameraError(f"camera_matrix must be 3x3 and finite, found shape {matrix.shape}")
    if matrix[0, 0] <= 0 or matrix[1, 1] <= 0 or not np.allclose(matrix[2], [0, 0, 1]):
        raise CameraError("camera_matrix must have positive focal lengths and [0, 0, 1] as its last row")
    if matrix[0, 1] != 0.0 or matrix[1, 0] != 0.0:
        # OpenCV ignores skew without a word
        raise CameraError(
            f"camera_matrix must have no skew, found {matrix[0, 1]:g} beside the focal length; calibrate without it"
        )
    if distortion.size not in (0, 4, 5, 8, 12, 14) or not np.all(np.isfinite(distortion)):
        raise CameraError(f"distortion must hold 4, 5, 8, 12 or 14 finite numbers, found {distortion.size}")


def _checked_vignetting(camera: Camera) -> tuple[float, float, float]:
    values = np.asarray(camera.vignetting, float)
    if values.shape != (3,) or not np.all(np.isfinite(values)):
        raise CameraError(f"vignetting must hold 3 finite numbers (k1, k2, k3), found {camera.vignetting}")
    k1, k2, k3 = (float(v) for v in values)
    width, height = camera.image_size
    x, y = np.meshgrid(np.linspace(0.0, width - 1.0, 33), np.linspace(0.0, height - 1.0, 33))
    least = float(camera.gain(np.stack([x, y], axis=-1)).min())
    if least <= 0.05:
        raise CameraError(
            f"vignetting must leave a positive gain all over the picture, found {least:.3g} at its least; "
            "r is counted in half diagonals of the picture"
        )
    return k1, k2, k3
