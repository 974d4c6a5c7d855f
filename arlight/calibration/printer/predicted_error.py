"""The error per order that a printer and a glass allow, before anything is printed.

At a typical view, under natural light: what strays from A(view), which is the dots of the halftone and the registration
and dot gain that calibration leaves, and the camera's noise, goes through the estimator that footage goes through.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from arlight.calibration.printer.dot_response import dot_response_error
from arlight.camera import Camera, Pose
from arlight.estimation.bound import sensor_variance
from arlight.estimation.estimator import LightingEstimator
from arlight.estimation.prior import prior_stddev
from arlight.estimation.reflection import reflection_basis
from arlight.estimation.response import BlockResponse, optical_transfer
from arlight.fourier import frequency_order
from arlight.probe.assembly import Assembly, Print, Registration
from arlight.probe.design import Probe
from arlight.probe.halftone import Halftones, Tones
from arlight.tracking.block_layout import field_blocks
from arlight.tracking.block_means import BlockMeans
from arlight.tracking.blocks import BlockMeter
from arlight.video.frame import Frame

Array = NDArray[np.float64]

DOTS, REGISTRATION, DOT_GAIN, CAMERA = "dots", "registration", "dot gain", "camera"

_PICTURE_PX = (1280, 720)
_FOCAL_PX = 1100.0
_GREEN = 1
_LIGHTS = 8
"""Lights that are drawn: the predictions then repeat to within a tenth."""


@dataclass(frozen=True, slots=True)
class Conditions:
    """A typical view of a typical print."""

    tilt_deg: float = 35.0
    """Camera's angle off the sheet's normal [deg]."""
    sheet_width_px: float = 450.0
    """Width of the sheet in a picture of 1280 x 720 [px]."""
    white: float = 0.6
    """Linear value of white paper."""
    blur_px: float = 0.6
    """Standard deviation of the picture's blur [px]."""
    read_noise: float = 0.0015
    """Standard deviation of the sensor's noise in the dark."""
    gain: float = 3e-5
    """Variance of the shot noise per unit of signal."""
    reflection: float = 0.004
    """How uneven the mirror image of the surroundings is over the sheet, relative to white."""
    print_blur_mm: float = 0.04
    """Standard deviation by which ink and medium blur the print [mm]."""
    registration_mm: float = 0.002
    """Shift of the paper against the film, each way, that calibration leaves [mm]."""
    rotation_deg: float = 0.002
    """Turn of the paper against the film that calibration leaves [deg]."""
    dot_gain: float = 0.01
    """Dot gain of each layer at half coverage that is neither compensated nor calibrated."""


@dataclass(frozen=True, slots=True)
class PredictedError:
    """Rms coefficient error relative to |L~_0|, as errors are stated."""

    parts: dict[str, Array]
    """(order + 1,) for each cause."""

    @property
    def total(self) -> Array:
        """(order + 1,) of all causes together, which are independent."""
        return np.sqrt(np.sum([part**2 for part in self.parts.values()], axis=0))

    def worst_cause(self, order: int) -> str:
        """What spoils an order most."""
        return max(self.parts, key=lambda name: float(self.parts[name][order]))


def predict_error(
    probe: Probe, dots: Halftones, tones: Tones | None = None, conditions: Conditions | None = None
) -> PredictedError:
    """Predict the error of a single frame's estimate under natural light.

    Args:
        probe: the sheet, at the printer's resolution.
        dots: its halftones.
        tones: for which they are compensated.
        conditions: view, sensor, and what the print is taken for.
    """
    conditions = conditions or Conditions()
    trial = _Trial(probe, conditions)
    stray = dot_response_error(probe, dots, tones or Tones(), trial.means, trial.camera_mm, conditions.print_blur_mm)
    registration = [trial.change(assembly) for assembly in _misregistered(conditions)]
    grown = [trial.change(assembly) for assembly in _grown(trial.nominal, conditions.dot_gain)]
    squares: dict[str, list[Array]] = {DOTS: [], REGISTRATION: [], DOT_GAIN: [], CAMERA: []}
    generator = np.random.default_rng(0)
    for _ in range(_LIGHTS):
        trial.light(generator)
        squares[DOTS].append(trial.error(trial.rows_of(stray, trial.response.places[:, :3])))
        for name, changes in ((REGISTRATION, registration), (DOT_GAIN, grown)):
            squares[name].append(np.sum([trial.error(trial.rows_of(*change)) for change in changes], axis=0))
        squares[CAMERA].append(trial.error(trial.noise(generator)))
    return PredictedError({name: np.sqrt(np.mean(values, axis=0)) for name, values in squares.items()})


