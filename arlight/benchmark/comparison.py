"""Planar sheet, mirrored ball and matte ball under the same light, one 8-bit picture each: how well each relights."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.benchmark.ball_scene import Finish, SurroundingLight
from arlight.benchmark.figures import FigureError
from arlight.benchmark.matte_ball import harmonics, matte_ball_light
from arlight.benchmark.probe_scene import MATTE_REFLECTANCE, MIRROR_REFLECTANCE, LitScene, ProbeScene
from arlight.benchmark.relit_objects import RelitObjects
from arlight.benchmark.sheet_light import SheetLight
from arlight.calibration.ball.ball_capture import CapturedBall, CaptureSettings, capture_ball
from arlight.calibration.ball.ball_outline import BallOutline
from arlight.calibration.ball.mirror_ball import MapGrid
from arlight.calibration.ball.photographs import Photograph
from arlight.environment import Environment

Array = NDArray[np.float64]

METHODS = ("planar sheet", "mirrored ball", "matte ball", "mirrored ball, bracketed")
"""The last needs several pictures: it tells what clipping costs the mirrored ball."""
_ROWS = 96
_SUBSAMPLES = 3


@dataclass(frozen=True, slots=True, eq=False)
class ComparedLight:
    """One light as every probe saw it."""

    name: str
    """Of the captured light."""
    true: NDArray[np.float32]
    """(rows, 2 rows, 3) radiance of the light around the scene, table included."""
    estimated: dict[str, NDArray[np.float32]]
    """The same by every method."""
    errors: dict[str, Array]
    """(materials,) relighting error by every method."""
    clipped_share: float
    """Share of the mirrored ball's picture that clips in the single picture."""
    photographs: dict[Finish, NDArray[np.uint8]]
    """(h, w, 3) the single pictures of the balls."""


class Comparison:
    """Compares probes light by light.

    Args:
        scene: sheet and camera.
    """

    def __init__(self, scene: ProbeScene) -> None:
        self._scene = scene
        self.objects = RelitObjects(MapGrid(_ROWS))
        grid = self.objects.grid
        self._directions = grid.directions().reshape(-1, 3)
        self._fine = grid.directions(_SUBSAMPLES)
        self._sheet = SheetLight(scene.probe, grid)

    def compare(self, lights: Sequence[tuple[str, Environment]]) -> Iterator[ComparedLight]:
        """Measure every light with every probe.

        Args:
            lights: captured lights with their names.

        Raises:
            FigureError: a probe cannot be measured under a light.
        """
        for name, environment in lights:
            yield self._compare(self._scene.lit(environment, name))

    def _compare(self, lit: LitScene) -> ComparedLight:
        true = self._true_map(lit.light)
        mirror_picture = self._scene.with_ball(lit, "mirror")
        mirror_shot = self._scene.photograph(mirror_picture)
        matte_shot = self._scene.photograph(self._scene.with_ball(lit, "matte"))
        mirrored = self._captured([mirror_shot], "mirror")
        bracketed = self._captured(self._scene.bracket(mirror_picture), "mirror")
        matte = matte_ball_light(self._captured([matte_shot], "matte").picture, MATTE_REFLECTANCE)
        estimated = {
            METHODS[0]: self._by_sheet(lit),
            METHODS[1]: mirrored.picture.light(_ROWS, MIRROR_REFLECTANCE).radiance,
            METHODS[2]: (harmonics(self._directions) @ matte).reshape(true.shape).astype(np.float32),
            METHODS[3]: bracketed.picture.light(_ROWS, MIRROR_REFLECTANCE).radiance,
        }
        return ComparedLight(
            name=lit.name,
            true=true,
            estimated=estimated,
            errors={method: self.objects.errors(radiance, true) for method, radiance in estimated.items()},
            clipped_share=mirrored.clipped_share,
            photographs={"mirror": mirror_shot.encoded, "matte": matte_shot.encoded},
        )

    def _true_map(self, light: SurroundingLight) -> NDArray[np.float32]:
        fine = light.radiance(self._fine)
        rows = fine.shape[0] // _SUBSAMPLES
        blocks = fine.reshape(rows, _SUBSAMPLES, 2 * rows, _SUBSAMPLES, 3)
        return blocks.mean(axis=(1, 3)).astype(np.float32)

    def _by_sheet(self, lit: LitScene) -> NDArray[np.float32]:
        lighting = self._scene.estimate(self._scene.photograph(lit.sheet_picture))
        if lighting is None:
            raise FigureError(f"{lit.name}: the sheet was not found in its own picture; choose another environment")
        return self._sheet.radiance(lighting)

    def _captured(self, photographs: list[Photograph], finish: Finish) -> CapturedBall:
        """The ball where it is known to stand; its contour is still taken from the picture."""
        scene, ball = self._scene, self._scene.ball(finish)
        center = scene.pose.transform(ball.center_mm)
        distance = float(np.linalg.norm(center))
        outline = BallOutline(center / distance, float(np.arcsin(ball.radius_mm / distance)))
        (x, y), radius_px = outline.circle_px(scene.camera)
        settings, circle = CaptureSettings(allow_clipped=True), (float(x), float(y), radius_px)
        return capture_ball(photographs, scene.probe, scene.camera, 1.0, settings, circle)
