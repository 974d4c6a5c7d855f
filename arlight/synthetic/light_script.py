"""Light that changes over time: keyed environments and linear cross-fades between them.

Radiance is linear, so between two keys the picture and the true coefficients are the same linear mixture: the truth of
every frame is exact, whatever the distance of the keys.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from arlight.environment import Environment, blend
from arlight.errors import ArlightError
from arlight.optics import Slab

ScriptName = Literal["still", "turn", "switch", "fade"]
SCRIPTS: tuple[ScriptName, ...] = get_args(ScriptName)


class LightState(NamedTuple):
    """The light at one moment: (1 - share) of one key and share of another."""

    first: int
    """Number of the first key."""
    second: int
    """Number of the second key."""
    share: float
    """Share of the second, 0 to 1."""


@dataclass(frozen=True, slots=True)
class LightScript:
    """Which light shines when."""

    environment: Environment
    """The light at the start."""
    name: ScriptName = "still"
    """`still`; `turn`: turns about the zenith; `switch`: a second light goes on at once; `fade`: it goes on slowly."""
    turn_deg_per_s: float = 10.0
    """Rate of `turn`, counter-clockwise from above [deg/s]."""
    second: Environment | None = None
    """Environment that `switch` and `fade` add to the first."""
    change_s: float = 2.5
    """When the second light begins to go on [s]."""
    fade_s: float = 1.0
    """How long `fade` takes [s]."""
    key_deg: float = 3.0
    """Distance of the keys of `turn` [deg]."""

    def __post_init__(self) -> None:
        if self.name not in SCRIPTS:
            raise ArlightError(f"unknown light script {self.name!r}; choose one of {', '.join(SCRIPTS)}")
        if self.name in ("switch", "fade") and self.second is None:
            raise ArlightError(f"the light script {self.name!r} needs a second environment, found none")
        if not np.isfinite(self.turn_deg_per_s):
            raise ArlightError(f"turn_deg_per_s must be finite, found {self.turn_deg_per_s}")
        if not (self.fade_s > 0.0 and self.key_deg > 0.0):
            raise ArlightError(f"fade_s and key_deg must be positive, found {self.fade_s} and {self.key_deg}")

    def state(self, time_s: float) -> LightState:
        """The light at a time [s] since the start."""
        match self.name:
            case "still":
                return LightState(0, 0, 0.0)
            case "turn":
                turned = self.turn_deg_per_s * time_s / self.key_deg
                first = int(np.floor(turned))
                return LightState(first, first + 1, float(turned - first))
            case "switch":
                key = int(time_s >= self.change_s)
                return LightState(key, key, 0.0)
            case "fade":
                return LightState(0, 1, float(np.clip((time_s - self.change_s) / self.fade_s, 0.0, 1.0)))

    def key(self, number: int) -> Environment:
        """The environment of a key."""
        if self.name == "turn":
            return self.environment.rotated(np.deg2rad(self.key_deg) * number)
        if number == 0 or self.second is None:
            return self.environment
        return blend(self.environment, self.second, 0.5).scaled(2.0)

    def scaled(self, exposure: float) -> "LightScript":
        """The same script with all radiance multiplied by `exposure`."""
        second = None if self.second is None else self.second.scaled(exposure)
        return LightScript(
            self.environment.scaled(exposure),
            self.name,
            self.turn_deg_per_s,
            second,
            self.change_s,
            self.fade_s,
            self.key_deg,
        )

    def brightest_irradiance(self) -> float:
        """Irradiance of an open upward-facing plane in its brightest channel under the brightest key."""
        # turning about the zenith does not change it
        keys = (0, 1) if self.name in ("switch", "fade") else (0,)
        return max(float(self.key(number).irradiance().max()) for number in keys)


class TrueLight:
    """True coefficients of a script's light at any time."""

    def __init__(self, script: LightScript, slab: Slab, frequencies: NDArray[np.int64]) -> None:
        """
        Args:
            script: the light, in exposed units.
            slab: the glass that the light passes.
            frequencies: (k, 2) integers.
        """
        self._script = script
        self._key_coefficients = lru_cache(maxsize=8)(lambda number: script.key(number).coefficients(slab, frequencies))

    def coefficients(self, time_s: float) -> NDArray[np.complex128]:
        """(k, 3) true coefficients at a time [radiance * sr]."""
        first, second, share = self._script.state(time_s)
        truth = self._key_coefficients(first)
        if share == 0.0:
            return truth
        return (1.0 - share) * truth + share * self._key_coefficients(second)


def exposure_for(script: LightScript, paper_reflectance: float, white: float) -> float:
    """Factor on the radiance at which white paper in the open is recorded as `white` in its brightest channel.

    Args:
        script: the light before exposure.
        paper_reflectance: of the unprinted paper.
        white: wanted linear value, 1 is full scale.

    Raises:
        ArlightError: the light is black.
    """
    radiance = paper_reflectance * script.brightest_irradiance() / np.pi
    if not radiance > 0.0:
        raise ArlightError("the environment is black above the horizon; choose one that lights the sheet")
    return white / radiance