class _Trial:
    """Measurements of a print under one light after another, and how far changes of theirs lead the estimate astray."""

    def __init__(self, probe: Probe, conditions: Conditions) -> None:
        camera, pose = _typical_view(probe, conditions)
        self.camera_mm = pose.camera_centre_mm
        self.nominal = _assembly(conditions, Registration())
        self.response = BlockResponse(probe, self.nominal)
        self._probe, self._conditions = probe, conditions
        self._estimator = LightingEstimator(probe, self.nominal)
        self._order = frequency_order(probe.frequencies)
        clear = probe.paper_reflectance * probe.film_transmittance**2 / np.pi
        self._level = conditions.white / clear
        means = _seen(probe, camera, pose, conditions)
        self._transfer = optical_transfer(means.cycles_per_px, conditions.blur_px**2)
        self._rows = self.response.light(means) * self._transfer[..., None]
        variance = self._pixel_variance()
        self.means = replace(means, pixel_variance=np.repeat(variance[:, None], 3, axis=1), shading=0.0 * means.shading)
        self._spread = prior_stddev(probe.frequencies, self._level)[1:]
        self._field = reflection_basis(np.array([block.center_mm for block in field_blocks(probe)], float))
        self._x = np.zeros(0)
        self._values = np.zeros(self._rows.shape[:2])
        self._estimate = np.zeros(0, complex)

    def change(self, assembly: Assembly) -> tuple[Array, NDArray[np.int64]]:
        """What another assembly adds to the response's rows, and where its columns belong."""
        other = BlockResponse(self._probe, assembly)
        rows, base = other.light(self.means), self.response.light(self.means)
        rows[..., : base.shape[2]] -= base
        return rows, other.places

    def light(self, generator: np.random.Generator) -> None:
        """Go on to another light, and the reflection that comes with it."""
        self._x = np.concatenate([[self._level], self._spread * generator.normal(size=len(self._spread))])
        share = self._probe.slab.interface_reflectance(self.means.view_cosine)
        uneven = self._conditions.reflection * self._conditions.white / np.mean(share)
        weights = generator.normal(size=self._field.shape[1] - 1)
        mirrored = share * (self._level / np.pi + uneven * (self._field[:, 1:] @ weights))
        mirror = self.response.lower_mirror(self.means) * self._transfer
        mirror[:, 0] += 1.0
        lit = np.einsum("brk,bk->br", self._rows, self._x[self.response.places])
        self._values = lit + mirror * mirrored[:, None]
        self._estimate = self._estimated(self._values)

    def rows_of(self, change: Array, places: NDArray[np.int64]) -> Array:
        """(blocks, 7) what a change of the response does to the measurements."""
        return np.einsum("brk,bk->br", change, self._x[places]) * self._transfer

    def noise(self, generator: np.random.Generator) -> Array:
        """(blocks, 7) noise of the pixels."""
        covariance = self.means.covariance * self.means.pixel_variance[:, :1, None]
        values, vectors = np.linalg.eigh(covariance)
        draw = generator.normal(size=values.shape) * np.sqrt(np.maximum(values, 0.0))
        return np.asarray(np.einsum("brs,bs->br", vectors, draw), float)

    def error(self, change: Array) -> Array:
        """(order + 1,) mean square over each order of how far a change moves the estimate, relative to L~_0."""
        moved = np.abs(self._estimated(self._values + change) - self._estimate) ** 2 / self._level**2
        return np.array([np.mean(moved[self._order == order]) for order in range(self._order.max() + 1)])

    def _estimated(self, values: Array) -> NDArray[np.complex128]:
        kept = np.arange(values.shape[1]) <= 2 * self.means.harmonics[:, None]
        grey = np.repeat((values * kept)[..., None], 3, axis=2)
        return self._estimator.estimate(replace(self.means, values=grey), 0.0).lighting.coefficients[:, _GREEN]

    def _pixel_variance(self) -> Array:
        radiance = self._level * self._rows[:, 0, 0]
        return sensor_variance(radiance, self._conditions.read_noise, self._conditions.gain)


