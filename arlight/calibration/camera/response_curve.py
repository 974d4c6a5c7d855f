"""The camera's response curve, black level, clipping level and noise, from the grey wedge on the sheet's frame.

The steps reflect known shares of what white paper reflects. How the light falls over the frame is not known, only that
it does so smoothly; it is solved for, in every picture and channel, and eliminated. What is left determines the curve's
deviation from the footage's own transfer curve, and what is recorded without light.

Source: Grossberg and Nayar, Modeling the space of camera response functions, 2004 (a base curve and few deviations).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from arlight.calibration.camera.paper_samples import PaperSamples
from arlight.color import Transfer, linear_from_encoded
from arlight.errors import CalibrationError

Array = NDArray[np.float64]

KNOTS = 65
_DEVIATIONS = 3
_DEVIATION_PRIOR = 0.15
_BLACK_PRIOR = 0.02
_ENCODED_STDDEV = 0.002
"""What a patch's mean encoded value is worth: half a code of eight bits. Codecs leave flat patches a single code, so
that pictures of one exposure repeat each other's error: all of them together are worth no more than one."""
_HIGHEST_ENCODED = 0.97
"""Patches beyond are taken for clipped; codecs ring around white."""
_LOWEST_ENCODED = 0.01
_LEAST_PIXELS = 12
_FEWEST_STEPS = 5
_LEAST_WHITE = 0.5
"""Encoded value that white paper must reach at least once for the curve to be measured where it matters."""


@dataclass(frozen=True, slots=True)
class Patch:
    """The mean of one channel over a wedge step or over a part of the white paper, in one picture."""

    group: int
    """Number of the picture and channel; patches of one group share their light."""
    at_mm: tuple[float, float]
    """Its middle on the sheet [mm]."""
    reflectance: float
    """Relative to white paper."""
    encoded: float
    """Mean encoded value, 1 is full scale."""


@dataclass(frozen=True, slots=True)
class ResponseFit:
    """A measured curve."""

    response: tuple[float, ...]
    """Signal at evenly spaced encoded values, from 0 to 1."""
    black: float
    """Signal recorded without light, relative to full scale."""
    black_stddev: float
    """Its standard deviation."""
    deviation: float
    """Largest deviation from the footage's own curve within the measured range, relative to the signal."""
    residual: float
    """Rms of what the curve leaves over, in encoded values."""
    covered: tuple[float, float]
    """Darkest and brightest encoded value that it rests on; beyond, the curve is continued."""


def patches_of(samples: Sequence[PaperSamples]) -> list[Patch]:
    """Means of the wedge's steps and of the paper's parts in some pictures; clipped and tiny ones left out."""
    patches = []
    for number, picture in enumerate(samples):
        labels = np.where(picture.patch >= 0, picture.patch, 1000 + picture.sector)
        for label in np.unique(labels):
            own = labels == label
            if np.count_nonzero(own) < _LEAST_PIXELS:
                continue
            x, y = picture.points_mm[own].mean(axis=0)
            reflectance = float(picture.reflectance[own][0])
            for channel in range(3):
                # the median over a patch does not mind a scratch or a hair
                encoded = float(np.mean(_central(picture.encoded[own, channel])))
                if _LOWEST_ENCODED < encoded < _HIGHEST_ENCODED:
                    patches.append(Patch(3 * number + channel, (float(x), float(y)), reflectance, encoded))
    return patches


