"""The prediction against a simulation that shares no formula with it: the actual dots, lit and looked at dot by dot.

The light's way through the film is an FFT of the printed raster, the view's is traced for every dot, and the lighting
is estimated by the estimator that knows the design alone.
"""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from arlight.calibration.printer.predicted_error import (
    CAMERA,
    DOT_GAIN,
    DOTS,
    REGISTRATION,
    Conditions,
    PredictedError,
    _seen,
    _typical_view,
    advice,
    predict_error,
)
from arlight.environment import Environment
from arlight.estimation.bound import sensor_variance
from arlight.estimation.estimator import LightingEstimator
from arlight.estimation.response import optical_transfer
from arlight.fourier import frequency_order
from arlight.probe import patterns
from arlight.probe.assembly import Assembly, Print
from arlight.probe.halftone import Tones, render_halftones
from arlight.probe.layout import design_probe
from arlight.probe.rasters import Rasters, render_rasters
from arlight.probe.tone import ToneCurve
from arlight.synthetic.sheet import SheetLayers
from arlight.synthetic.transport import LightTransport
from arlight.tracking.block_layout import field_blocks

DPI, ORDER = 300, 2
FINE = 2
"""Samples of the simulation along a dot, which is a square."""
BLUR_MM = 0.04
LIGHTS = 3
SHIFT_MM = 0.25 * 25.4 / DPI
"""A quarter of a dot, which the simulation's resampling shifts exactly."""
CONDITIONS = Conditions(
    reflection=0.0, print_blur_mm=BLUR_MM, registration_mm=SHIFT_MM, rotation_deg=0.0, dot_gain=0.04
)


@pytest.fixture(scope="module")
def probe():
    return design_probe(ORDER, pixels_per_mm=DPI / 25.4)


@pytest.fixture(scope="module")
def dots(probe):
    return render_halftones(probe)


@pytest.fixture(scope="module")
def predicted(probe, dots):
    return predict_error(probe, dots, conditions=CONDITIONS)


@pytest.fixture(scope="module")
def environments():
    """Skies with lamps and dark walls, as uneven as rooms are."""
    generator = np.random.default_rng(11)
    maps = []
    for _ in range(LIGHTS):
        noise = generator.normal(size=(32, 64)).astype(np.float32)
        smooth = cv2.GaussianBlur(np.tile(noise, (1, 3)), (0, 0), 3.0)[:, 64:128]
        maps.append(Environment(np.repeat(np.exp(1.3 * smooth / smooth.std())[..., None], 3, axis=2)))
    return maps


@pytest.fixture(scope="module")
def fine(probe):
    """The sheet on the simulation's grid."""
    return replace(probe, pixels_per_mm=FINE * probe.pixels_per_mm)


def squares(dots):
    return dots.repeat(FINE, axis=0).repeat(FINE, axis=1)


def blurred(raster):
    sigma = BLUR_MM * FINE * DPI / 25.4
    return cv2.GaussianBlur(raster.astype(np.float32), (0, 0), sigma, borderType=cv2.BORDER_REFLECT)


def shifted(raster, x_mm):
    size = (raster.shape[1], raster.shape[0])
    matrix = np.float32([[1, 0, x_mm * FINE * DPI / 25.4], [0, 1, 0]])
    return cv2.warpAffine(raster, matrix, size, flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)


def read(raster, at, method=cv2.INTER_LINEAR):
    """A raster at rows and columns that are not whole."""
    row, column = (np.asarray(part, np.float32) for part in at)
    return cv2.remap(raster, column, row, method, borderMode=cv2.BORDER_REPLICATE)


