"""The object that is prepared beside the loop: the same picture, and the same refusals."""

import numpy as np
import pytest

from arlight.camera import Pose
from arlight.commands.options.relighting import RelightingOptions
from arlight.commands.relighting import make_relighter
from arlight.errors import MeshError
from arlight.estimation.lighting import Lighting
from arlight.probe.layout import design_probe
from arlight.rendering.default_object import default_object
from arlight.rendering.relight import Relighter
from arlight.rendering.settings import RelightSettings
from arlight.synthetic.settings import default_camera
from arlight.video.frame import Frame

QUICK = RelightSettings(directions=48, shadow_texels=32, supersampling=1)


@pytest.fixture(scope="module")
def probe():
    return design_probe(1)


@pytest.fixture(scope="module")
def camera():
    return default_camera((320, 240))


@pytest.fixture
def grey():
    return Frame.from_rgb(np.full((240, 320, 3), 128, np.uint8))


@pytest.fixture
def seen(probe, look):
    """A pose and an even light."""
    coefficients = np.zeros((len(probe.frequencies), 3), complex)
    coefficients[0] = 0.4
    size = 2 * len(coefficients) - 1
    return look(30.0, -90.0, 400.0), Lighting(probe.frequencies, coefficients, np.zeros((3, size, size)), 0.0, 1.0)


def test_draws_what_a_relighter_made_at_once_draws(probe, camera, grey, seen):
    later = make_relighter(RelightingOptions(settings=QUICK), probe, camera)
    drawn = later.render(grey, *seen).encoded_rgb()
    later.release()
    at_once = Relighter(default_object(), probe, camera, QUICK)
    np.testing.assert_array_equal(drawn, at_once.render(grey, *seen).encoded_rgb())
    at_once.release()
    assert np.any(drawn != grey.encoded_rgb())


def test_an_object_that_cannot_be_placed_is_refused_by_the_first_frame(probe, camera, grey, seen):
    later = make_relighter(RelightingOptions(settings=RelightSettings(size_mm=0.0)), probe, camera)
    with pytest.raises(MeshError, match="size must be a positive length"):
        later.render(grey, *seen)
    later.release()


def test_an_object_that_is_not_there_is_refused_at_once(probe, camera, tmp_path):
    with pytest.raises(MeshError, match=r"none\.glb: no such file"):
        make_relighter(RelightingOptions(object=tmp_path / "none.glb"), probe, camera)


def test_frames_without_a_sheet_come_through(probe, camera, grey):
    later = make_relighter(RelightingOptions(settings=QUICK), probe, camera)
    assert later.render(grey, Pose(np.eye(3), np.array([0.0, 0.0, 400.0])), None) is grey
    assert later.render(grey, None, None) is grey
    later.release()
