"""Skies that are worked out instead of captured: light so soft that a lower order suffices."""

import numpy as np

from arlight.environment import Environment, blend
from arlight.synthetic.captured import load_environment

_ROWS = 64
_GROUND = 0.1
"""Radiance from below the horizon, relative to the zenith's."""
_HAZE = 0.85
"""Share of the overcast sky in a hazy one, by irradiance."""


def sky(name: str) -> Environment:
    """Light by its name.

    Args:
        name: `overcast`, the CIE's standard overcast sky; `haze`, the same with a bit of the captured hall showing
            through; or a captured environment.

    Raises:
        EnvironmentMapError: there is no light of that name.
    """
    match name:
        case "overcast":
            return _overcast()
        case "haze":
            clear, clouds = (_of_unit_irradiance(each) for each in (load_environment("hall"), _overcast()))
            return blend(clear, clouds, _HAZE)
        case _:
            return load_environment(name)


def _overcast() -> Environment:
    """Three times as bright at the zenith as at the horizon, the same all round.

    Source: Moon and Spencer 1942; ISO 15469, sky type 16.
    """
    cosine = np.cos((np.arange(_ROWS) + 0.5) * np.pi / _ROWS)
    radiance = np.where(cosine > 0.0, (1.0 + 2.0 * cosine) / 3.0, _GROUND)
    return Environment(np.broadcast_to(radiance[:, None, None], (_ROWS, 2 * _ROWS, 3)).astype(np.float32))


def _of_unit_irradiance(environment: Environment) -> Environment:
    return environment.scaled(1.0 / float(environment.irradiance().mean()))
