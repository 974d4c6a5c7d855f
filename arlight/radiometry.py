"""How a camera's encoded values stand for light: its response curve, black and clipping levels, and its noise."""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from arlight.errors import CameraError
from arlight.monotone import interpolate_monotone

Array = NDArray[np.float64]

_FEWEST_KNOTS = 5


@dataclass(frozen=True)
class Radiometry:
    """What one camera makes of light, the same for all channels. Light is relative to full scale, black removed."""

    response: tuple[float, ...]
    """Recorded signal at evenly spaced encoded values from 0 to 1: starts at 0, rises, ends at 1."""
    black: float = 0.0
    """Signal that is recorded without light, relative to full scale; in [0, 0.3)."""
    clip: float = 0.94
    """Light from which a pixel counts as clipped; in (0, 1]."""
    read_noise: float = 0.0
    """Standard deviation of the noise in the dark, in light."""
    shot_gain: float = 0.0
    """Variance of the noise per unit of light: 1 / electrons at full scale."""

    def __post_init__(self) -> None:
        knots = np.asarray(self.response, float)
        if knots.ndim != 1 or len(knots) < _FEWEST_KNOTS or not np.all(np.isfinite(knots)):
            raise CameraError(f"the radiometry's response must hold {_FEWEST_KNOTS} finite numbers or more")
        if knots[0] != 0.0 or not np.isclose(knots[-1], 1.0) or not np.all(np.diff(knots) > 0.0):
            raise CameraError(
                f"the radiometry's response must rise from 0 to 1, found {knots[0]:g} to {knots[-1]:g}"
                f"{'' if np.all(np.diff(knots) > 0.0) else ', not rising all the way'}"
            )
        if not (0.0 <= self.black < 0.3 and 0.0 < self.clip <= 1.0):
            raise CameraError(f"black must lie in [0, 0.3) and clip in (0, 1], found {self.black} and {self.clip}")
        if not (0.0 <= self.read_noise < np.inf and 0.0 <= self.shot_gain < np.inf):
            raise CameraError(f"noise must be finite and not negative, found {self.read_noise}, {self.shot_gain}")
        object.__setattr__(self, "response", tuple(float(value) for value in knots))

    @classmethod
    def of_content(cls, content: Any) -> "Radiometry":
        """From what `content` gave, as JSON has it.

        Raises:
            CameraError: a value is missing or impossible.
        """
        if not isinstance(content, dict) or "response" not in content:
            raise CameraError("radiometry must hold response, black, clip, read_noise and shot_gain")
        unknown = content.keys() - cls.__dataclass_fields__.keys()
        if unknown:
            raise CameraError(f"radiometry holds {', '.join(sorted(unknown))}, which is not known")
        try:
            values = {name: float(value) for name, value in content.items() if name != "response"}
            return cls(tuple(float(value) for value in content["response"]), **values)
        except (TypeError, ValueError) as error:
            raise CameraError(f"radiometry must hold numbers, found {error}") from error

    def content(self) -> dict[str, Any]:
        """For camera.json."""
        return {**asdict(self), "response": list(self.response)}

    def linear(self, encoded: ArrayLike) -> Array:
        """Light of encoded values (any shape, clamped to [0, 1]); below 0 where a value lies below black.

        Negative light is kept: noise around black averages to no light at all.
        """
        knots = np.linspace(0.0, 1.0, len(self.response))
        signal = interpolate_monotone(np.clip(np.asarray(encoded, float), 0.0, 1.0), knots, self.response)
        return np.asarray((signal - self.black) / (1.0 - self.black), float)

    def table(self, size: int) -> NDArray[np.float32]:
        """(size,) light of encoded values that are spread evenly from 0 to 1."""
        return self.linear(np.linspace(0.0, 1.0, size)).astype(np.float32)

    def noise_variance(self, linear: ArrayLike) -> Array:
        """Variance of one channel of one pixel that records some light, any shape."""
        light = np.asarray(linear, float)
        variance: Array = self.read_noise**2 + self.shot_gain * np.maximum(light, 0.0)
        return variance
