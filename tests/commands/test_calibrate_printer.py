"""A printer's profile from photographs or typed values."""

import cv2
import numpy as np
import pytest

from arlight.color import encoded_from_linear
from arlight.commands.calibrate_printer import run
from arlight.commands.options.calibrate_printer import CalibratePrinterOptions
from arlight.errors import OutputError, ProbeError
from arlight.probe.assembly import Print
from arlight.probe.printer_profile import load_profile
from arlight.probe.wedge import wedge_dots, wedge_shares

VALUES = tuple(Print(dot_gain=0.1, solid=0.04).tone(wedge_shares()).tolist())
FILM_VALUES = tuple(Print(dot_gain=0.05).tone(wedge_shares()).tolist())


@pytest.fixture
def photo(tmp_path):
    """A scan of a wedge of 300 dpi."""
    coverage = cv2.GaussianBlur(wedge_dots(300).astype(np.float32), (0, 0), 3.0)
    light = cv2.resize(0.7 * Print(dot_gain=0.1, solid=0.04).tone(coverage), None, fx=0.5, fy=0.5)
    cv2.imwrite(str(tmp_path / "scan.png"), np.round(255.0 * encoded_from_linear(light)).astype(np.uint8))
    return tmp_path / "scan.png"


def test_photograph_gives_a_profile(photo, tmp_path, capsys):
    output = tmp_path / "printer.json"
    assert run(CalibratePrinterOptions(photo, output=output)) == 0
    profile = load_profile(output)
    assert (profile.dpi, profile.film) == (300, None)
    assert profile.paper.dot_gain == pytest.approx(0.1, abs=4e-3)
    printed = capsys.readouterr().out
    assert "paper: dot gain" in printed
    assert "film: not measured" in printed


def test_film_is_added_to_a_profile(photo, tmp_path):
    output = tmp_path / "printer.json"
    run(CalibratePrinterOptions(photo, output=output))
    paper = load_profile(output).paper
    run(CalibratePrinterOptions(film_values=FILM_VALUES, dpi=300, update=output, output=output))
    profile = load_profile(output)
    assert profile.paper == paper
    assert profile.film.dot_gain == pytest.approx(0.05, abs=1e-3)


def test_typed_values_of_both_media(tmp_path):
    output = tmp_path / "printer.json"
    run(CalibratePrinterOptions(values=VALUES, film_values=FILM_VALUES, dpi=1200, output=output))
    profile = load_profile(output)
    assert profile.dpi == 1200
    assert profile.paper.dot_gain == pytest.approx(0.1, abs=1e-3)
    assert profile.film.dot_gain == pytest.approx(0.05, abs=1e-3)


def refused(options, tmp_path, message, kind=ProbeError):
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    with pytest.raises(kind, match=message):
        run(options)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_what_does_not_fit_together_is_refused(photo, tmp_path):
    output = tmp_path / "printer.json"
    refused(CalibratePrinterOptions(output=output), tmp_path, "nothing to measure")
    refused(CalibratePrinterOptions(values=VALUES, output=output), tmp_path, "--values: give the resolution")
    refused(CalibratePrinterOptions(values=VALUES[:9], dpi=600, output=output), tmp_path, "found 9")
    refused(CalibratePrinterOptions(photo, values=VALUES, dpi=300, output=output), tmp_path, "give one of them")
    refused(CalibratePrinterOptions(photo, dpi=600, output=output), tmp_path, "of 300 dpi, found 600 dpi")
    refused(CalibratePrinterOptions(photo, output=photo), tmp_path, "would overwrite this input", OutputError)
    falling = tuple(np.where(np.isclose(wedge_shares(), 8 / 13), 0.1, VALUES))
    refused(CalibratePrinterOptions(values=falling, dpi=600, output=output), tmp_path, "not monotone")
    run(CalibratePrinterOptions(values=VALUES, dpi=600, output=output))
    another = CalibratePrinterOptions(film_values=FILM_VALUES, dpi=300, update=output, output=output)
    refused(another, tmp_path, "profile is of 600 dpi, found 300 dpi")
