"""`arlight figures`: a page and its numbers."""

import json

import numpy as np
import pytest
from PIL import Image

from arlight.benchmark.comparison import METHODS
from arlight.benchmark.figures import FigureError
from arlight.benchmark.relit_objects import MATERIALS
from arlight.commands.figures import run
from arlight.commands.options.figures import FiguresOptions
from arlight.errors import EnvironmentMapError, OutputError

SMALL = {"order": 1, "size": (640, 360), "environments": ("apartment",)}


def test_the_papers_figures(tmp_path, capsys):
    assert run(FiguresOptions(tmp_path / "page.png", tmp_path / "page.json", **SMALL)) == 0
    with Image.open(tmp_path / "page.png") as page:
        assert min(page.size) > 500
        assert np.asarray(page.convert("L")).std() > 10.0
    (light,) = json.loads((tmp_path / "page.json").read_text())
    assert light["light"] == "apartment"
    # both probes see the same light; the sheet once, in 8 bits
    assert max(light["ball_error"]) < 0.02
    assert max(light["sheet_error"]) < 0.06
    assert "apartment" in capsys.readouterr().out


def test_the_comparison(tmp_path):
    done = run(FiguresOptions(tmp_path / "page.pdf", tmp_path / "page.json", compare=True, turns=1, **SMALL))
    assert done == 0
    assert (tmp_path / "page.pdf").read_bytes().startswith(b"%PDF")
    content = json.loads((tmp_path / "page.json").read_text())
    assert content["materials"] == [material.name for material in MATERIALS]
    (light,) = content["lights"]
    errors = light["errors"]
    assert set(errors) == set(METHODS)
    # a bracket sees all; one picture clips the lamps
    assert errors["mirrored ball, bracketed"][0] < 0.03
    assert light["ball_clipped"] > 0.0
    assert errors["mirrored ball"][0] > errors["planar sheet"][0]
    # a mirror on screen is what the ball is best at
    assert errors["mirrored ball"][-1] < errors["planar sheet"][-1]


@pytest.mark.parametrize(
    ("changes", "error", "message"),
    [
        ({"environments": ("nowhere",)}, EnvironmentMapError, "nowhere"),
        ({"turns": 0}, FigureError, "--turns"),
    ],
)
def test_what_cannot_be_drawn_is_refused(tmp_path, changes, error, message):
    with pytest.raises(error, match=message):
        run(FiguresOptions(tmp_path / "page.png", **(SMALL | changes)))
    assert not list(tmp_path.iterdir())


def test_other_formats_are_refused(tmp_path):
    with pytest.raises(OutputError, match="--output must end in"):
        run(FiguresOptions(tmp_path / "page.docx"))
