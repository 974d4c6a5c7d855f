"""A ball as one camera sees it: the cone of rays that touch it, and what light each of its points reflects.

A sphere's outline is a circular cone about the ray to its centre, so in the picture it is an ellipse, and a lens bends
it further; among rays it stays exactly a cone. Which way light is reflected depends on the cone's angle alone: a small
ball nearby and a large one far away show distant light in the same places.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from arlight.camera import Camera, Pose
from arlight.errors import ArlightError

Array = NDArray[np.float64]

_CAMERA_FRAME = Pose(np.eye(3), np.zeros(3))


class BallError(ArlightError):
    """A ball that is not in the picture, or not where it could be."""


@dataclass(frozen=True, slots=True)
class BallOutline:
    """The cone of rays that touch the ball."""

    axis: Array
    """(3,) unit vector from the camera to the ball's centre, camera frame."""
    half_angle_rad: float
    """Angle between the axis and the rays that touch the ball, in (0, pi/2) [rad]."""

    @classmethod
    def through_rays(cls, rays: ArrayLike, weights: ArrayLike | None = None) -> "BallOutline":
        """The cone through rays that touch the ball, by linear least squares.

        A ray of unit length q touches the ball where q.axis = cos(half angle), so q.(axis / cos) = 1 is linear.

        Args:
            rays: (n, 3) toward points of the contour, camera frame, n >= 3.
            weights: (n,) how much each counts; all the same by default.
        """
        q = np.asarray(rays, float)
        q = q / np.linalg.norm(q, axis=1, keepdims=True)
        w = np.ones(len(q)) if weights is None else np.sqrt(np.asarray(weights, float))
        scaled = np.linalg.lstsq(q * w[:, None], w, rcond=None)[0]
        length = float(np.linalg.norm(scaled))
        # noise can make a tiny cone's cosine exceed 1
        return cls(scaled / length, float(np.arccos(np.clip(1.0 / length, -1.0, 1.0 - 1e-12))))

    @classmethod
    def through_circle(cls, camera: Camera, center_px: ArrayLike, radius_px: float) -> "BallOutline":
        """The cone whose picture is nearest to a circle.

        Args:
            camera: lens included.
            center_px: (2,) centre of the circle [px].
            radius_px: its radius [px].
        """
        angle = np.linspace(0.0, 2.0 * np.pi, 64, endpoint=False)
        circle = np.asarray(center_px, float) + radius_px * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        return cls.through_rays(camera_rays(camera, circle))

    def contour_rays(self, count: int) -> Array:
        """Unit rays (count, 3) that touch the ball, evenly about the axis, camera frame."""
        return self.rays_at(np.full(count, self.half_angle_rad), np.linspace(0.0, 2.0 * np.pi, count, endpoint=False))

    def rays_at(self, from_axis_rad: ArrayLike, around_axis_rad: ArrayLike) -> Array:
        """Unit rays (..., 3) by their angle from the axis and their angle around it."""
        first, second = self._across()
        away, around = np.asarray(from_axis_rad, float)[..., None], np.asarray(around_axis_rad, float)[..., None]
        sideways = np.cos(around) * first + np.sin(around) * second
        return np.cos(away) * self.axis + np.sin(away) * sideways

    def polar(self, vectors: ArrayLike) -> tuple[Array, Array]:
        """Angle from the axis and angle around it [rad] of vectors (..., 3), camera frame; inverse of `rays_at`."""
        v = np.asarray(vectors, float)
        first, second = self._across()
        x, y, along = v @ first, v @ second, v @ self.axis
        return np.arctan2(np.hypot(x, y), along), np.arctan2(y, x)

    def circle_px(self, camera: Camera) -> tuple[Array, float]:
        """Centre (2,) and mean radius of the contour in the picture [px]."""
        contour = project_rays(camera, self.contour_rays(64))
        center = contour.mean(axis=0)
        return center, float(np.linalg.norm(contour - center, axis=1).mean())

    def distance_mm(self, radius_mm: float) -> float:
        """How far the centre of a ball of this radius is from the camera [mm]."""
        return radius_mm / float(np.sin(self.half_angle_rad))

    def resting_radius_mm(self, camera_from_probe: Pose, plane_z_mm: float) -> float:
        """Radius of the ball if it rests on the plane z = plane_z_mm of the probe frame [mm].

        Raises:
            BallError: no ball on that plane looks like this: it would be as high as the camera, or behind it.
        """
        upward = float((camera_from_probe.rotation.T @ self.axis)[2])
        sine = float(np.sin(self.half_angle_rad))
        # centre at height: camera_z + distance * upward = plane + distance * sine
        distance = (camera_from_probe.camera_centre_mm[2] - plane_z_mm) / max(sine - upward, 1e-12)
        if not 0.0 < distance < 1e6:
            raise BallError(
                "the circle cannot be a ball that rests on the sheet's plane; check the circle, or give --radius-mm"
            )
        return distance * sine

    def _across(self) -> tuple[Array, Array]:
        helper = np.eye(3)[int(np.argmin(np.abs(self.axis)))]
        first = np.cross(self.axis, helper)
        first = first / np.linalg.norm(first)
        return first, np.cross(self.axis, first)


