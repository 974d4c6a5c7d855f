"""The paper's own estimator: L = M V for one viewpoint, M from images under known lighting. Kept as the baseline.

V holds K block means under N lightings, the mirror reflection taken off by the nearest constant region, L the known
coefficients. Every column is scaled to L~_0 = 1, and the colour channels are lightings of their own: the sheet is grey.
With fewer lightings than coefficients M needs a ridge; leaving lightings out chooses it and tells the errors.
"""

from dataclasses import dataclass
from pathlib import Path
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from arlight.errors import CalibrationError, OutputError
from arlight.estimation.estimator import Estimate
from arlight.estimation.lighting import Lighting
from arlight.estimation.nuisance import Nuisance
from arlight.fourier import unpack_real
from arlight.probe.design import Probe
from arlight.tracking.block_layout import field_blocks
from arlight.tracking.block_means import BlockMeans

Array = NDArray[np.float64]

FORMAT = "arlight-fixed 1"
_RIDGES = 10.0 ** np.arange(-9.0, 0.5, 0.5)
"""Ridges to choose from, relative to the mean square of a column."""
_LEAST_LIGHTINGS = 2
_BLACK_FILM = ("black_white", "black_black")


@dataclass(frozen=True, slots=True, eq=False)
class FixedCalibration:
    """V and L of one viewpoint, and the ridge of M."""

    frequencies: NDArray[np.int64]
    """(k, 2) frequencies, (0, 0) first."""
    means: Array
    """V (K, n): every block's mean less its reference's, per unit of L~_0; n lightings and channels."""
    coefficients: Array
    """L (2k - 1, n): real-packed, per unit of L~_0."""
    ridge: float
    """Added to the diagonal of V'V."""
    variance: Array
    """(2k - 1,) of an estimate's error, per squared unit of L~_0, from lightings that were left out."""

    def apply(self, means: Array, seen: NDArray[np.bool_]) -> Array:
        """Packed coefficients (2k - 1, c) of block means (K, c), M V; blocks that were not seen are left out of V."""
        known = self.means[seen]
        gram = known.T @ known + self.ridge * np.eye(known.shape[1])
        return np.asarray(self.coefficients @ np.linalg.solve(gram, known.T @ means[seen]), float)

    def save(self, path: Path | str) -> None:
        """Write NAME.fixed.npz.

        Raises:
            OutputError: the file cannot be written.
        """
        try:
            with Path(path).open("wb") as file:
                np.savez_compressed(
                    file, format=FORMAT, frequencies=self.frequencies, means=self.means,
                    coefficients=self.coefficients, ridge=self.ridge, variance=self.variance,
                )  # fmt: skip
        except OSError as error:
            raise OutputError(f"{path}: the calibration cannot be written ({error.strerror})") from error

    @classmethod
    def load(cls, path: Path | str, probe: Probe) -> "FixedCalibration":
        """Read NAME.fixed.npz.

        Raises:
            CalibrationError: the file is missing, is no such calibration, or is of another sheet.
        """
        try:
            with np.load(path, allow_pickle=False) as content:
                if str(content["format"]) != FORMAT:
                    raise ValueError(f"format {content['format']}")
                names = ("frequencies", "means", "coefficients", "ridge", "variance")
                frequencies, means, coefficients, ridge, variance = (np.array(content[name]) for name in names)
        except OSError as error:
            raise CalibrationError(
                f"{path}: cannot be read; expected what `arlight calibrate known --estimator fixed` wrote"
            ) from error
        except (KeyError, ValueError, EOFError, BadZipFile) as error:
            raise CalibrationError(
                f"{path}: not a fixed calibration ({error}); expected what `arlight calibrate known --estimator fixed` "
                "wrote"
            ) from error
        blocks, size = len(field_blocks(probe)), 2 * len(probe.frequencies) - 1
        if (
            not np.array_equal(frequencies, probe.frequencies)
            or means.ndim != 2
            or (len(means), coefficients.shape) != (blocks, (size, means.shape[1]))
            or variance.shape != (size,)
        ):
            raise CalibrationError(f"{path}: is of another sheet; give the probe.json that it was made with")
        return cls(frequencies, means, coefficients, float(ridge), variance)


