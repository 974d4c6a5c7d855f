"""Profiles come back as they were saved, and broken ones are refused with file and field."""

import json

import pytest

from arlight.errors import OutputError, ProbeError
from arlight.probe.assembly import Print
from arlight.probe.printer_profile import PrinterProfile, load_profile, save_profile
from arlight.probe.tone import ToneCurve

PAPER, FILM = ToneCurve.of_print(Print(dot_gain=0.12, solid=0.04)), ToneCurve.of_print(Print(dot_gain=0.05), 9)


@pytest.mark.parametrize(
    "profile", [PrinterProfile(600, PAPER, FILM), PrinterProfile(300, film=FILM), PrinterProfile(1200)]
)
def test_round_trip(profile, tmp_path):
    save_profile(profile, tmp_path / "printer.json")
    assert load_profile(tmp_path / "printer.json") == profile


def test_tones_are_of_their_media():
    tones = PrinterProfile(600, PAPER, FILM).tones
    assert (tones.paper, tones.film) == (PAPER, FILM)


def test_another_printers_resolution_is_refused():
    PrinterProfile(600, PAPER).require_dpi(600)
    with pytest.raises(ProbeError, match=r"profile is of 600 dpi, found 300 dpi.*wedge at 300 dpi"):
        PrinterProfile(600, PAPER).require_dpi(300)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"format": "arlight-probe"}, "format: expected one of arlight-printer"),
        ({"version": 2}, "version"),
        ({"dpi": 601}, "dpi: expected one of 300, 360, 600, 720, 1200, found 601"),
        ({"dpi": "600"}, "dpi"),
        ({"paper": {"asked": [0, 0.5, 1]}}, r"paper\.printed"),
        ({"paper": {"asked": [0, 0.5, 1], "printed": [0.1, 1.0]}}, r"paper\.printed: expected a list of 3"),
        ({"paper": {"asked": [0, 0.5, 1], "printed": [0.5, 0.2, 1.0]}}, "paper: a tone curve must rise"),
        ({"film": {"asked": [0, 1], "printed": [0.5, "x"]}}, r"film\.printed\[1\]: expected a number"),
        ({"film": 3}, "film"),
    ],
)
def test_broken_profiles_are_refused(change, message, tmp_path):
    path = tmp_path / "printer.json"
    save_profile(PrinterProfile(600, PAPER, FILM), path)
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    with pytest.raises(ProbeError, match=rf"printer\.json: .*{message}"):
        load_profile(path)


def test_what_is_no_profile_is_refused(tmp_path):
    with pytest.raises(ProbeError, match=r"absent\.json: no such file.*calibrate printer"):
        load_profile(tmp_path / "absent.json")
    (tmp_path / "text.json").write_text("hello")
    with pytest.raises(ProbeError, match="expected JSON"):
        load_profile(tmp_path / "text.json")
    with pytest.raises(OutputError, match="choose another folder"):
        save_profile(PrinterProfile(600), tmp_path / "absent" / "printer.json")
