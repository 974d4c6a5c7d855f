"""`arlight ball`: files in, an environment and its coefficients out; what cannot be right is refused."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from arlight.benchmark.probe_scene import MIRROR_REFLECTANCE, ProbeScene
from arlight.calibration.ball.ball_outline import BallError
from arlight.calibration.ball.photographs import PhotographError
from arlight.commands.ball import run
from arlight.commands.options.ball import BallOptions
from arlight.environment import Environment
from arlight.errors import ArlightError, CameraError, OutputError, ProbeError
from arlight.probe.layout import design_probe
from arlight.probe.storage import save_probe
from arlight.synthetic.captured import load_environment
from arlight.synthetic.settings import default_camera


@dataclass(frozen=True)
class Shoot:
    folder: Path
    pictures: tuple[Path, ...]
    exposures: tuple[float, ...]
    circle: tuple[float, float, float]
    true: Environment


@pytest.fixture(scope="module")
def shoot(tmp_path_factory) -> Shoot:
    """A bracket of an order-1 sheet and a mirrored ball under a captured light; nothing may write to its folder."""
    folder = tmp_path_factory.mktemp("ball")
    camera, probe = default_camera((960, 540)), design_probe(1)
    scene = ProbeScene(probe, camera)
    try:
        lit = scene.lit(load_environment("apartment"), "apartment")
        bracket = scene.bracket(scene.with_ball(lit, "mirror"))
        center = camera.project(scene.pose, [scene.ball("mirror").center_mm])[0]
    finally:
        scene.close()
    paths = []
    for number, photograph in enumerate(bracket):
        paths.append(folder / f"{number}.png")
        Image.fromarray(photograph.encoded).save(paths[-1])
    save_probe(probe, folder / "probe.json")
    camera.save(folder / "camera.json")
    exposures = tuple(photograph.exposure_s for photograph in bracket)
    # a rough circle: its contour is refined
    circle = (float(center[0]), float(center[1]), 78.0)
    return Shoot(folder, tuple(paths), exposures, circle, lit.light.environment)


def options(shoot: Shoot, tmp_path: Path, **changes) -> BallOptions:
    settings = {
        "pictures": shoot.pictures,
        "output": tmp_path / "ball.hdr",
        "exposures": shoot.exposures,
        "reference_exposure": 1.0,
        "reflectance": (MIRROR_REFLECTANCE,),
        "rows": 64,
    }
    return BallOptions(**(settings | changes))


def test_the_light_comes_out(shoot, tmp_path, capsys):
    assert run(options(shoot, tmp_path)) == 0
    probe = design_probe(3)
    found = Environment.load(tmp_path / "ball.hdr").coefficients(probe.slab, probe.frequencies)
    true = shoot.true.coefficients(probe.slab, probe.frequencies)
    level = np.sqrt(np.mean(np.abs(true[0]) ** 2))
    assert np.sqrt(np.mean(np.abs(found - true) ** 2)) / level < 0.01
    content = json.loads((tmp_path / "ball.json").read_text())
    assert content["reference_exposure_s"] == 1.0
    assert content["upper_hemisphere_seen"] == 1.0
    printed = capsys.readouterr().out
    assert "100.0 % seen" in printed
    assert "% of its contour seen" in printed


def test_an_old_result_is_replaced_only_by_a_new_one(shoot, tmp_path):
    (tmp_path / "ball.hdr").write_bytes(b"old")
    with pytest.raises(ArlightError):
        run(options(shoot, tmp_path, circle=(1.0, 1.0, 50.0)))
    assert (tmp_path / "ball.hdr").read_bytes() == b"old"
    assert not list(tmp_path.glob("*.partial*"))


@pytest.mark.parametrize(
    ("changes", "error", "message"),
    [
        ({"pictures": ()}, PhotographError, "no picture"),
        ({"exposures": (1.0,)}, PhotographError, "--exposures: 1 times"),
        ({"exposures": None}, PhotographError, "no exposure time in EXIF"),
        ({"per_view": 3}, PhotographError, "--per-view 3"),
        ({"circle": (1.0, 2.0)}, BallError, "--circle"),
        ({"circle": (-50.0, 200.0, 60.0)}, BallError, "leaves the picture"),
        ({"reflectance": (0.5, 0.5)}, BallError, "--reflectance"),
        ({"reference_exposure": 0.0}, PhotographError, "--reference-exposure"),
        ({"rows": 7}, BallError, "rows"),
        ({"output": Path("ball.png")}, OutputError, "--output must end in"),
        ({"probe": Path("nowhere.json")}, ProbeError, "nowhere"),
        ({"camera": Path("nowhere.json")}, CameraError, "nowhere"),
    ],
)
def test_what_cannot_be_right_is_refused(shoot, tmp_path, changes, error, message):
    with pytest.raises(error, match=message):
        run(options(shoot, tmp_path, **changes))
    assert not list(tmp_path.iterdir())


def test_a_picture_is_not_overwritten(shoot, tmp_path):
    with pytest.raises(OutputError, match="would overwrite this input"):
        run(options(shoot, tmp_path, coefficients=shoot.pictures[0]))


def test_a_radius_that_puts_the_ball_under_the_table_is_refused(shoot, tmp_path):
    with pytest.raises(BallError, match="below the sheet"):
        run(options(shoot, tmp_path, radius_mm=90.0))


def test_missing_sidecars_are_told(shoot, tmp_path):
    lonely = tmp_path / "a.png"
    lonely.write_bytes(shoot.pictures[0].read_bytes())
    with pytest.raises(ProbeError, match=r"no probe\.json beside it"):
        run(options(shoot, tmp_path, pictures=(lonely,), exposures=None))
