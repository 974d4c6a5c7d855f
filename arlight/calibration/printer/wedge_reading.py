"""A printer's tone curve from a photograph or scan of the printed wedge, or from typed values."""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from arlight.color import linear_from_encoded
from arlight.errors import ProbeError
from arlight.probe.resolution import RESOLUTIONS, Dpi
from arlight.probe.tone import ToneCurve
from arlight.probe.wedge import (
    DICTIONARY,
    GAP_MM,
    PATCH_MM,
    marker_corners_mm,
    patch_centers_mm,
    wedge_shares,
)

Array = NDArray[np.float64]

_PX_PER_MM = 8.0
"""Resolution of the straightened page."""
_MARGIN_MM = 2.0
"""Of a patch, and of the paper beside it, what blur may reach."""
_SMALLEST_PATCH_PX = 12.0
_CLIPPED, _DARKEST = 0.985, 0.25
"""Encoded values of unprinted paper between which an exposure is of use."""
_MOST_UNEVEN = 0.06
"""Difference of two patches of one tone, relative to paper, that even light and an even print do not exceed."""


@dataclass(frozen=True, slots=True)
class WedgeReading:
    """What a picture of the wedge shows."""

    dpi: Dpi
    """Resolution that it was printed with."""
    values: Array
    """(28,) reflectance or transmittance of each patch, relative to the unprinted medium beside it."""


def tone_of_values(values: ArrayLike) -> ToneCurve:
    """The tone curve of the wedge's 28 measured values, in the page's order, on any linear scale.

    Raises:
        ProbeError: not 28 values, or they tell no tone curve.
    """
    measured = np.asarray(values, float).ravel()
    shares = wedge_shares()
    if len(measured) != len(shares):
        raise ProbeError(
            f"the wedge has {len(shares)} patches, numbered on the page: expected as many values, found {len(measured)}"
        )
    return ToneCurve.of_wedge(shares, measured)


def read_wedge(path: Path | str) -> WedgeReading:
    """Read the patches from a photograph or a scan.

    The picture's values are taken for sRGB, as cameras and scanners write them with their corrections off.

    Raises:
        ProbeError: the file is no picture, its fiducials are not all in it, or it is too small, clipped, too dark or
            unevenly lit; the message names the file.
    """
    path = Path(path)
    if not path.is_file():
        raise ProbeError(f"{path}: no such file; a photograph or scan of the printed wedge is expected")
    try:
        image = cv2.imread(str(path), cv2.IMREAD_COLOR)
    except cv2.error:
        image = None
    if image is None:
        raise ProbeError(f"{path}: not a picture that can be read; give a PNG, JPEG or TIFF of the printed wedge")
    try:
        return wedge_in_picture(np.asarray(image[..., ::-1], np.uint8))
    except ProbeError as error:
        raise ProbeError(f"{path}: {error}") from error


def wedge_in_picture(image: NDArray[np.uint8]) -> WedgeReading:
    """The wedge in an encoded picture (h, w, 3), RGB; raises as `read_wedge`."""
    dpi, corners_px = _find(np.asarray(cv2.cvtColor(np.ascontiguousarray(image), cv2.COLOR_RGB2GRAY), np.uint8))
    page = _straightened(image, corners_px)
    patch = _sampled(page, patch_centers_mm(), PATCH_MM - 2.0 * _MARGIN_MM, PATCH_MM - 2.0 * _MARGIN_MM)
    aside = np.array([(PATCH_MM + GAP_MM) / 2.0, 0.0])
    white = [
        _sampled(page, patch_centers_mm() + side * aside, GAP_MM - 2.0 * _MARGIN_MM, PATCH_MM - 2.0 * _MARGIN_MM)
        for side in (-1.0, 1.0)
    ]
    level = 0.5 * (white[0] + white[1])
    _check_exposure(level)
    values = patch / level
    _check_evenness(values)
    return WedgeReading(dpi, values)