class FixedEstimator:
    """Estimates lighting by L = M V, right for the calibration's viewpoint alone; called as `LightingEstimator` is."""

    def __init__(self, probe: Probe, calibration: FixedCalibration) -> None:
        """Prepare for a sheet."""
        self._calibration = calibration
        self._reference = ReferenceRegions(probe)

    def estimate(
        self, means: BlockMeans, time_s: float, nuisance: Nuisance | None = None, order: int | None = None
    ) -> Estimate:
        """Lighting of one frame.

        Args:
            means: the frame's measurements; only the means are used.
            time_s: the frame's time [s].
            nuisance: passed on as it is; one matrix knows no blur.
            order: highest order that is told; the sheet's by default.
        """
        calibration = self._calibration
        packed = calibration.apply(self._reference.without_reflection(means), means.valid)
        level = np.maximum(np.abs(packed[0]), 1e-6)
        lighting = Lighting(
            calibration.frequencies,
            unpack_real(packed),
            np.multiply.outer(level**2, np.diag(calibration.variance)),
            time_s,
            float("nan"),
        )
        if order is not None:
            lighting = lighting.truncated(order)
        reflection = self._reference.reflection(means)
        return Estimate(lighting, means.values.copy(), reflection, nuisance or Nuisance.guess(), float("nan"))


class ReferenceRegions:
    """The mirror reflection as the constant regions under black film show it (paper, section 4)."""

    def __init__(self, probe: Probe) -> None:
        """Find every block's nearest regions."""
        blocks = field_blocks(probe)
        centers = np.array([block.center_mm for block in blocks], float).reshape(-1, 2)
        self._black = np.flatnonzero([block.kind in _BLACK_FILM for block in blocks])
        distance = np.linalg.norm(centers[:, None] - centers[self._black], axis=-1)
        self._nearest = np.argsort(distance, axis=1, kind="stable")

    def reflection(self, means: BlockMeans) -> Array:
        """(blocks, 3) mean of the nearest black region that was seen; 0 where there is none."""
        seen = means.valid[self._black]
        if not np.any(seen):
            return np.zeros((len(means.valid), 3))
        ranked = seen[self._nearest]
        place = self._nearest[np.arange(len(ranked)), np.argmax(ranked, axis=1)]
        return np.asarray(means.values[self._black[place], 0], float)

    def without_reflection(self, means: BlockMeans) -> Array:
        """V (blocks, 3): every block's mean less the reflection."""
        return np.asarray(means.values[:, 0] - self.reflection(means), float)


def fixed_calibration(
    probe: Probe, means: list[BlockMeans], lights: list[Array], lightings: list[int]
) -> FixedCalibration:
    """Solve L = M V in the ridge's sense.

    Args:
        probe: the sheet.
        means: measurements from one viewpoint.
        lights: (2k - 1, 3) real-packed coefficients of each measurement's light.
        lightings: number of each measurement's lighting; those of one number are left out together.

    Raises:
        CalibrationError: fewer than two lightings, or no block that was seen in all measurements.
    """
    count = len(set(lightings))
    if count < _LEAST_LIGHTINGS:
        raise CalibrationError(
            f"{count} known lighting was given; L = MV needs {_LEAST_LIGHTINGS} or more, and as many as the sheet has "
            f"coefficients ({2 * len(probe.frequencies) - 1}) to be determined"
        )
    reference = ReferenceRegions(probe)
    seen = np.all([measured.valid for measured in means], axis=0)
    if not np.any(seen):
        raise CalibrationError("no block is seen in all frames; L = MV needs one viewpoint for all lightings")
    scale = [light[0] for light in lights]
    known = np.hstack([reference.without_reflection(m) / s for m, s in zip(means, scale, strict=True)])
    known[~seen] = 0.0
    wanted = np.hstack([light / s for light, s in zip(lights, scale, strict=True)])
    group = np.repeat(lightings, 3)
    ridges = _RIDGES * float(np.mean(np.sum(known**2, axis=0)))
    residuals = [_left_out(known, wanted, group, ridge) for ridge in ridges]
    best = int(np.argmin([np.mean(residual**2) for residual in residuals]))
    variance = np.mean(residuals[best] ** 2, axis=1)
    return FixedCalibration(probe.frequencies, known, wanted, float(ridges[best]), variance)


def _left_out(known: Array, wanted: Array, group: NDArray[np.int64], ridge: float) -> Array:
    """Errors (2k - 1, n) of each lighting by the M of the others."""
    errors = np.zeros_like(wanted)
    for lighting in np.unique(group):
        out = group == lighting
        rest = known[:, ~out]
        gram = rest.T @ rest + ridge * np.eye(rest.shape[1])
        errors[:, out] = wanted[:, ~out] @ np.linalg.solve(gram, rest.T @ known[:, out]) - wanted[:, out]
    return errors
