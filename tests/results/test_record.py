"""Records hold what the estimate said, in the log's units."""

import math

import numpy as np

from arlight.estimation.lighting import Lighting
from arlight.fourier import half_plane_frequencies
from arlight.lighting_tracker import FrameEstimate
from arlight.probe.layout import design_probe
from arlight.results.record import LogHeader, LogRecord
from arlight.synthetic.settings import default_camera
from arlight.tracking.pose import ProbePose


def test_a_lost_frame_has_no_values():
    record = LogRecord.of(FrameEstimate(3, 0.1, ProbePose.lost(), None, None), {"track": 0.004})
    assert (record.frame, record.time_s, record.status) == (3, 0.1, "lost")
    assert record.pose is record.coefficients is record.stddev is record.order is None
    assert math.isnan(record.chi2)
    assert record.timings_ms == {"track": 4.0}


def test_the_filtered_lighting_is_recorded_not_the_frames_own():
    frequencies = half_plane_frequencies(2)
    k = len(frequencies)
    covariance = np.tile(np.eye(2 * k - 1), (3, 1, 1))
    filtered = Lighting(frequencies, np.full((k, 3), 1.0 + 0j), covariance, 0.0, 1.0)
    raw = Lighting(frequencies, np.full((k, 3), 9.0 + 0j), covariance, 0.0, 9.0)
    record = LogRecord.of(FrameEstimate(0, 0.0, ProbePose.lost(), filtered, raw), {})
    np.testing.assert_array_equal(record.coefficients, filtered.coefficients)
    assert record.order == 2
    # variance 1 of the one real number of order 0, of two of every other
    np.testing.assert_allclose(record.stddev[:, 0], [1.0] + [math.sqrt(2.0)] * (k - 1))


def test_the_header_holds_what_an_evaluation_needs():
    probe, camera = design_probe(2), default_camera((320, 240))
    header = LogHeader.of(probe, camera, "clip.mp4", "probe.json")
    np.testing.assert_array_equal(header.frequencies, probe.frequencies)
    assert header.slab == probe.slab
    assert header.sheet_mm == probe.sheet_mm
    assert header.camera is camera


def test_the_header_can_be_cut_to_an_order():
    header = LogHeader.of(design_probe(2), default_camera((320, 240)), "clip.mp4", "probe.json", order=1)
    np.testing.assert_array_equal(header.frequencies, half_plane_frequencies(1))