def advice(probe: Probe, predicted: PredictedError, limit: float, dpi: float) -> list[str]:
    """What to do about the orders that are predicted to be worse than a limit; empty where there are none.

    Args:
        probe: the sheet.
        predicted: its prediction.
        limit: the greatest error relative to |L~_0| to accept.
        dpi: the printer's resolution.
    """
    bad = [order for order, error in enumerate(predicted.total) if error > limit]
    if not bad:
        return []
    worst = max(bad, key=lambda order: float(predicted.total[order]))
    cause = predicted.worst_cause(worst)
    good = bad[0] - 1
    fewer = f"a sheet of order {good} (--order {good})" if good >= 1 else "a lower order"
    finer = f"{fewer}; or glass thicker than {probe.glass_mm:g} mm, for the stripes' period grows with it"
    remedies = {
        DOTS: f"print with more than {dpi:g} dpi; {finer}",
        REGISTRATION: f"calibrate the layers' registration on footage; {finer}",
        DOT_GAIN: "print a wedge (--wedge), measure it and give its profile with --printer-profile; or calibrate the "
        "layers on footage",
        CAMERA: f"film the sheet larger in the picture, or with more light; {finer}",
    }
    return [
        f"order {', '.join(str(order) for order in bad)}: predicted error above {100.0 * limit:g} %, mostly by {cause}",
        f"what helps: {remedies[cause]}",
    ]


def _typical_view(probe: Probe, conditions: Conditions) -> tuple[Camera, Pose]:
    """A pinhole camera that looks at the sheet's middle, from the side of its lower edge."""
    width, height = _PICTURE_PX
    matrix = np.array([[_FOCAL_PX, 0.0, (width - 1) / 2.0], [0.0, _FOCAL_PX, (height - 1) / 2.0], [0.0, 0.0, 1.0]])
    distance = probe.sheet_mm[0] * _FOCAL_PX / conditions.sheet_width_px
    tilt = np.radians(conditions.tilt_deg)
    centre = distance * np.array([0.0, -np.sin(tilt), np.cos(tilt)])
    forward = -centre / distance
    right = np.array([1.0, 0.0, 0.0])
    rotation = np.stack([right, np.cross(forward, right), forward])
    return Camera(_PICTURE_PX, matrix, np.zeros(5)), Pose(rotation, -rotation @ centre)


def _seen(probe: Probe, camera: Camera, pose: Pose, conditions: Conditions) -> BlockMeans:
    """The blocks' view, of a grey picture: which pixels they get and what these tell of them."""
    width, height = camera.image_size
    grey = Frame.from_rgb(np.full((height, width, 3), 128, np.uint8))
    return BlockMeter(probe, camera).measure(grey, pose, conditions.blur_px)


def _assembly(conditions: Conditions, registration: Registration) -> Assembly:
    blur = conditions.print_blur_mm
    return Assembly(film=Print(blur_mm=blur), paper=Print(registration, blur_mm=blur))


def _misregistered(conditions: Conditions) -> list[Assembly]:
    shift = conditions.registration_mm
    places = (
        Registration((shift, 0.0)),
        Registration((0.0, shift)),
        Registration(rotation_deg=conditions.rotation_deg),
    )
    return [_assembly(conditions, place) for place in places]


def _grown(nominal: Assembly, dot_gain: float) -> list[Assembly]:
    return [
        replace(nominal, film=replace(nominal.film, dot_gain=dot_gain)),
        replace(nominal, paper=replace(nominal.paper, dot_gain=dot_gain)),
    ]
