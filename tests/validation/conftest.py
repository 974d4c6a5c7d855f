"""Small sheets for the path tracer; what needs Mitsuba is skipped, with the reason, where it is not installed."""

import numpy as np
import pytest

from arlight.environment import Environment
from arlight.optics import Slab
from arlight.probe.design import Probe
from arlight.probe.layout import design_probe
from arlight.validation.assembled_layers import AssembledLayers, assembled_layers
from arlight.validation.camera_view import LitSheet
from arlight.validation.filming import assembled_by_hand
from arlight.validation.mitsuba_library import ValidationUnavailableError, load_mitsuba
from arlight.validation.paper_light import GatherSettings, gather_irradiance


@pytest.fixture(scope="session")
def path_tracer() -> None:
    """Mitsuba's scalar variant."""
    try:
        load_mitsuba()
    except ValidationUnavailableError as error:
        pytest.skip(str(error))


@pytest.fixture(scope="session")
def fast_path_tracer() -> None:
    """Mitsuba's LLVM variant."""
    try:
        load_mitsuba("llvm_ad_rgb")
    except ValidationUnavailableError as error:
        pytest.skip(str(error))


@pytest.fixture(scope="session")
def small_probe() -> Probe:
    """A sheet of order 1."""
    return design_probe(order=1)


@pytest.fixture(scope="session")
def smooth_light() -> Environment:
    """A soft coloured gradient with a broad lamp, 16 x 32."""
    theta = (np.arange(16) + 0.5)[:, None] * np.pi / 16
    phi = (np.arange(32) + 0.5)[None] * 2 * np.pi / 32
    lamp = np.exp(8.0 * (np.sin(theta) * np.cos(phi - 0.7) * 0.6 + np.cos(theta) * 0.8 - 1.0))
    sky = 0.3 + 0.2 * np.cos(theta) + 0.1 * np.sin(theta) * np.sin(phi)
    radiance = np.stack([sky + 3.0 * lamp, sky + 2.0 * lamp, 1.3 * sky + 1.2 * lamp], axis=-1)
    return Environment(radiance.astype(np.float32))


@pytest.fixture(scope="session")
def small_layers(small_probe: Probe) -> AssembledLayers:
    """The small sheet with everything that a hand and a printer do."""
    return assembled_layers(small_probe, assembled_by_hand())


@pytest.fixture(scope="session")
def small_sheet(
    request: pytest.FixtureRequest, small_probe: Probe, small_layers: AssembledLayers, smooth_light: Environment
) -> LitSheet:
    """It under the smooth light."""
    request.getfixturevalue("path_tracer")
    lights = [smooth_light]
    irradiance = gather_irradiance(small_layers, lights, GatherSettings(10, 9, 2))
    return LitSheet.of(small_probe, small_layers, lights, irradiance)


@pytest.fixture(scope="session")
def open_layers() -> AssembledLayers:
    """Clear film without absorption on perfectly white paper, no frame: nothing is lost."""
    ones = np.ones((1200, 1200), np.float32)
    frame = np.full((4, 4), -1.0, np.float32)
    return AssembledLayers(ones, ones, (-15.0, 15.0), 40.0, frame, 0.1, Slab())