class Simulation:
    """Films printed layers: block measurements without noise, dot by dot."""

    def __init__(self, probe, film, paper):
        self.probe, self.film, self.paper = probe, film, paper
        self.camera, self.pose = _typical_view(probe, CONDITIONS)
        self.means = _seen(probe, self.camera, self.pose, CONDITIONS)
        frame, window = patterns.frame(probe)
        layers = SheetLayers.from_rasters(probe, Rasters(film, paper, frame, window))
        self.transport = LightTransport(layers, probe.slab, bounces=0)
        self.transfer = optical_transfer(self.means.cycles_per_px, CONDITIONS.blur_px**2)

    def measure(self, environment):
        probe = self.probe
        clear = probe.paper_reflectance * probe.film_transmittance**2 / np.pi
        received = float(environment.coefficients(probe.slab, [[0, 0]])[0, 1].real)
        exposed = environment.scaled(CONDITIONS.white / clear / received)
        lit = self.transport.irradiance(exposed)
        mirrored = CONDITIONS.white / clear / np.pi
        values = np.array([self._rows(block, lit, mirrored) for block in field_blocks(probe)])
        variance = sensor_variance(values[:, 0], CONDITIONS.read_noise, CONDITIONS.gain)
        pixel = np.repeat(variance[:, None], 3, axis=1)
        rows = values * self.transfer * (np.arange(7) <= 2 * self.means.harmonics[:, None])
        return replace(
            self.means,
            values=np.repeat(rows[..., None], 3, axis=2),
            pixel_variance=pixel,
            shading=0.0 * self.means.shading,
        )

    def _rows(self, block, lit, mirrored):
        probe, ppm = self.probe, self.probe.pixels_per_mm
        rows, columns = patterns.block_pixels(probe, block)
        x = (np.arange(columns.start, columns.stop) + 0.5) / ppm - probe.sheet_mm[0] / 2.0
        y = probe.sheet_mm[1] / 2.0 - (np.arange(rows.start, rows.stop) + 0.5) / ppm
        q = np.stack([*np.meshgrid(x, y), np.zeros((len(y), len(x)))], axis=-1)
        toward = self.pose.camera_centre_mm - q
        toward /= np.linalg.norm(toward, axis=-1, keepdims=True)
        p = q[..., :2] - probe.slab.offset_mm(toward)
        inside = np.all(np.abs(p - block.center_mm) < block.size_mm / 2.0 - probe.slab.max_offset_mm, axis=-1)
        at = [(probe.sheet_mm[1] / 2.0 - p[..., 1]) * ppm - 0.5, (p[..., 0] + probe.sheet_mm[0] / 2.0) * ppm - 0.5]
        paper = read(self.paper, at)
        first_x, first_y = lit.first_mm
        at = [(first_y - p[..., 1]) / lit.texel_mm, (p[..., 0] - first_x) / lit.texel_mm]
        light = read(np.ascontiguousarray(lit.irradiance[..., 1]), at, cv2.INTER_CUBIC)
        seen = self.film[rows, columns] * paper * light
        seen *= probe.film_transmittance * probe.paper_reflectance / np.pi * probe.slab.transmittance(toward[..., 2])
        seen += mirrored * self._mirrors(rows, columns, q[..., :2] - p, toward)
        n = np.array(block.frequency or (0, 0))
        phase = 2.0 * np.pi * (q[..., :2] @ n)[inside] / probe.slab.period_mm
        if not n.any():
            return np.array([seen[inside].mean(), 0, 0, 0, 0, 0, 0])
        basis = np.stack([np.ones_like(phase)] + [f(k * phase) for k in (1, 2, 3) for f in (np.cos, np.sin)])
        return np.linalg.solve(basis @ basis.T, basis @ seen[inside])

    def _mirrors(self, rows, columns, offset, toward):
        """The upper face, and the lower one through the film on the way in and on the way out."""
        probe, ppm = self.probe, self.probe.pixels_per_mm
        face = probe.slab.interface_reflectance(toward[..., 2])
        row, column = np.mgrid[rows, columns]
        at = [row + 2.0 * offset[..., 1] * ppm, column - 2.0 * offset[..., 0] * ppm]
        entered = read(self.film, at)
        passed = self.film[rows, columns] * entered * probe.film_transmittance**2
        return face * (1.0 + (1.0 - face) ** 2 * passed)


@pytest.fixture(scope="module")
def stray(fine, environments):
    """Rms per order of how far estimates of a printed sheet stray from those of a perfect one, over |L_0|."""
    # blur is calibrated: the prediction has it lower the signal, not mislead
    known = Assembly(film=Print(blur_mm=BLUR_MM), paper=Print(blur_mm=BLUR_MM))
    estimator = LightingEstimator(fine, known, bounces=False)
    ideal = render_rasters(fine)
    order = frequency_order(fine.frequencies)

    def estimates(film, paper):
        simulation = Simulation(fine, film, paper)
        return [estimator.estimate(simulation.measure(e), 0.0).lighting.coefficients[:, 1] for e in environments]

    reference = estimates(blurred(ideal.film), blurred(ideal.paper))

    def measure(film, paper):
        change = np.array([(a - b) / b[0].real for a, b in zip(estimates(film, paper), reference, strict=True)])
        return np.array([np.sqrt(np.mean(np.abs(change[:, order == k]) ** 2)) for k in range(ORDER + 1)])

    return measure


