"""Environments written and read again."""

import json

import numpy as np
import pytest

from arlight.calibration.ball.environment_file import save_coefficients, save_environment
from arlight.environment import Environment
from arlight.errors import OutputError
from arlight.probe.layout import design_probe


def environment() -> Environment:
    return Environment(np.random.default_rng(1).uniform(0.0, 20.0, (16, 32, 3)).astype(np.float32))


@pytest.mark.parametrize(("suffix", "tolerance"), [("hdr", 0.13), ("exr", 1e-6)])
def test_maps_come_back(tmp_path, suffix, tolerance):
    path = tmp_path / f"light.{suffix}"
    save_environment(environment(), path)
    # .hdr shares one exponent among the channels: 32 / 256
    np.testing.assert_allclose(Environment.load(path).radiance, environment().radiance, atol=tolerance)


def test_other_endings_are_refused(tmp_path):
    with pytest.raises(OutputError, match=r"\.hdr or \.exr"):
        save_environment(environment(), tmp_path / "light.png")


def test_a_missing_folder_is_refused(tmp_path):
    for suffix in ("hdr", "exr"):
        with pytest.raises(OutputError, match="cannot be written"):
            save_environment(environment(), tmp_path / "no" / f"light.{suffix}")


def test_a_turned_environment_would_lose_its_turn(tmp_path):
    with pytest.raises(ValueError, match="turned"):
        save_environment(environment().rotated(0.1), tmp_path / "light.hdr")


def test_coefficients_are_those_of_the_map(tmp_path):
    probe = design_probe(2)
    save_coefficients(environment(), probe, {"note": 3}, tmp_path / "light.json")
    content = json.loads((tmp_path / "light.json").read_text())
    assert content["format"] == "arlight-light"
    assert content["note"] == 3
    found = np.array(content["coefficients_re"]) + 1j * np.array(content["coefficients_im"])
    true = environment().coefficients(probe.slab, np.array(content["frequencies"]))
    np.testing.assert_allclose(found, true, rtol=1e-5, atol=1e-6)
