"""Bracketed 8-bit photographs of one still scene become linear radiance; the merge itself is OpenCV's.

Robertson's merge is the maximum-likelihood one and gives codes at both ends no weight; OpenCV's Debevec merge still
counts clipped codes and darkens lamps with them.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray

from arlight.calibration.ball.photographs import Photograph, PhotographError
from arlight.color import Transfer, linear_from_encoded

_BLACK_CODE = 4
_USABLE_CODES = (30, 225)
_LEAST_RATIO = 1.3
"""Exposures that differ by less are no bracket."""
_GREATEST_DISAGREEMENT = 1.3
"""Factor between the pictures' brightness and their stated exposures at which the exposures must be wrong."""
_FEWEST_SHARED = 200


@dataclass(frozen=True, slots=True, eq=False)
class MergedRadiance:
    """Radiance of a scene."""

    radiance: NDArray[np.float32]
    """(h, w, 3) linear RGB; 1 is full scale at the reference exposure."""
    clipped: NDArray[np.bool_]
    """(h, w) even the shortest exposure clips: the radiance is a lower bound."""
    black: NDArray[np.bool_]
    """(h, w) even the longest exposure shows nothing."""


def merge_exposures(
    photographs: Sequence[Photograph], reference_s: float, transfer: Transfer = "srgb"
) -> MergedRadiance:
    """Merge the pictures of one camera position.

    Args:
        photographs: of one size, still camera, still scene; a single one is taken as it is.
        reference_s: the exposure at which radiance 1 is full scale [s].
        transfer: how the camera encodes light.

    Raises:
        PhotographError: the pictures differ in size, or their exposures are impossible, all alike or not the true ones.

    Source: Robertson, Borman and Stevenson, Estimation-theoretic approach to dynamic range enhancement, 2003.
    """
    _check_sizes(photographs)
    exposures = np.array([photograph.exposure_s for photograph in photographs])
    _check_exposures(photographs, exposures)
    linear = linear_from_encoded(np.arange(256) / 255.0, transfer)
    _check_brightness(photographs, linear)
    order = np.argsort(exposures)
    images = [np.ascontiguousarray(photographs[k].encoded) for k in order]
    relative = (exposures[order] / reference_s).astype(np.float32)
    response = np.repeat(linear.reshape(256, 1, 1), 3, axis=2)
    merged = np.asarray(cv2.createMergeRobertson().process(images, times=relative, response=response), np.float32)
    shortest, longest = images[0], images[-1]
    clipped, black = np.asarray(shortest == 255), np.asarray(longest < _BLACK_CODE)
    merged = np.where(clipped, np.float32(1.0 / relative[0]), merged)
    # dark codes have hardly any weight, the darkest none
    merged = np.where(black, linear[longest] / relative[-1], merged)
    # no picture has a usable code: between two exposures too far apart
    lost = ~np.isfinite(merged) | ((merged <= 0.0) & ~black)
    merged = np.where(lost, linear[longest] / relative[-1], merged)
    return MergedRadiance(merged.astype(np.float32), np.any(clipped, axis=-1), np.all(black, axis=-1))


def _check_sizes(photographs: Sequence[Photograph]) -> None:
    if not photographs:
        raise PhotographError("no photograph was given; give at least one picture of the ball beside the sheet")
    first = photographs[0]
    for other in photographs[1:]:
        if other.encoded.shape != first.encoded.shape:
            raise PhotographError(
                f"{other.name}: is {_size(other)}, {first.name} is {_size(first)}; pictures of one bracket must have "
                "one size: give the camera's own files, neither cropped nor turned"
            )


def _check_exposures(photographs: Sequence[Photograph], exposures: NDArray[np.float64]) -> None:
    for photograph in photographs:
        if not (np.isfinite(photograph.exposure_s) and photograph.exposure_s > 0.0):
            raise PhotographError(
                f"{photograph.name}: exposure must be a positive time, found {photograph.exposure_s} s"
            )
    if len(exposures) > 1 and exposures.max() < _LEAST_RATIO * exposures.min():
        raise PhotographError(
            f"{len(exposures)} pictures have the same exposure, {exposures.min():g} to {exposures.max():g} s; a "
            "bracket needs exposures that differ, such as 1/1000, 1/60 and 1/4 s; if they do, state them (--exposures)"
        )


def _check_brightness(photographs: Sequence[Photograph], linear: NDArray[np.float32]) -> None:
    """Refuse exposures that the pictures' own brightness contradicts: wrong order, automatic gain."""
    ordered = sorted(photographs, key=lambda photograph: photograph.exposure_s)
    low, high = _USABLE_CODES
    for shorter, longer in pairwise(ordered):
        dark, bright = shorter.encoded[::2, ::2], longer.encoded[::2, ::2]
        shared = (dark > low) & (dark < high) & (bright > low) & (bright < high)
        if np.count_nonzero(shared) < _FEWEST_SHARED:
            continue
        ratio = float(np.median(linear[bright[shared]] / linear[dark[shared]]))
        stated = longer.exposure_s / shorter.exposure_s
        if not 1.0 / _GREATEST_DISAGREEMENT < ratio / stated < _GREATEST_DISAGREEMENT:
            raise PhotographError(
                f"{longer.name} is {ratio:.2f} times as bright as {shorter.name}, their exposures say {stated:.2f}; "
                "check the order of --exposures, and photograph with fixed sensitivity, aperture and tone curve"
            )


def _size(photograph: Photograph) -> str:
    return f"{photograph.encoded.shape[1]}x{photograph.encoded.shape[0]}"
