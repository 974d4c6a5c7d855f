"""`arlight probe` for a bilevel printer: dots, wedge, profile, and what is to be expected of them."""

import numpy as np
import pytest

from arlight.probe.assembly import Print
from arlight.probe.printer_profile import PrinterProfile, save_profile
from arlight.probe.storage import load_probe
from arlight.probe.tone import ToneCurve

SMALL = ("--order", 1, "--glass-mm", 1.5)


@pytest.fixture
def profile(tmp_path):
    tone = ToneCurve.of_print(Print(dot_gain=0.15, solid=0.05))
    save_profile(PrinterProfile(300, paper=tone, film=tone), tmp_path / "printer.json")
    return tmp_path / "printer.json"


def test_dots_are_printed_and_the_error_to_expect_is_stated(arlight, tmp_path, read_pdf):
    done = arlight("probe", *SMALL, "--dpi", 300, "--output", "sheet")
    assert done.status == 0, done.errors
    assert "Predicted error of the light's coefficients by order, relative to |L_0|, single frame: 0: " in done.output
    # a tenth of dot gain that nobody took out
    assert "mostly by dot gain" in done.output
    assert "--wedge" in done.output
    probe = load_probe(tmp_path / "sheet" / "probe.json")
    assert probe.pixels_per_mm == pytest.approx(300 / 25.4)
    guide = read_pdf(tmp_path / "sheet" / "guide.pdf")
    assert guide.pages == 1
    for words in ("300 dpi", "This printer", "Predicted error"):
        assert words in guide.drawing
    assert "encoded for sRGB" not in guide.drawing
    (dots,) = read_pdf(tmp_path / "sheet" / "bottom.pdf").images
    np.testing.assert_allclose(np.array(dots) / 300 * 25.4, probe.sheet_mm, atol=1e-9)


def test_a_profile_gives_the_resolution_and_takes_the_dot_gain_out(arlight, tmp_path, profile, read_pdf):
    plain = arlight("probe", *SMALL, "--dpi", 300, "--output", "plain")
    done = arlight("probe", *SMALL, "--printer-profile", profile, "--output", "sheet")
    assert (plain.status, done.status) == (0, 0), done.errors
    assert "Dot gain is compensated (film 15 %, paper 15 %)" in done.output
    assert "mostly by dot gain" not in done.output
    (less,) = read_pdf(tmp_path / "plain" / "bottom.pdf").images.values()
    (more,) = read_pdf(tmp_path / "sheet" / "bottom.pdf").images.values()
    # stripes get 7 % fewer printed dots; they are a tenth of this small sheet
    assert int.from_bytes(more, "big").bit_count() > 1.003 * int.from_bytes(less, "big").bit_count()


def test_finer_printers_keep_rasters_of_handy_size(arlight, tmp_path, read_pdf):
    assert arlight("probe", "--order", 1, "--glass-mm", 0.8, "--dpi", 1200, "--output", "sheet").status == 0
    probe = load_probe(tmp_path / "sheet" / "probe.json")
    assert probe.pixels_per_mm == pytest.approx(600 / 25.4)
    (dots,) = read_pdf(tmp_path / "sheet" / "top.pdf").images
    np.testing.assert_allclose(np.array(dots) / 1200 * 25.4, probe.sheet_mm, atol=1e-9)


def test_wedge_is_all_that_is_written_for_it(arlight, tmp_path, profile, read_pdf):
    done = arlight("probe", "--wedge", "--output", "sheet")
    assert done.status == 0, done.errors
    assert [path.name for path in (tmp_path / "sheet").iterdir()] == ["wedge.pdf"]
    assert "600 dpi" in read_pdf(tmp_path / "sheet" / "wedge.pdf").drawing
    assert arlight("probe", "--wedge", "--printer-profile", profile, "--output", "check").status == 0
    drawing = read_pdf(tmp_path / "check" / "wedge.pdf").drawing
    assert "compensated" in drawing
    assert "300 dpi" in drawing


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--dpi", 300, "--glass-mm", 1.0), "300 dpi is too coarse for order 5"),
        (("--dpi", 600, "--printer-profile", "printer.json"), "profile is of 300 dpi, found 600 dpi"),
        (("--printer-profile", "absent.json"), "absent.json: no such file"),
        (("--printer-profile", "text.json"), "text.json: expected JSON"),
        (("--dpi", 300, "--order", 8), "the largest order that fits"),
        (("--wedge", "--output", "text.json"), "text.json"),
    ],
)
@pytest.mark.usefixtures("profile")
def test_what_cannot_be_printed_is_refused(arlight, tmp_path, arguments, message):
    (tmp_path / "text.json").write_text("precious")
    done = arlight("probe", *arguments)
    assert done.status == 1
    assert message in done.errors
    assert not (tmp_path / "probe").exists()
    assert (tmp_path / "text.json").read_text() == "precious"
