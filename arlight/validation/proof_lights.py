"""The lights of the proof: soft captured environments, exposed for the camera, for tests and for calibration."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from arlight.environment import Environment
from arlight.errors import EnvironmentMapError
from arlight.optics import Slab
from arlight.probe.design import Probe
from arlight.validation.filming import WHITE
from arlight.validation.soft_light import ROWS, as_stored, received_coefficients, softened

TEST_LIGHTS: dict[str, float] = {"studio": 45.0, "hall": 315.0, "forest": 120.0, "sunset": 195.0}
"""Captured environments of the test clips, and their turns about the zenith [deg]."""
KNOWN_LIGHTS: dict[str, float] = {
    "city": 75.0, "courtyard": 165.0, "apartment": 15.0, "bridge": 255.0,
    "dawn": 300.0, "lobby": 105.0, "park": 0.0, "warehouse": 180.0,
}  # fmt: skip
"""Those of the known-light calibration."""


@dataclass(frozen=True, slots=True)
class ProofLight:
    """A light that is known."""

    name: str
    """Of the captured environment."""
    environment: Environment
    """Soft, turned and exposed: 1 is the camera's full scale."""
    coefficients: NDArray[np.complex128]
    """(k, 3) L~_n below the glass as it is [radiance * sr]."""
    exposure: float
    """Factor from the captured radiance."""


def proof_light(
    name: str, turn_deg: float, folder: Path, target: Path, slab: Slab, probe: Probe, rows: int = ROWS
) -> ProofLight:
    """Soften, turn and expose a captured environment, and write it as NAME.hdr.

    Args:
        name: the file in `folder` whose name ends in it.
        turn_deg: about the zenith; rounded to whole pixels of the soft map, so that the file needs no yaw [deg].
        folder: of captured .hdr files.
        target: folder of the soft maps.
        slab: the glass as it is.
        probe: gives frequencies, and the white that is exposed for.
        rows: of the soft map.

    Raises:
        EnvironmentMapError: the environment is missing or cannot be used.
    """
    soft = softened(Environment.load(_find(name, folder)), rows=rows)
    columns = round(turn_deg / 360.0 * 2 * rows)
    turned = Environment(np.roll(soft.radiance, columns, axis=1))
    level = float(turned.coefficients(slab, [(0, 0)])[0].real.max())
    # clear film twice, the glass once more, and a tenth for what the glass returns
    seen = probe.paper_reflectance / np.pi * probe.film_transmittance**2 * float(slab.transmittance(0.8)) * 1.1
    exposure = WHITE / (seen * level)
    stored = as_stored(turned.scaled(exposure), target / f"{name}.hdr")
    coefficients = received_coefficients(stored, slab, probe.frequencies)
    return ProofLight(name, stored, np.asarray(coefficients, complex), exposure)


def _find(name: str, folder: Path) -> Path:
    found = sorted(folder.glob(f"*{name}.hdr"))
    if not found:
        raise EnvironmentMapError(f"{folder}: expected a captured environment *{name}.hdr, found none")
    return found[0]