def fit_response(patches: Sequence[Patch], transfer: Transfer, half_sheet_mm: float) -> ResponseFit:
    """The curve, relative to the footage's own, that makes the wedge's steps reflect what they do.

    Args:
        patches: from one or several pictures; several exposures cover more of the curve.
        transfer: curve that the footage says it has.
        half_sheet_mm: half the sheet's longer side [mm].

    Raises:
        CalibrationError: too few steps are seen, white is too dark, or no rising curve explains the steps.
    """
    groups = _usable(patches)
    encoded = np.concatenate([[patch.encoded for patch in group] for group in groups])
    grounds = [_light_basis(group, transfer, half_sheet_mm) for group in groups]
    splits = np.cumsum([len(group) for group in groups])[:-1]
    stddev = _ENCODED_STDDEV * np.sqrt(len(groups) / 3.0)
    weight = 1.0 / (_slope(encoded, transfer) * stddev)

    def residuals(x: Array) -> Array:
        signal = weight * (_signal(encoded, x[:-1], transfer) - x[-1])
        parts = np.split(signal, splits)
        left = [part - basis @ (basis.T @ part) for part, basis in zip(parts, grounds, strict=True)]
        return np.concatenate([*left, x[:-1] / _DEVIATION_PRIOR, x[-1:] / _BLACK_PRIOR])

    # no camera records less than nothing in the dark
    start, lowest = np.append(np.zeros(_DEVIATIONS), 1e-4), np.append(np.full(_DEVIATIONS, -np.inf), 0.0)
    found = least_squares(residuals, start, bounds=(lowest, np.inf), loss="soft_l1", f_scale=3.0)
    error = np.asarray(found.fun[: len(encoded)], float)
    covariance = np.linalg.inv(found.jac.T @ found.jac)
    response = _signal(np.linspace(0.0, 1.0, KNOTS), found.x[:-1], transfer)
    if not np.all(np.diff(response) > 0.0):
        raise CalibrationError(
            "the camera's response cannot be measured: no rising curve explains the grey wedge's steps; check that the "
            "probe.json is this sheet's, that no shadow or reflection lies on a part of the frame, and film it brighter"
        )
    covered = float(encoded.min()), float(encoded.max())
    return ResponseFit(
        tuple(response), float(found.x[-1]), float(np.sqrt(covariance[-1, -1])),
        _change(covered, found.x[:-1], transfer), float(np.sqrt(np.mean(error**2))) * stddev, covered,
    )  # fmt: skip


def _change(covered: tuple[float, float], deviations: Array, transfer: Transfer) -> float:
    """Largest relative change of the footage's curve within a range, a common factor apart."""
    inside = np.linspace(*covered, 200)
    share = _signal(inside, deviations, transfer) / _signal(inside, np.zeros(_DEVIATIONS), transfer)
    return float(np.max(np.abs(share / np.median(share) - 1.0)))


def _central(values: Array) -> Array:
    """The middle half of some values."""
    low, high = np.quantile(values, [0.25, 0.75])
    middle: Array = values[(values >= low) & (values <= high)]
    return middle


def _usable(patches: Sequence[Patch]) -> list[list[Patch]]:
    """Patches by group, of groups with enough of the wedge.

    Raises:
        CalibrationError: no group has.
    """
    by_group: dict[int, list[Patch]] = {}
    for patch in patches:
        by_group.setdefault(patch.group, []).append(patch)
    steps = {number: len({p.reflectance for p in group if p.reflectance < 0.999}) for number, group in by_group.items()}
    groups = [group for number, group in sorted(by_group.items()) if steps[number] >= _FEWEST_STEPS]
    if not groups:
        raise CalibrationError(
            f"the camera's response cannot be measured: at least {_FEWEST_STEPS} steps of the grey wedge must be seen "
            f"unclipped in a picture, found {max(steps.values(), default=0)}; film the whole frame of the sheet, large "
            "in the picture, without clipping white"
        )
    brightest = max(patch.encoded for group in groups for patch in group)
    if brightest < _LEAST_WHITE:
        raise CalibrationError(
            f"the camera's response cannot be measured: white paper reaches {100.0 * brightest:.0f} % of full scale, "
            f"at least {100.0 * _LEAST_WHITE:.0f} % are needed; film the sheet in brighter light or expose longer"
        )
    return groups


def _light_basis(group: Sequence[Patch], transfer: Transfer, half_sheet_mm: float) -> Array:
    """(n, 6) orthonormal basis of what smooth light on the steps can look like, weighted as the residuals are."""
    x, y = np.array([patch.at_mm for patch in group]).T / half_sheet_mm
    encoded, ink = (np.array([getattr(patch, name) for patch in group]) for name in ("encoded", "reflectance"))
    surface = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)
    weighted = surface * (ink / (_slope(encoded, transfer) * _ENCODED_STDDEV))[:, None]
    basis, strengths, _ = np.linalg.svd(weighted, full_matrices=False)
    held: Array = basis[:, strengths > 1e-6 * strengths[0]]
    return held


def _signal(encoded: Array, deviations: Array, transfer: Transfer) -> Array:
    """The footage's curve, changed: by a power, and by two smooth factors that are 1 at full scale."""
    base = linear_from_encoded(encoded, transfer).astype(float)
    dark = 1.0 - encoded
    power = np.log((base + 0.003) / 1.003)
    return base * np.exp(deviations[0] * power + deviations[1] * dark + deviations[2] * 4.0 * dark * encoded)


def _slope(encoded: Array, transfer: Transfer) -> Array:
    """Derivative of the footage's curve."""
    step = 1e-3
    above, below = (linear_from_encoded(encoded + sign * step, transfer).astype(float) for sign in (1, -1))
    return np.maximum((above - below) / (2.0 * step), 0.02)
