"""The wedge has every tone twice, where it says, with known coverage."""

import numpy as np
import pytest

from arlight.errors import OutputError
from arlight.probe.pages import PAPERS, largest_sheet_mm
from arlight.probe.resolution import RESOLUTIONS
from arlight.probe.tone import ToneCurve
from arlight.probe.wedge import (
    GAP_MM,
    MARKER_MM,
    PATCH_MM,
    marker_corners_mm,
    marker_ids,
    patch_centers_mm,
    wedge_dots,
    wedge_shares,
    write_wedge_folder,
)


def shares_of(dots, dpi):
    """Share left unprinted inside each patch."""
    rows, columns = dots.shape
    half = PATCH_MM / 2.0 - 0.2
    found = []
    for x, y in patch_centers_mm():
        left, right = (round(columns / 2 + (x + side) * dpi / 25.4) for side in (-half, half))
        top, bottom = (round(rows / 2 - (y + side) * dpi / 25.4) for side in (half, -half))
        found.append(dots[top:bottom, left:right].mean())
    return np.array(found)


@pytest.mark.parametrize("dpi", [300, 600])
def test_patches_have_their_shares_and_paper_around_them(dpi):
    dots = wedge_dots(dpi)
    np.testing.assert_allclose(shares_of(dots, dpi), wedge_shares(), atol=3e-3)
    rows, columns = dots.shape
    for x, y in patch_centers_mm():
        for side in (-1.0, 1.0):
            column = round(columns / 2 + (x + side * (PATCH_MM + GAP_MM) / 2.0) * dpi / 25.4)
            row = round(rows / 2 - y * dpi / 25.4)
            reach = round(1.4 * dpi / 25.4)
            assert np.all(dots[row - reach : row + reach, column - reach : column + reach])


def test_every_tone_stands_opposite_itself():
    shares, places = wedge_shares(), patch_centers_mm()
    np.testing.assert_array_equal(shares, shares[::-1])
    np.testing.assert_allclose(places, -places[::-1], atol=1e-12)
    assert len(set(shares.tolist())) == len(shares) // 2
    assert {0.0, 1.0} <= set(shares.tolist())
    # light that falls off along x or y does not look like a tone curve
    assert np.all(np.abs(np.corrcoef(np.stack([shares[:14], *places[:14].T]))[0, 1:]) < 0.5)


def test_compensated_tones_print_as_their_shares():
    tone = ToneCurve((0.0, 0.5, 1.0), (0.1, 0.35, 1.0))
    printed = tone.print_of(shares_of(wedge_dots(300, tone), 300))
    np.testing.assert_allclose(printed, 0.1 + 0.9 * wedge_shares(), atol=6e-3)


def test_pages_of_different_resolutions_have_different_fiducials():
    numbers = [number for dpi in RESOLUTIONS for number in marker_ids(dpi)]
    assert len(set(numbers)) == len(numbers)
    assert max(numbers) < 50


def test_page_takes_it(tmp_path, read_pdf):
    reach = 2.0 * np.abs(marker_corners_mm()).reshape(-1, 2).max(axis=0)
    assert np.all(np.diff(marker_corners_mm()[0, :2], axis=0)[0] == [MARKER_MM, 0.0])
    for paper in PAPERS:
        assert np.all(reach < largest_sheet_mm(paper))
        path = write_wedge_folder(tmp_path / paper, 300, paper)
        pdf = read_pdf(path)
        assert pdf.pages == 1
        assert "300 dpi" in pdf.drawing
        assert "28: 100 % ink" in pdf.drawing
        assert [entry.name for entry in path.parent.iterdir()] == ["wedge.pdf"]


def test_what_cannot_be_written_is_refused(tmp_path):
    (tmp_path / "taken").write_text("mine")
    with pytest.raises(OutputError, match="taken"):
        write_wedge_folder(tmp_path / "taken", 300, "a4")
    (tmp_path / "wedge.pdf").mkdir()
    with pytest.raises(OutputError, match=r"wedge\.pdf: is a folder"):
        write_wedge_folder(tmp_path, 300, "a4")
