import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from arlight.rendering.default_object import default_object
from arlight.rendering.relight import Relighter
from arlight.rendering.settings import RelightSettings

pytestmark = pytest.mark.usefixtures("gl")

QUICK = RelightSettings(directions=96, shadow_texels=32)


@pytest.fixture(scope="module")
def pair(probe, camera):
    return tuple(
        Relighter(default_object(), probe, camera, replace(QUICK, renderer=name)) for name in ("moderngl", "pyrender")
    )


def test_both_renderers_agree_on_outline_and_brightness(pair, pose, lighting_of, environment):
    lighting = lighting_of(environment)
    (region, ours), (other_region, theirs) = (relighter.draw_object(pose, lighting) for relighter in pair)
    assert region == other_region
    assert np.abs(ours[..., 3] - theirs[..., 3]).mean() < 0.01
    means = [image[..., :3].sum() / image[..., 3].sum() for image in (ours, theirs)]
    assert means[1] == pytest.approx(means[0], rel=0.2)


def test_they_share_a_thread(pair, pose, lighting_of, environment):
    lighting = lighting_of(environment)
    before = pair[0].draw_object(pose, lighting)[1]
    pair[1].draw_object(pose, lighting)
    pair[1].release()
    after = pair[0].draw_object(pose, lighting)[1]
    again = pair[1].draw_object(pose, lighting)[1]
    assert np.array_equal(before, after)
    assert again[..., 3].max() == 1.0


def test_lens_distortion_is_followed(probe, lens_camera, pose, lighting_of, environment):
    lighting = lighting_of(environment)
    ours, theirs = (
        Relighter(default_object(), probe, lens_camera, replace(QUICK, renderer=name)).draw_object(pose, lighting)[1]
        for name in ("moderngl", "pyrender")
    )
    assert np.abs(ours[..., 3] - theirs[..., 3]).mean() < 0.02


def test_importing_changes_no_setting():
    code = "import os, arlight.rendering.relight; assert 'PYOPENGL_PLATFORM' not in os.environ"
    clean = {key: value for key, value in os.environ.items() if key != "PYOPENGL_PLATFORM"}
    assert subprocess.run([sys.executable, "-c", code], env=clean, check=False).returncode == 0
