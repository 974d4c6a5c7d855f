"""Response curves against the standards' own formulas; what cannot be a response is refused."""

import json

import numpy as np
import pytest

from arlight.camera import Camera
from arlight.color import encoded_from_linear, linear_from_encoded
from arlight.errors import CameraError
from arlight.radiometry import Radiometry

MATRIX = np.array([[620.0, 0, 318.0], [0, 625.0, 243.0], [0, 0, 1]])


def radiometry_of(transfer, knots=65, **values):
    response = linear_from_encoded(np.linspace(0, 1, knots), transfer).astype(float)
    response[-1] = 1.0
    return Radiometry(tuple(response), **values)


@pytest.mark.parametrize("transfer", ["srgb", "bt709", "gamma22", "linear"])
def test_a_sampled_curve_decodes_like_the_curve(transfer):
    light = np.linspace(0.0, 1.0, 501)
    found = radiometry_of(transfer).linear(encoded_from_linear(light, transfer))
    # a kink of the curve may lie between two knots
    np.testing.assert_allclose(found, light, atol=1.2e-4)


def test_black_is_no_light_and_full_scale_is_one():
    radiometry = radiometry_of("srgb", black=0.02)
    encoded = encoded_from_linear([0.02, 1.0, 0.02 + 0.98 * 0.3], "srgb")
    np.testing.assert_allclose(radiometry.linear(encoded), [0.0, 1.0, 0.3], atol=4e-5)
    # noise below black counts too, or its mean would be light
    assert radiometry.linear(0.0) == pytest.approx(-0.02 / 0.98)


def test_a_table_is_the_curve_at_even_steps():
    radiometry = radiometry_of("srgb", black=0.01)
    table = radiometry.table(256)
    assert table.dtype == np.float32
    np.testing.assert_allclose(table, radiometry.linear(np.arange(256) / 255.0), atol=1e-7)
    assert np.all(np.diff(table) > 0.0)


def test_noise_grows_with_light_and_not_below_black():
    radiometry = radiometry_of("srgb", read_noise=0.002, shot_gain=1e-4)
    np.testing.assert_allclose(radiometry.noise_variance([-0.1, 0.0, 0.5]), [4e-6, 4e-6, 5.4e-5])


def test_a_camera_keeps_its_radiometry(tmp_path):
    radiometry = radiometry_of("bt709", black=0.01, clip=0.9, read_noise=0.002, shot_gain=1e-4)
    Camera((640, 480), MATRIX, np.zeros(5), radiometry=radiometry).save(tmp_path / "camera.json")
    assert Camera.load(tmp_path / "camera.json").radiometry == radiometry


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"response": [0, 0.5, 1]}, "5 finite numbers"),
        ({"response": [0, 0.1, 0.3, 0.2, 0.5, 1]}, "not rising all the way"),
        ({"response": [0.1, 0.2, 0.3, 0.4, 1]}, "from 0 to 1"),
        ({"response": [0, 0.2, 0.3, 0.4, 2]}, "from 0 to 1"),
        ({"response": [0, 0.2, float("nan"), 0.4, 1]}, "finite"),
        ({"response": "none"}, "numbers"),
        ({"black": 0.4}, "black"),
        ({"clip": 0.0}, "clip"),
        ({"clip": None}, "numbers"),
        ({"read_noise": -1.0}, "noise"),
        ({"shot_gain": float("inf")}, "noise"),
        ({"shutter": 1}, "shutter"),
    ],
)
def test_impossible_radiometry_is_refused_with_the_files_name(tmp_path, change, message):
    content = {
        "image_size": [640, 480],
        "camera_matrix": MATRIX.tolist(),
        "radiometry": radiometry_of("srgb", 9).content() | change,
    }
    path = tmp_path / "camera.json"
    path.write_text(json.dumps(content))
    with pytest.raises(CameraError, match=message) as refusal:
        Camera.load(path)
    assert "camera.json" in str(refusal.value)


def test_a_radiometry_that_is_no_object_is_refused(tmp_path):
    path = tmp_path / "camera.json"
    path.write_text(json.dumps({"image_size": [640, 480], "camera_matrix": MATRIX.tolist(), "radiometry": [1, 2]}))
    with pytest.raises(CameraError, match=r"camera\.json: radiometry must hold response"):
        Camera.load(path)
