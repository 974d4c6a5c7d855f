"""How wrong a composite is."""

import numpy as np
import pytest

from arlight.benchmark.speed.picture_errors import picture_error


def test_a_frame_in_which_nothing_is_drawn_has_no_error(clip):
    assert np.isnan(picture_error(clip.frames[0], clip.frames[0], clip.frames[0]))


def test_the_error_is_that_of_the_pixels_that_were_drawn(clip):
    frame = clip.frames[0]
    region = frame.full_region.grown(-100).clipped(frame.size)
    shape = (region.size[1], region.size[0], 3)
    reference = frame.with_linear_rgb(region, np.full(shape, 0.4, np.float32))
    assert picture_error(frame, reference, reference) == 0.0
    brighter = frame.with_linear_rgb(region, np.full(shape, 0.5, np.float32))
    # 8 bits and chroma shared by neighbours at the region's border
    assert picture_error(frame, brighter, reference) == pytest.approx(0.25, rel=0.1)
