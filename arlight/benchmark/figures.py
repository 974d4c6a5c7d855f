"""What the paper's figures 6 to 8 show, measured here: coefficients by the sheet beside those by the mirrored ball.

Source: paper, section 3.2, figures 6 (a first light), 7 (another one) and 8 (higher orders).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.benchmark.probe_scene import MIRROR_REFLECTANCE, LitScene, ProbeScene
from arlight.calibration.ball.ball_capture import capture_ball
from arlight.environment import Environment
from arlight.errors import ArlightError
from arlight.estimation.lighting import Lighting
from arlight.fourier import frequency_order
from arlight.optics import Slab

Complex = NDArray[np.complex128]

MAP_ROWS = 256


class FigureError(ArlightError):
    """A figure that cannot be made of what was given."""


@dataclass(frozen=True, slots=True, eq=False)
class LightFigure:
    """One captured light as sheet and ball see it."""

    name: str
    """Of the captured light."""
    photograph: NDArray[np.uint8]
    """(h, w, 3) the one picture from which the sheet's estimate is made."""
    slab: Slab
    """Glass of the sheet."""
    estimate: Lighting
    """By the sheet, of one picture."""
    ball: Complex
    """(k, 3) coefficients by the mirrored ball, of a bracket."""
    truth: Complex
    """(k, 3) coefficients of the captured light itself."""
    pictures: int
    """Pictures in the ball's bracket."""
    environment: Environment
    """The captured light, exposed."""
    ball_environment: Environment
    """The light as the ball showed it."""

    def errors(self, coefficients: Complex) -> NDArray[np.float64]:
        """(order + 1,) error of each order: rms over coefficients and channels, relative to |L~_0|."""
        order = frequency_order(self.estimate.frequencies)
        level = np.sqrt(np.mean(np.abs(self.truth[0]) ** 2))
        squares = np.abs(coefficients - self.truth) ** 2
        return np.array([np.sqrt(np.mean(squares[order == n])) for n in range(order.max() + 1)]) / level


def measure_figures(scene: ProbeScene, lights: Sequence[tuple[str, Environment]]) -> Iterator[LightFigure]:
    """Photograph sheet and mirrored ball together under each light, and measure the light with both.

    Args:
        scene: sheet and camera.
        lights: captured lights with their names.

    Yields:
        One figure a light.

    Raises:
        FigureError: the sheet or the ball cannot be measured under a light.
    """
    for name, environment in lights:
        yield _measure(scene, scene.lit(environment, name))


def _measure(scene: ProbeScene, lit: LitScene) -> LightFigure:
    picture = scene.with_ball(lit, "mirror")
    frame = scene.photograph(picture)
    estimate = scene.estimate(frame)
    if estimate is None:
        raise FigureError(f"{lit.name}: the sheet was not found in its own picture; choose another environment")
    bracket = scene.bracket(picture)
    captured = capture_ball(bracket, scene.probe, scene.camera, 1.0)
    light = captured.picture.light(MAP_ROWS, MIRROR_REFLECTANCE)
    slab, frequencies = scene.probe.slab, scene.probe.frequencies
    return LightFigure(
        name=lit.name,
        photograph=frame.encoded,
        slab=slab,
        estimate=estimate,
        ball=light.environment.coefficients(slab, frequencies),
        truth=lit.light.environment.coefficients(slab, frequencies),
        pictures=len(bracket),
        environment=lit.light.environment,
        ball_environment=light.environment,
    )
