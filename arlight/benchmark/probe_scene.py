"""Sheet and balls on a table under captured light: the pictures that a camera takes of them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.benchmark.ball_scene import Ball, Finish, SurroundingLight, with_ball
from arlight.calibration.ball.photographs import Photograph
from arlight.camera import Camera, Pose
from arlight.environment import Environment
from arlight.estimation.lighting import Lighting
from arlight.lighting_tracker import LightingTracker, TrackerSettings
from arlight.probe.design import Probe
from arlight.synthetic.light_script import LightScript, exposure_for
from arlight.synthetic.motion import CameraMotion
from arlight.synthetic.renderer import TABLE_REFLECTANCE, SheetRenderer
from arlight.synthetic.sensor import Sensor
from arlight.synthetic.settings import default_camera
from arlight.synthetic.sheet import SheetLayers
from arlight.synthetic.transport import LightTransport
from arlight.video.frame import Frame

MIRROR_REFLECTANCE, MATTE_REFLECTANCE = 0.7, 0.5
_WHITE = 0.6
_BALL_RADIUS, _GAP, _BEFORE = 0.17, 0.115, 0.16
"""Radius of the ball, its distance from the sheet and from its middle line; shares of the sheet's width."""
_TILT_DEG = 40.0
_SHEET_WIDTH_PX = 520.0
_STEP = 4.0
"""Factor between the exposures of a bracket: two stops."""
_MOST_PICTURES = 12


@dataclass(frozen=True, slots=True)
class LitScene:
    """A captured light, exposed, on the scene."""

    name: str
    """Of the captured light."""
    light: SurroundingLight
    """What falls on sheet and balls; 1 is the camera's full scale."""
    sheet_picture: NDArray[np.float32]
    """(h, w, 3) linear radiance of sheet and table, without a ball."""


class ProbeScene:
    """One sheet, one camera position, room for a ball on either side. Belongs to the thread that makes it.

    Args:
        probe: the sheet.
        camera: that films it; the default phone-like one otherwise.
        sensor: of the camera.
        seed: chooses the noise.

    Raises:
        RenderingUnavailableError: there is no headless OpenGL.
    """

    def __init__(self, probe: Probe, camera: Camera | None = None, sensor: Sensor | None = None, seed: int = 0) -> None:
        self.probe, self.camera = probe, camera or default_camera()
        self._sensor = sensor or Sensor()
        self._noise = np.random.default_rng(seed)
        layers = SheetLayers.of_probe(probe)
        self._transport = LightTransport(layers, probe.slab, 3)
        self._renderer = SheetRenderer(layers, probe.slab, self.camera)
        scale = self.camera.image_size[0] / 1280.0
        motion = CameraMotion("still", _SHEET_WIDTH_PX * scale, _TILT_DEG)
        self.pose: Pose = motion.pose(0.0, self.camera, probe.sheet_mm)

    def close(self) -> None:
        """Free the OpenGL context."""
        self._renderer.release()

    def lit(self, environment: Environment, name: str) -> LitScene:
        """The scene under a captured light, exposed so that white paper is well within the camera's range.

        Raises:
            ArlightError: the light is black.
        """
        exposed = environment.scaled(exposure_for(LightScript(environment), self.probe.paper_reflectance, _WHITE))
        self._renderer.set_light("first", exposed, self._transport.irradiance(exposed))
        return LitScene(name, SurroundingLight(exposed, TABLE_REFLECTANCE), self._renderer.render(self.pose))

    def ball(self, finish: Finish) -> Ball:
        """The ball right of the sheet, resting on the table."""
        width = self.probe.sheet_mm[0]
        radius = _BALL_RADIUS * width
        center = ((0.5 + _GAP) * width + radius, -_BEFORE * width, radius - self.probe.glass_mm)
        reflectance = MIRROR_REFLECTANCE if finish == "mirror" else MATTE_REFLECTANCE
        return Ball(center, radius, finish, reflectance)

    def with_ball(self, scene: LitScene, finish: Finish) -> NDArray[np.float32]:
        """(h, w, 3) linear radiance of the scene with a ball beside the sheet."""
        ball = self.ball(finish)
        return with_ball(scene.sheet_picture, self.camera, self.pose, ball, scene.light, self.probe.sheet_mm)

    def photograph(self, picture: NDArray[np.float32], exposure: float = 1.0) -> Photograph:
        """One 8-bit picture, exposed by a factor relative to the sheet's own exposure."""
        codes = self._sensor.expose(picture * np.float32(exposure), self.camera, self._noise)
        return Photograph(f"exposure {exposure:g}", codes, exposure)

    def bracket(self, picture: NDArray[np.float32]) -> list[Photograph]:
        """Pictures two stops apart, from one that shows the darkest corners to one in which nothing clips."""
        shortest = 0.8 / max(float(picture.max()), 1.0)
        count = int(np.ceil(np.log(_STEP / shortest) / np.log(_STEP))) + 1
        return [self.photograph(picture, _STEP ** (1 - k)) for k in range(min(count, _MOST_PICTURES))]

    def estimate(self, photograph: Photograph) -> Lighting | None:
        """What the sheet tells of one picture; None where it is not seen."""
        tracker = LightingTracker(self.probe, self.camera, TrackerSettings(order="all", filtered=False))
        return tracker.update(Frame.from_rgb(photograph.encoded)).raw


def turned(environments: Sequence[tuple[str, Environment]], turns: int) -> list[tuple[str, Environment]]:
    """Every environment at evenly spread turns about the zenith, with its name."""
    steps = [2.0 * np.pi * k / turns for k in range(turns)]
    return [(name, environment.rotated(step)) for name, environment in environments for step in steps]
