"""From the picture of a mirrored ball to the light of all directions, in the frame of the sheet beside it.

Light is taken as distant. A map's texel is the mean of the picture over the texel's solid angle, so lamps keep their
energy wherever on the ball they are seen.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from arlight.calibration.ball.ball_outline import BallError, BallOutline, MirrorGeometry, project_rays
from arlight.camera import Camera, Pose
from arlight.environment import Environment

Array = NDArray[np.float64]

RIM_PX = 1.5
"""Width of the ball's rim that is not believed: background shines into its pixels [px]."""
_SAMPLES_PER_PX = 1.5
_MOST_SAMPLES_PER_SIDE = 8
_UNSEEN_WEIGHT = 1e-6


@dataclass(frozen=True, slots=True)
class MapGrid:
    """A latitude-longitude grid in the probe frame, row 0 at the zenith."""

    rows: int
    """Number of rows, even; there are twice as many columns."""

    def __post_init__(self) -> None:
        if self.rows < 8 or self.rows % 2:
            raise BallError(f"an environment needs an even number of rows, at least 8; found {self.rows}")

    def directions(self, per_side: int = 1) -> Array:
        """Unit vectors (rows * per_side, columns * per_side, 3) toward the light, evenly within every texel."""
        count = self.rows * per_side
        theta = ((np.arange(count) + 0.5) * np.pi / count)[:, None]
        phi = ((np.arange(2 * count) + 0.5) * np.pi / count)[None, :]
        up = np.broadcast_to(np.cos(theta), (count, 2 * count))
        return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), up], axis=-1)

    @property
    def solid_angle_sr(self) -> Array:
        """(rows, 1) solid angle of a texel [sr]."""
        edges = np.cos(np.arange(self.rows + 1) * np.pi / self.rows)
        return ((edges[:-1] - edges[1:]) * np.pi / self.rows)[:, None]


@dataclass(frozen=True, slots=True, eq=False)
class BallLight:
    """The light that one or several pictures of a ball show."""

    radiance: NDArray[np.float32]
    """(rows, 2 rows, 3) linear radiance, probe frame; where nothing was seen, what the rim shows nearest to it."""
    weight: NDArray[np.float32]
    """(rows, 2 rows) solid angle in the pictures per solid angle of light; 0 where nothing was seen."""
    clipped: NDArray[np.float32]
    """(rows, 2 rows) share of the texel that is a lower bound, because the picture clipped there; 0 to 1."""

    @property
    def environment(self) -> Environment:
        """The light as an environment."""
        return Environment(self.radiance)

    @property
    def coverage(self) -> float:
        """Share of the upper hemisphere's solid angle that was seen, 0 to 1."""
        return self._upper_share(self.weight > 0.0)

    @property
    def clipped_share(self) -> float:
        """Share of the upper hemisphere's solid angle where the light is only known to be at least so bright."""
        return self._upper_share(self.clipped)

    def unseen_irradiance_share(self) -> float:
        """Share of the irradiance on the sheet's plane that comes from where nothing was seen, as it was filled in."""
        grid = MapGrid(len(self.radiance))
        received = self.radiance.mean(axis=-1) * np.maximum(grid.directions()[..., 2], 0.0) * grid.solid_angle_sr
        return float(received[self.weight <= 0.0].sum() / max(received.sum(), 1e-30))

    def _upper_share(self, values: ArrayLike) -> float:
        grid = MapGrid(len(self.radiance))
        upper = grid.rows // 2
        mean_over_columns = np.asarray(values, float)[:upper].mean(axis=1, keepdims=True)
        return float(np.sum(mean_over_columns * grid.solid_angle_sr[:upper]) / np.sum(grid.solid_angle_sr[:upper]))


@dataclass(frozen=True, slots=True, eq=False)
class BallPicture:
    """A picture of the ball, and where ball and sheet are in it."""

    radiance: NDArray[np.float32]
    """(h, w, 3) linear radiance of the picture."""
    clipped: NDArray[np.bool_]
    """(h, w) where it is only a lower bound."""
    camera: Camera
    """That took it."""
    camera_from_probe: Pose
    """Pose of the sheet [mm]."""
    outline: BallOutline
    """The ball, camera frame."""

    def light(self, rows: int = 256, reflectance: ArrayLike = 1.0) -> BallLight:
        """The light around the ball.

        Args:
            rows: of the map; its columns are twice as many.
            reflectance: of the ball, one number or one a channel, in (0, 1].

        Raises:
            BallError: rows or reflectance are impossible.
        """
        mirror = np.broadcast_to(np.asarray(reflectance, float), (3,))
        if not np.all((mirror > 0.0) & (mirror <= 1.0)):
            raise BallError(f"the ball's reflectance must lie in (0, 1], found {', '.join(f'{v:g}' for v in mirror)}")
        grid = MapGrid(rows)
        _, radius_px = self.outline.circle_px(self.camera)
        geometry = MirrorGeometry(self.outline, 1.0 - RIM_PX / radius_px)
        per_side = self._samples_per_side(rows, radius_px)
        directions = grid.directions(per_side).reshape(-1, 3) @ self.camera_from_probe.rotation.T
        reflections = geometry.reflections(directions)
        place = project_rays(self.camera, reflections.rays).astype(np.float32).reshape(rows * per_side, -1, 2)
        picture = np.dstack([self.radiance, self.clipped.astype(np.float32)])
        seen = reflections.seen.reshape(place.shape[:2])
        # remap takes tables of up to 32767 pixels a side
        sampled = cv2.remap(picture, place[..., 0], place[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        weight = np.where(seen, reflections.magnification.reshape(seen.shape), 0.0)
        texels = _averaged(np.dstack([sampled, weight]), per_side)
        complete = _averaged(seen[..., None].astype(np.float32), per_side)[..., 0] > 0.5
        return BallLight(
            radiance=(texels[..., :3] / mirror).astype(np.float32),
            weight=np.where(complete, texels[..., 4], 0.0).astype(np.float32),
            clipped=texels[..., 3],
        )

    def _samples_per_side(self, rows: int, radius_px: float) -> int:
        """Samples along a texel's side so that none of the picture's pixels is passed over, but toward the rim."""
        # a quarter of the normal's turn: sine of the normal 1 is the radius
        px_per_rad = radius_px / 2.0
        return int(np.clip(np.ceil(_SAMPLES_PER_PX * px_per_rad * np.pi / rows), 2, _MOST_SAMPLES_PER_SIDE))


def merge_views(lights: Sequence[BallLight]) -> BallLight:
    """One light of several views of the same scene: each direction mostly from the view that shows it largest.

    Args:
        lights: on one grid, at one reference exposure.
    """
    weights = np.stack([light.weight.astype(float) for light in lights])
    # where no view saw anything, all fill in alike
    share = weights + _UNSEEN_WEIGHT * weights[weights > 0.0].min(initial=1.0)
    share /= share.sum(axis=0)
    return BallLight(
        radiance=np.einsum("vrc,vrck->rck", share, np.stack([light.radiance for light in lights])).astype(np.float32),
        weight=weights.sum(axis=0).astype(np.float32),
        clipped=np.einsum("vrc,vrc->rc", share, np.stack([light.clipped for light in lights])).astype(np.float32),
    )


def _averaged(samples: NDArray[np.float32] | Array, per_side: int) -> NDArray[np.float32]:
    """Means over squares of per_side samples."""
    rows, columns, channels = samples.shape
    blocks = samples.reshape(rows // per_side, per_side, columns // per_side, per_side, channels)
    return blocks.mean(axis=(1, 3), dtype=np.float64).astype(np.float32)