def assert_agree(predicted, measured):
    """Rms over the coefficients within a factor of 1.5; single orders, of two to four coefficients, within 3."""
    ratio = np.linalg.norm(predicted[1:]) / np.linalg.norm(measured[1:])
    assert 1.0 / 1.5 < ratio < 1.5, (predicted, measured)
    np.testing.assert_array_less(measured[1:] / 3.0, predicted[1:])
    np.testing.assert_array_less(predicted[1:], 3.0 * measured[1:])


def test_dots_cost_what_is_predicted(dots, predicted, stray):
    assert_agree(predicted.parts[DOTS], stray(blurred(squares(dots.film)), blurred(squares(dots.paper))))


def test_misregistration_costs_what_is_predicted(fine, predicted, stray):
    ideal = render_rasters(fine)
    film = blurred(ideal.film)
    sides = [
        stray(film, blurred(shifted(ideal.paper, SHIFT_MM))),
        stray(film, blurred(shifted(ideal.paper.T, SHIFT_MM).T)),
    ]
    assert_agree(predicted.parts[REGISTRATION], np.linalg.norm(sides, axis=0))


def test_dot_gain_costs_what_is_predicted(fine, predicted, stray):
    ideal = render_rasters(fine)
    grown = Print(dot_gain=CONDITIONS.dot_gain)
    layers = [
        stray(blurred(grown.tone(ideal.film)), blurred(ideal.paper)),
        stray(blurred(ideal.film), blurred(grown.tone(ideal.paper))),
    ]
    assert_agree(predicted.parts[DOT_GAIN], np.linalg.norm(layers, axis=0))


def test_prediction_repeats_and_adds_up(probe, dots, predicted):
    again = predict_error(probe, dots, conditions=CONDITIONS)
    for name, part in predicted.parts.items():
        np.testing.assert_array_equal(part, again.parts[name])
        assert part.shape == (ORDER + 1,)
    np.testing.assert_allclose(predicted.total**2, sum(part**2 for part in predicted.parts.values()))


def test_errors_grow_with_their_causes(probe, dots, predicted):
    worse = replace(CONDITIONS, registration_mm=2.0 * SHIFT_MM, dot_gain=0.08, read_noise=0.01)
    worse = predict_error(probe, dots, conditions=worse)
    assert np.all(worse.parts[REGISTRATION][1:] > 1.5 * predicted.parts[REGISTRATION][1:])
    assert np.all(worse.parts[DOT_GAIN] > 1.5 * predicted.parts[DOT_GAIN])
    assert np.all(worse.parts[CAMERA][1:] > 1.5 * predicted.parts[CAMERA][1:])


def test_compensated_dots_are_judged_by_what_they_were_asked_for(probe):
    tones = Tones(paper=ToneCurve((0.0, 0.5, 1.0), (0.05, 0.4, 1.0)))
    compensated = predict_error(probe, render_halftones(probe, tones), tones, CONDITIONS)
    unaware = predict_error(probe, render_halftones(probe, tones), None, CONDITIONS)
    # dots that were compensated are judged by what they were asked for, or they would look wrong in tone
    assert np.all(compensated.parts[DOTS] < 0.02)
    assert np.all(unaware.parts[DOTS] > 3.0 * compensated.parts[DOTS])


def test_advice_names_the_orders_the_cause_and_what_helps(probe):
    fine = np.array([0.001, 0.002, 0.004])
    parts = {DOTS: fine, REGISTRATION: fine, DOT_GAIN: fine, CAMERA: fine}
    assert advice(probe, PredictedError(parts), 0.03, 300.0) == []
    for cause, remedy in (
        (DOTS, "more than 300 dpi"),
        (REGISTRATION, "registration"),
        (DOT_GAIN, "--wedge"),
        (CAMERA, "larger in the picture"),
    ):
        lines = advice(probe, PredictedError({**parts, cause: 20.0 * fine}), 0.03, 300.0)
        assert lines[0].startswith("order 1, 2: predicted error above 3 %")
        assert cause in lines[0]
        assert remedy in lines[1]
        # fewer or wider stripes do not mend the tone
        assert ("thicker than 2.44 mm" in lines[1]) == (cause != DOT_GAIN)
    only_last = PredictedError({**parts, DOTS: 10.0 * fine})
    assert "--order 1" in advice(probe, only_last, 0.03, 300.0)[1]
