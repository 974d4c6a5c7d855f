"""A ChArUco board: its corners in pictures, and the page to print it from.

Its rows are odd in number: OpenCV changed where the board begins for even ones, and a board of one kind that is read as
the other gives a calibration that is wrong without a word.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas

from arlight.calibration.camera.camera_fit import TargetView
from arlight.errors import CameraError
from arlight.probe.pages import PAGE_MM, PRINT_MARGIN_MM, Paper

Array = NDArray[np.float64]

FEWEST_CORNERS = 8
_DICTIONARY = "DICT_5X5_250"
_MARKER_SHARE = 0.6
"""Side of a marker, relative to its square's; smaller than is usual, so that corners are seen by themselves."""
_MOST_MARKERS = 250
_TITLE_MM = 12.0
_LARGEST_SEARCH_PX = 1600.0


@dataclass(frozen=True, slots=True)
class CharucoBoard:
    """A chessboard with ArUco markers in its white squares."""

    columns: int = 10
    """Squares across, at least 3."""
    rows: int = 7
    """Squares down, odd, at least 3."""
    square_mm: float = 25.0
    """Side of a square as it was printed [mm]."""

    def __post_init__(self) -> None:
        if self.columns < 3 or self.rows < 3 or self.rows % 2 == 0:
            raise CameraError(
                f"the board needs 3 columns or more and an odd number of rows, 3 or more; found {self.columns} x "
                f"{self.rows}: OpenCV reads boards with even rows in two ways"
            )
        if self.columns * self.rows > 2 * _MOST_MARKERS or not 0.0 < self.square_mm < 1e4:
            raise CameraError(
                f"the board must have at most {2 * _MOST_MARKERS} squares of a positive size, found {self.columns} x "
                f"{self.rows} of {self.square_mm:g} mm"
            )

    @property
    def size_mm(self) -> tuple[float, float]:
        """Width and height [mm]."""
        return self.columns * self.square_mm, self.rows * self.square_mm

    @property
    def corners_mm(self) -> Array:
        """((columns - 1) (rows - 1), 2) inner corners, row by row from the top left; centre 0, x right, y up [mm]."""
        x = (np.arange(1, self.columns) - self.columns / 2.0) * self.square_mm
        y = (self.rows / 2.0 - np.arange(1, self.rows)) * self.square_mm
        return np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)

    def opencv(self) -> Any:
        """OpenCV's own board."""
        dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, _DICTIONARY))
        size = (self.columns, self.rows)
        return cv2.aruco.CharucoBoard(size, self.square_mm, _MARKER_SHARE * self.square_mm, dictionary)

    def is_black(self, column: int, row: int) -> bool:
        """Whether a square is black; the top left one is."""
        return (column + row) % 2 == 0


class BoardDetector:
    """Finds a board's corners in pictures."""

    def __init__(self, board: CharucoBoard) -> None:
        """Prepare for a board."""
        self._board = board
        self._detector = cv2.aruco.CharucoDetector(board.opencv())

    def detect(self, luma: NDArray[np.uint8], name: str) -> TargetView | None:
        """The corners in a picture; None where fewer than eight are seen, or all in one line.

        Args:
            luma: (h, w) luma codes.
            name: of the picture.
        """
        scale = min(1.0, _LARGEST_SEARCH_PX / max(luma.shape))
        small = luma if scale == 1.0 else cv2.resize(luma, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
        corners, ids, _, _ = self._detector.detectBoard(np.ascontiguousarray(small, np.uint8))
        if ids is None or len(ids) < FEWEST_CORNERS:
            return None
        rows = np.ravel(ids)
        points = self._board.corners_mm[rows]
        if np.linalg.matrix_rank(points - points[0], tol=0.1 * self._board.square_mm) < 2:
            return None
        pixels = (np.asarray(corners, float).reshape(-1, 2) + 0.5) / scale - 0.5
        return TargetView(name, points, _refined(luma, points, pixels, self._board.square_mm))


def _refined(luma: NDArray[np.uint8], points_mm: Array, pixels: Array, square_mm: float) -> Array:
    """Corners to a fraction of a pixel, each in a window that holds nothing but its own saddle."""
    distance = np.linalg.norm(pixels[:, None] - pixels, axis=2)
    neighbours = np.linalg.norm(points_mm[:, None] - points_mm, axis=2)
    beside = (neighbours > 0.0) & (neighbours < 1.1 * square_mm)
    nearest = np.min(np.where(beside, distance, np.inf), axis=1)
    nearest = np.where(np.isfinite(nearest), nearest, np.median(distance))
    # the markers begin a fifth of a square from the corner, and the blur carries them farther
    half = int(np.clip(0.2 * np.min(nearest) - 1.5, 2, 10))
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 50, 1e-4)
    start = np.ascontiguousarray(pixels[:, None], np.float32)
    found = cv2.cornerSubPix(np.ascontiguousarray(luma), start, (half, half), (-1, -1), criteria)
    refined = np.asarray(found, float).reshape(-1, 2)
    moved = np.linalg.norm(refined - pixels, axis=1, keepdims=True)
    return np.where(moved < half, refined, pixels)


