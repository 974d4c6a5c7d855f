"""The error per order that a printer and a glass allow, before anything is printed.

Through A(view) at a typical view: what strays from A, the dots of the halftone, registration and dot gain that
calibration leaves, and the camera's noise, goes through the weighted least squares that estimates the lighting.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from arlight.calibration.dot_response import dot_response_error
from arlight.camera import Camera, Pose
from arlight.estimation.bound import sensor_variance
from arlight.estimation.prior import prior_stddev
from arlight.estimation.reflection import reflection_basis
from arlight.estimation.response import BlockResponse, optical_transfer
from arlight.estimation.row_noise import MEAN_MODEL, WHITE_MODEL, row_variance
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
_WEAKEST_TRANSFER = 0.12
"""Harmonics that blur has taken below this share are not used by the estimator either."""
_FIELD = 0.004
"""Standard deviation of the reflection field and of a block's own part of it, relative to white."""
_SPARKLE = 0.0008


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
    camera, pose = _typical_view(probe, conditions)
    means = _seen(probe, camera, pose, conditions)
    nominal = _assembly(conditions, Registration())
    response = BlockResponse(probe, nominal)
    rows = response.light(means)
    transfer = optical_transfer(means.cycles_per_px, conditions.blur_px**2)
    clear = probe.paper_reflectance * probe.film_transmittance**2 / np.pi
    level = conditions.white / clear
    light = np.concatenate([[level], prior_stddev(probe.frequencies, level)[1:]])
    count = len(light)
    means = replace(means, pixel_variance=_pixel_variance(rows, transfer, level, conditions))
    gain = _estimator_gain(probe, means, response, transfer, light, conditions.white)
    order = frequency_order(probe.frequencies)

    def relative(variance: Array) -> Array:
        total = np.concatenate([variance[:1], variance[1::2] + variance[2::2]])
        return np.array([np.sqrt(np.mean(total[order == k])) for k in range(order.max() + 1)]) / level

    def systematic(changes: list[tuple[Array, NDArray[np.int64]]]) -> Array:
        variance = np.zeros(count)
        for change, places in changes:
            strays = _dense(change * transfer[..., None], places, count)
            variance += np.sum((gain @ strays * light) ** 2, axis=1)
        return relative(variance)

    stray = dot_response_error(probe, dots, tones or Tones(), means, pose.camera_centre_mm, conditions.print_blur_mm)
    other = [BlockResponse(probe, assembly) for assembly in _misregistered(conditions)]
    grown = [BlockResponse(probe, assembly) for assembly in _grown(nominal, conditions.dot_gain)]
    return PredictedError(
        {
            DOTS: systematic([(stray, response.places[:, :3])]),
            REGISTRATION: systematic([_difference(one, response, means) for one in other]),
            DOT_GAIN: systematic([_difference(one, response, means) for one in grown]),
            CAMERA: relative(_noise_variance(gain, means)),
        }
    )


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
    remedies = {
        DOTS: f"print with more than {dpi:g} dpi",
        REGISTRATION: "calibrate the layers' registration on footage",
        DOT_GAIN: "print a wedge (--wedge), measure it and give its profile with --printer-profile",
        CAMERA: "film the sheet larger in the picture, or with more light",
    }
    good = bad[0] - 1
    fewer = f"a sheet of order {good} (--order {good})" if good >= 1 else "a lower order"
    return [
        f"order {', '.join(str(order) for order in bad)}: predicted error above {100.0 * limit:g} %, mostly by {cause}",
        f"what helps: {remedies[cause]}; {fewer}; or glass thicker than {probe.glass_mm:g} mm, for the stripes' "
        "period grows with it",
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


def _difference(one: BlockResponse, nominal: BlockResponse, means: BlockMeans) -> tuple[Array, NDArray[np.int64]]:
    change = one.light(means)
    base = nominal.light(means)
    change[..., : base.shape[2]] -= base
    return change, one.places


def _pixel_variance(rows: Array, transfer: Array, level: float, conditions: Conditions) -> Array:
    radiance = level * rows[:, 0, 0] * transfer[:, 0]
    variance = sensor_variance(radiance, conditions.read_noise, conditions.gain)
    return np.repeat(variance[:, None], 3, axis=1)


def _estimator_gain(
    probe: Probe, means: BlockMeans, response: BlockResponse, transfer: Array, light: Array, white: float
) -> Array:
    """(c, blocks 7) what each row adds to each coefficient: (A' W A)^-1 A' W with the reflection as a nuisance."""
    blocks, rows = transfer.shape
    kinds = np.array([block.kind for block in field_blocks(probe)])
    variance = row_variance(means, _GREEN, white, np.where(kinds == "clear_white", WHITE_MODEL, MEAN_MODEL))
    mirror = response.lower_mirror(means) * transfer
    mirror[:, 0] += 1.0
    precision = np.where(_usable(means, transfer), 1.0 / variance, 0.0)
    own = (_SPARKLE * white) ** 2
    seen = precision * mirror
    weight = -(own / (1.0 + own * np.sum(seen * mirror, axis=1)))[:, None, None] * seen[:, :, None] * seen[:, None, :]
    weight[:, np.arange(rows), np.arange(rows)] += precision
    centers = np.array([block.center_mm for block in field_blocks(probe)], float)
    field = reflection_basis(centers)
    unknown = np.concatenate(
        [
            _dense(response.light(means) * transfer[..., None], response.places, len(light)),
            (mirror[:, :, None] * field[:, None, :]).reshape(blocks * rows, -1),
        ],
        axis=1,
    )
    weighted = np.einsum("brs,bsc->brc", weight, unknown.reshape(blocks, rows, -1)).reshape(unknown.shape)
    prior = np.concatenate([[0.0], 1.0 / light[1:] ** 2, np.full(field.shape[1], 1.0 / (_FIELD * white) ** 2)])
    return np.asarray(np.linalg.solve(unknown.T @ weighted + np.diag(prior), weighted.T)[: len(light)], float)


def _usable(means: BlockMeans, transfer: Array) -> NDArray[np.bool_]:
    order = np.repeat(np.arange(1, transfer.shape[1] // 2 + 1), 2)
    usable = np.ones(transfer.shape, bool)
    usable[:, 1:] = (order <= means.harmonics[:, None]) & (transfer[:, 1:] > _WEAKEST_TRANSFER)
    return usable & means.valid[:, None]


def _dense(rows: Array, places: NDArray[np.int64], count: int) -> Array:
    """(blocks 7, c) rows over all coefficients, from rows (blocks, 7, k) and their places (blocks, k)."""
    dense = np.zeros((*rows.shape[:2], count))
    block = np.arange(len(rows))[:, None]
    for column in range(places.shape[1]):
        np.add.at(dense, (block, np.arange(rows.shape[1])[None], places[:, column : column + 1]), rows[..., column])
    return dense.reshape(-1, count)


def _noise_variance(gain: Array, means: BlockMeans) -> Array:
    """(c,) variance of the coefficients by the pixels' noise."""
    covariance = means.covariance * means.pixel_variance[:, :1, None]
    blocks, rows = covariance.shape[:2]
    by_block = gain.reshape(len(gain), blocks, rows)
    return np.einsum("cbr,brs,cbs->c", by_block, covariance, by_block)