@dataclass(frozen=True, slots=True)
class Reflections:
    """Where the light of given directions is seen on the ball."""

    rays: Array
    """(n, 3) unit rays from the camera to the points that reflect it, camera frame."""
    seen: NDArray[np.bool_]
    """(n,) False where the ball's rim or its back would have to reflect it: `rays` then end at the rim."""
    magnification: Array
    """(n,) solid angle in the picture per solid angle of light; small near the rim."""


class MirrorGeometry:
    """Which direction of distant light each point of a mirrored ball shows, and back.

    Everything happens in the plane through camera, centre and light: a normal at the angle alpha from the line to the
    camera is seen at gamma from the axis and shows light at beta from the line to the camera,
    gamma = atan2(r sin alpha, 1 - r cos alpha), beta = 2 alpha + gamma, r the sine of the outline's half angle.
    Beta grows with alpha, so its inverse is a table.
    """

    def __init__(self, outline: BallOutline, rim_share: float = 1.0) -> None:
        """
        Args:
            outline: the ball in the picture.
            rim_share: how far from the axis the picture is believed, relative to the contour, in (0, 1].
        """
        self._outline = outline
        sine = float(np.sin(outline.half_angle_rad))
        # dense toward the rim, where beta grows fastest with gamma
        alpha = (np.pi / 2.0 - outline.half_angle_rad) * np.sin(np.linspace(0.0, np.pi / 2.0, 4096))
        gamma = np.arctan2(sine * np.sin(alpha), 1.0 - sine * np.cos(alpha))
        inside = gamma <= max(rim_share * outline.half_angle_rad, gamma[2])
        self._alpha, self._gamma = alpha[inside], gamma[inside]
        self._beta = 2.0 * self._alpha + self._gamma
        self._magnification = self._magnifications()

    @property
    def widest_rad(self) -> float:
        """Largest angle from the line to the camera at which light is seen [rad]; pi would be all around."""
        return float(self._beta[-1])

    def reflections(self, directions: ArrayLike) -> Reflections:
        """Where light from directions is seen.

        Args:
            directions: (n, 3) unit vectors toward the light, camera frame.
        """
        behind, around = self._outline.polar(directions)
        beta = np.pi - behind
        gamma = np.interp(beta, self._beta, self._gamma)
        return Reflections(
            rays=self._outline.rays_at(gamma, around),
            seen=beta <= self._beta[-1],
            magnification=np.interp(beta, self._beta, self._magnification),
        )

    def surface(self, rays: ArrayLike) -> tuple[Array, Array]:
        """What rays meet.

        Args:
            rays: (n, 3) from the camera, camera frame, within the outline.

        Returns:
            Unit normals (n, 3) and unit directions (n, 3) toward the light that is reflected there, camera frame.
        """
        gamma, around = self._outline.polar(rays)
        alpha = np.interp(gamma, self._gamma, self._alpha)
        beta = np.interp(gamma, self._gamma, self._beta)
        return self._outline.rays_at(np.pi - alpha, around), self._outline.rays_at(np.pi - beta, around)

    def _magnifications(self) -> Array:
        # areas of rings rather than derivatives: finite at the axis too
        ring = np.diff(np.cos(self._gamma)) / np.diff(np.cos(self._beta))
        middle = 0.5 * (self._beta[1:] + self._beta[:-1])
        return np.interp(self._beta, middle, ring)


def camera_rays(camera: Camera, pixels: ArrayLike) -> Array:
    """Unit rays (n, 3) of pixels (n, 2), camera frame."""
    rays = np.column_stack([camera.rays(pixels), np.ones(len(np.atleast_2d(pixels)))])
    return rays / np.linalg.norm(rays, axis=1, keepdims=True)


def project_rays(camera: Camera, rays: ArrayLike) -> Array:
    """Pixels (n, 2) of rays (n, 3), camera frame."""
    return camera.project(_CAMERA_FRAME, rays)
