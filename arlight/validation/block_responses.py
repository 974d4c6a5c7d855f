"""Block means of a path-traced sheet, to hold A(view) against: distant viewers, no mirrored light."""

from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from arlight.environment import Environment
from arlight.errors import ArlightError, OutputError
from arlight.probe.assembly import Assembly
from arlight.probe.design import Design, Probe
from arlight.probe.layout import design_probe
from arlight.tracking.block_layout import field_blocks
from arlight.tracking.block_means import ROWS, BlockMeans
from arlight.validation.assembled_layers import assembled_layers
from arlight.validation.camera_view import LitSheet
from arlight.validation.paper_light import GatherSettings, gather_irradiance
from arlight.validation.proof_lights import KNOWN_LIGHTS, TEST_LIGHTS, proof_light

Array = NDArray[np.float64]

TILTS_DEG = (0.0, 15.0, 35.0, 55.0, 70.0)
AZIMUTHS_DEG = (-90.0, -37.0, 24.0, 161.0, 75.0)
"""Where the viewer of each tilt stands; not along the stripes."""
RESPONSE_LIGHTS = ("hall", "forest", "courtyard", "bridge", "lobby", "sunset")
"""Captured lights of the stored means."""
_POINTS_PER_SIDE = 64


@dataclass(frozen=True, slots=True)
class TracedResponses:
    """Means of every block's window."""

    design: Design
    """Of the sheet."""
    order: int
    """Of the sheet."""
    views: Array
    """(views, 3) unit vectors toward the viewer."""
    coefficients: NDArray[np.complex128]
    """(lights, k, 3) L~_n [radiance * sr]."""
    means: Array
    """(views, lights, blocks, 3) radiance."""
    spread: Array
    """(views, lights, blocks, 3) standard error of the means, from independent halves of the paths."""


def views_of(tilts_deg: tuple[float, ...] = TILTS_DEG, azimuths_deg: tuple[float, ...] = AZIMUTHS_DEG) -> Array:
    """(views, 3) unit vectors."""
    tilt, azimuth = np.deg2rad(tilts_deg), np.deg2rad(azimuths_deg)
    return np.stack([np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), np.cos(tilt)], axis=-1)


def trace_responses(
    probe: Probe,
    environments: list[Environment],
    coefficients: NDArray[np.complex128],
    views: Array,
    settings: GatherSettings | None = None,
) -> TracedResponses:
    """Path-trace the sheet as designed, continuous tone, and average its blocks' windows.

    Args:
        probe: the sheet.
        environments: the lights.
        coefficients: (lights, k, 3) of them.
        views: (views, 3) unit vectors toward distant viewers.
        settings: how densely light is gathered, in each of the two halves.

    Raises:
        ValidationUnavailableError: Mitsuba is not there.
    """
    settings = settings or GatherSettings(sets=4)
    layers = assembled_layers(probe, Assembly(), halftone_dpi=None)
    halves = []
    for half in range(2):
        chosen = GatherSettings(settings.direct_log2, settings.bounced_log2, settings.sets, 2 * settings.seed + half)
        sheet = LitSheet.of(probe, layers, environments, gather_irradiance(layers, environments, chosen))
        halves.append(np.stack([window_means(probe, sheet, view) for view in views]))
    means = np.stack(halves).reshape(2, len(views), -1, len(environments), 3).swapaxes(2, 3)
    spread = np.abs(means[0] - means[1]) / 2.0
    return TracedResponses(probe.design, probe.order, views, coefficients, means.mean(axis=0), spread)


def trace_proof_responses(design: Design, captured: Path) -> TracedResponses:
    """Block means of the default sheet of order 5 under six soft captured lights from five views.

    Args:
        design: of the sheet.
        captured: folder of the captured environments.

    Raises:
        ValidationUnavailableError: Mitsuba is not there.
        EnvironmentMapError: an environment is missing.
    """
    probe = design_probe(design=design)
    with TemporaryDirectory() as folder:
        lights = [
            proof_light(name, (TEST_LIGHTS | KNOWN_LIGHTS)[name], captured, Path(folder), probe.slab, probe)
            for name in RESPONSE_LIGHTS
        ]
    coefficients = np.stack([light.coefficients for light in lights])
    settings = GatherSettings(12, 10, 8)
    return trace_responses(probe, [light.environment for light in lights], coefficients, views_of(), settings)


def window_means(probe: Probe, sheet: LitSheet, toward: Array) -> Array:
    """(blocks, channels) mean radiance of every block's window toward a distant viewer, nothing mirrored."""
    along = (np.arange(_POINTS_PER_SIDE) + 0.5) / _POINTS_PER_SIDE - 0.5
    grid = np.stack(np.meshgrid(along, along), axis=-1).reshape(-1, 2)
    return np.stack(
        [
            sheet.radiance(np.array(block.center_mm) + block.window_mm * grid, toward, mirrors=False).mean(axis=0)
            for block in field_blocks(probe)
        ]
    )


def distant_view(probe: Probe, toward: Array) -> BlockMeans:
    """Empty measurements of all blocks for a distant viewer: what a response needs to know of a view."""
    blocks = field_blocks(probe)
    count = len(blocks)
    frequencies = np.array([block.frequency or (0, 0) for block in blocks], float)
    delta = probe.slab.light_plane(toward)
    return BlockMeans(
        values=np.zeros((count, ROWS, 3)),
        covariance=np.zeros((count, ROWS, ROWS)),
        pixel_variance=np.zeros((count, 3)),
        shading=np.zeros((count, 3)),
        harmonics=np.zeros(count, np.int64),
        samples=np.ones(count, np.int64),
        valid=np.ones(count, bool),
        view_phasor=np.exp(-2j * np.pi * frequencies @ delta),
        view_cosine=np.full(count, float(toward[2])),
        cycles_per_px=np.zeros((count, 2)),
        color_trust=np.ones(count),
    )


def save_responses(responses: TracedResponses, path: Path | str) -> None:
    """Write a compressed .npz, radiances in single precision.

    Raises:
        OutputError: the file cannot be written.
    """
    try:
        np.savez_compressed(
            path,
            design=responses.design,
            order=responses.order,
            views=responses.views,
            coefficients=responses.coefficients.astype(np.complex64),
            means=responses.means.astype(np.float32),
            spread=responses.spread.astype(np.float16),
        )
    except OSError as error:
        raise OutputError(f"{path}: cannot be written ({error.strerror}); choose another folder") from error


def load_responses(path: Path | str) -> TracedResponses:
    """Read what `save_responses` wrote.

    Raises:
        ArlightError: the file is missing or holds something else.
    """
    try:
        with np.load(path, allow_pickle=False) as stored:
            return TracedResponses(
                design=stored["design"].item(),
                order=int(stored["order"]),
                views=stored["views"],
                coefficients=stored["coefficients"].astype(complex),
                means=stored["means"].astype(float),
                spread=stored["spread"].astype(float),
            )
    except (OSError, KeyError, ValueError) as error:
        raise ArlightError(f"{path}: expected path-traced block means ({error}); trace them again") from error