def write_board(board: CharucoBoard, path: Path, paper: Paper) -> None:
    """Write the board as a page at true size, in vectors.

    Args:
        board: what to print.
        path: of the PDF.
        paper: page, used in landscape.

    Raises:
        CameraError: the board does not fit the page.
        OSError: the file cannot be written.
    """
    height, width = PAGE_MM[paper]
    board_width, board_height = board.size_mm
    room = width - 2.0 * PRINT_MARGIN_MM, height - 2.0 * PRINT_MARGIN_MM - _TITLE_MM
    if board_width > room[0] or board_height > room[1]:
        raise CameraError(
            f"the board of {board_width:g} x {board_height:g} mm does not fit {paper.upper()}, which has room for "
            f"{room[0]:g} x {room[1]:g} mm; choose fewer or smaller squares"
        )
    # invariant: the same board gives the same file
    canvas = Canvas(str(path), pagesize=(width * mm, height * mm), invariant=1)
    canvas.setTitle("arlight camera calibration board")
    left, top = (width - board_width) / 2.0, (height - _TITLE_MM + board_height) / 2.0
    side = board.square_mm
    for row in range(board.rows):
        for column in range(board.columns):
            if board.is_black(column, row):
                canvas.rect((left + column * side) * mm, (top - (row + 1) * side) * mm, side * mm, side * mm, 0, 1)
    markers = canvas.beginPath()
    for number, corners in enumerate(board.opencv().getObjPoints()):
        _add_marker(markers, board, number, left + float(corners[0][0]), top - float(corners[0][1]))
    # one path, one fill: no seams between black modules
    canvas.drawPath(markers, stroke=0, fill=1)
    _draw_title(canvas, board, paper)
    canvas.showPage()
    canvas.save()


def _draw_title(canvas: Canvas, board: CharucoBoard, paper: Paper) -> None:
    height, width = PAGE_MM[paper]
    canvas.setFont("Helvetica", 8)
    canvas.drawCentredString(
        width / 2.0 * mm,
        (height - PRINT_MARGIN_MM - 4.0) * mm,
        f"arlight calibrate camera   {board.columns} x {board.rows} squares of {board.square_mm:g} mm   PRINT AT 100 % "
        f"({paper.upper()}, actual size): {board.columns} squares must measure {board.size_mm[0]:g} mm; glue it to "
        "something flat",
    )


def _add_marker(path: Any, board: CharucoBoard, number: int, left: float, top: float) -> None:
    """Add the black modules of a marker, its top left corner at a place on the page [mm]."""
    dictionary = board.opencv().getDictionary()
    size = int(dictionary.markerSize) + 2
    modules = dictionary.generateImageMarker(number, size, borderBits=1) == 0
    side = _MARKER_SHARE * board.square_mm / size
    for row, column in np.argwhere(modules):
        path.rect((left + column * side) * mm, (top - (row + 1) * side) * mm, side * mm, side * mm)
