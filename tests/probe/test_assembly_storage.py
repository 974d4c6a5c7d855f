"""Calibrations on disk: round trip, and files that are not one."""

import json

import numpy as np
import pytest

from arlight.errors import OutputError, ProbeError
from arlight.probe.assembly import Assembly, BlockCorrections, Print, Registration
from arlight.probe.assembly_storage import load_assembly, load_vignetting, save_assembly

SHEET = Assembly(
    film=Print(Registration((0.02, -0.03), 0.1, 1.001), 0.08, 0.05, 0.02),
    paper=Print(Registration((0.1, 0.04), -0.3, 0.999), 0.1, -0.02, 0.04),
    glass_scale=1.02,
)
BLOCKS = BlockCorrections(np.array([1.01, 0.98]), np.array([0.001, 0.0]), np.array([0.97, 1.02]), np.array([2.0, -1.5]))


def test_what_is_saved_is_read(tmp_path):
    path = tmp_path / "sheet.calibration.json"
    save_assembly(SHEET, path, {"paper_x_mm": 0.001}, (-0.1, 0.02, 0.0))
    assert load_assembly(path, 2) == SHEET
    assert load_vignetting(path) == (-0.1, 0.02, 0.0)
    assert json.loads(path.read_text())["standard_deviations"] == {"paper_x_mm": 0.001}


def test_block_corrections_are_kept(tmp_path):
    path = tmp_path / "sheet.calibration.json"
    save_assembly(Assembly(blocks=BLOCKS), path)
    read = load_assembly(path, 2).blocks
    for name in ("gain", "offset", "modulation", "phase_deg"):
        np.testing.assert_array_equal(getattr(read, name), getattr(BLOCKS, name))
    with pytest.raises(ProbeError, match=r"gain.*3 blocks.*2 numbers"):
        load_assembly(path, 3)


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"format": "arlight-probe"}, "format"),
        ({"version": 2}, "version"),
        ({"glass_scale": 5}, "glass_scale"),
        ({"glass_scale": "thick"}, "glass_scale"),
        ({"film": {}}, "film"),
        ({"paper": 3}, "paper"),
    ],
)
def test_other_files_are_refused_by_name(tmp_path, change, named):
    path = tmp_path / "x.json"
    save_assembly(SHEET, path)
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    with pytest.raises(ProbeError, match=named) as refused:
        load_assembly(path, 2)
    assert str(path) in str(refused.value)


def test_missing_files_and_folders_are_refused(tmp_path):
    with pytest.raises(ProbeError, match=r"none\.json"):
        load_assembly(tmp_path / "none.json", 2)
    with pytest.raises(OutputError, match="cannot be written"):
        save_assembly(SHEET, tmp_path / "no" / "folder.json")