def _find(grey: NDArray[np.uint8]) -> tuple[Dpi, Array]:
    """Resolution of the page, and its fiducials' corners (4, 4, 2) [px]."""
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, DICTIONARY))
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    found, indices, _ = cv2.aruco.ArucoDetector(dictionary, parameters).detectMarkers(grey)
    numbers = [] if indices is None else [int(number) for number in np.ravel(indices)]
    seen = {number: np.asarray(corners, float).reshape(4, 2) for number, corners in zip(numbers, found, strict=False)}
    for i, dpi in enumerate(RESOLUTIONS):
        page = range(4 * i, 4 * i + 4)
        if all(number in seen for number in page):
            return dpi, np.stack([seen[number] for number in page])
    raise ProbeError(
        f"expected the wedge's four corner markers, found {len(seen)} of them; take the picture again with the whole "
        "page sharp in it (film: not mirrored, before an evenly bright white)"
    )


def _straightened(image: NDArray[np.uint8], corners_px: Array) -> Array:
    """The page seen from straight above, linear grey light."""
    side_px = np.median(np.linalg.norm(np.roll(corners_px, -1, axis=1) - corners_px, axis=2))
    corners_mm = marker_corners_mm()
    scale = side_px / float(np.linalg.norm(corners_mm[0, 1] - corners_mm[0, 0]))
    if scale * PATCH_MM < _SMALLEST_PATCH_PX:
        raise ProbeError(
            f"a patch is {scale * PATCH_MM:.0f} pixels wide and {_SMALLEST_PATCH_PX:g} are needed; photograph it closer"
        )
    size = _page_px()
    target = _page_position(corners_mm.reshape(-1, 2))
    homography, _ = cv2.findHomography(corners_px.reshape(-1, 2), target)
    # light is averaged, not codes; and before it is resampled, so that dots that the picture shows keep their mean
    linear = linear_from_encoded(image.astype(np.float32) / 255.0).mean(axis=2)
    shrink = scale / _PX_PER_MM
    if shrink > 1.0:
        linear = cv2.GaussianBlur(linear, (0, 0), 0.4 * shrink)
    return np.asarray(cv2.warpPerspective(linear, homography, size, flags=cv2.INTER_LINEAR), float)


def _page_px() -> tuple[int, int]:
    reach = np.abs(marker_corners_mm()).reshape(-1, 2).max(axis=0) + GAP_MM
    return int(2.0 * reach[0] * _PX_PER_MM), int(2.0 * reach[1] * _PX_PER_MM)


def _page_position(points_mm: Array) -> Array:
    """Pixels (n, 2) of the straightened page."""
    width, height = _page_px()
    return points_mm * [_PX_PER_MM, -_PX_PER_MM] + [(width - 1) / 2.0, (height - 1) / 2.0]


def _sampled(page: Array, centers_mm: Array, width_mm: float, height_mm: float) -> Array:
    """(n,) means over rectangles of the straightened page."""
    half = 0.5 * _PX_PER_MM * np.array([width_mm, height_mm])
    position = _page_position(centers_mm)
    low, high = np.ceil(position - half).astype(int), np.floor(position + half).astype(int) + 1
    return np.array([page[y0:y1, x0:x1].mean() for (x0, y0), (x1, y1) in zip(low, high, strict=True)])


def _check_exposure(white: Array) -> None:
    clipped, darkest = (float(linear_from_encoded(np.float32(value))) for value in (_CLIPPED, _DARKEST))
    if white.max() > clipped:
        raise ProbeError("the unprinted paper is clipped; expose less, or scan without automatic brightness")
    if white.min() < darkest:
        raise ProbeError("the unprinted paper is too dark to compare with; expose more, or add light")


def _check_evenness(values: Array) -> None:
    half = len(values) // 2
    difference = np.abs(values[:half] - values[half:][::-1])
    worst = int(np.argmax(difference))
    if difference[worst] > _MOST_UNEVEN:
        raise ProbeError(
            f"patches {worst + 1} and {len(values) - worst} have the same ink but measure {values[worst]:.2f} and "
            f"{values[len(values) - 1 - worst]:.2f} of the paper; avoid shadows and reflections, or print again"
        )
