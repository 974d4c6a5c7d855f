"""Environments by name and by file."""

import numpy as np
import pytest

from arlight.errors import EnvironmentMapError
from arlight.synthetic.captured import captured_names, load_environment


@pytest.mark.parametrize("name", captured_names())
def test_every_shipped_environment_lights_a_sheet(name):
    environment = load_environment(name)
    assert environment.radiance.shape == (128, 256, 3)
    assert np.all(environment.irradiance() > 0.1)


def test_there_are_some():
    assert {"hall", "bridge", "apartment", "studio"} <= set(captured_names())


def test_unknown_name_lists_the_choices():
    with pytest.raises(EnvironmentMapError, match=r"moonlight.*apartment.*hall"):
        load_environment("moonlight")


def test_file_that_is_no_environment_is_named(tmp_path):
    path = tmp_path / "broken.hdr"
    path.write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2")
    with pytest.raises(EnvironmentMapError, match=r"broken\.hdr"):
        load_environment(str(path))
