"""`arlight probe`: a folder with everything to print and use a sheet."""

import pytest

from arlight.probe.storage import load_probe


def test_a_sheet_as_it_was_asked_for(arlight, tmp_path):
    done = arlight(
        "probe", "--order", 1, "--glass-mm", 2.0, "--refractive-index", 1.49, "--pixels-per-mm", 6, "--output", "sheet"
    )
    assert done.status == 0, done.errors
    probe = load_probe(tmp_path / "sheet" / "probe.json")
    assert (probe.order, probe.design, probe.glass_mm, probe.refractive_index) == (1, "matched", 2.0, 1.49)
    assert "8 patterned blocks" in done.output
    for path in (tmp_path / "sheet").iterdir():
        assert f"sheet/{path.name}" in done.output


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--order", "0"], "order must lie between 1 and 8"),
        (["--order", "8", "--paper", "letter", "--pixels-per-mm", "10"], "the largest order that fits"),
        (["--glass-mm", "-1"], "glass_mm"),
        (["--refractive-index", "1"], "refractive_index"),
        (["--output", "file"], "file"),
    ],
)
def test_what_cannot_be_made_is_refused(arlight, tmp_path, arguments, message):
    (tmp_path / "file").write_text("precious")
    done = arlight("probe", "--pixels-per-mm", "6", *arguments)
    assert done.status == 1
    assert message in done.errors
    assert not list(tmp_path.glob("probe/*"))
    assert (tmp_path / "file").read_text() == "precious"
