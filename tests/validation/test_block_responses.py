"""A(view) against path-traced block means: stored ones of both designs to 70 degrees, and a few traced on the spot."""

from pathlib import Path

import numpy as np
import pytest

from arlight.errors import ArlightError
from arlight.estimation.response import BlockResponse
from arlight.fourier import pack_real
from arlight.probe.design import DESIGNS
from arlight.probe.layout import design_probe
from arlight.tracking.block_layout import field_blocks
from arlight.validation.block_responses import (
    TILTS_DEG,
    distant_view,
    load_responses,
    save_responses,
    trace_responses,
    views_of,
)
from arlight.validation.paper_light import GatherSettings
from arlight.validation.soft_light import received_coefficients

DATA = Path(__file__).parents[1] / "data" / "traced"
WORST = {0.0: 0.001, 15.0: 0.001, 35.0: 0.001, 55.0: 0.001, 70.0: 0.0025}
"""Rms over blocks, lights and colours of traced mean minus A(view), relative to white paper under clear film."""


def deviation(traced, probe, view):
    """(lights, blocks, 3) traced mean minus model, and the mean of white paper (lights, 3)."""
    blocks = field_blocks(probe)
    response = BlockResponse(probe)
    rows = response.light(distant_view(probe, traced.views[view]))[:, 0]
    packed = np.stack([pack_real(light) for light in traced.coefficients])
    model = np.einsum("bc,lbcx->lbx", rows, packed[:, response.places])
    white = np.array([block.kind == "clear_white" for block in blocks])
    level = traced.means[view][:, white].mean(axis=1)
    return traced.means[view] - model, level


def orders(probe):
    return np.array([int(np.ceil(np.hypot(*(block.frequency or (0, 0))))) for block in field_blocks(probe)])


@pytest.fixture(scope="module", params=DESIGNS)
def stored(request):
    traced = load_responses(DATA / f"responses-{request.param}.npz")
    return traced, design_probe(traced.order, traced.design)


@pytest.mark.parametrize("order", [1, 2, 3, 4, 5])
@pytest.mark.parametrize("view", range(len(TILTS_DEG)))
def test_stored_means_are_a_of_view(stored, view, order):
    traced, probe = stored
    error, level = deviation(traced, probe, view)
    relative = (error / level[:, None])[:, orders(probe) == order]
    assert np.sqrt(np.mean(relative**2)) < WORST[TILTS_DEG[view]]


def test_the_stored_noise_is_small_beside_what_is_tested(stored):
    traced, probe = stored
    for view, tilt in enumerate(TILTS_DEG):
        _, level = deviation(traced, probe, view)
        assert np.sqrt(np.mean((traced.spread[view] / level[:, None]) ** 2)) < 0.5 * WORST[tilt]


def test_single_scattering_does_not_explain_the_stored_means(stored):
    """The test above would see it if the light between paper and glass were left out."""
    traced, probe = stored
    blocks = field_blocks(probe)
    response = BlockResponse(probe, bounces=False)
    rows = response.light(distant_view(probe, traced.views[2]))[:, 0]
    packed = np.stack([pack_real(light) for light in traced.coefficients])
    model = np.einsum("bc,lbcx->lbx", rows, packed[:, response.places])
    pattern = np.array([block.kind == "pattern" for block in blocks])
    _, level = deviation(traced, probe, 2)
    relative = ((traced.means[2] - model) / level[:, None])[:, pattern]
    assert np.sqrt(np.mean(relative**2)) > 3 * WORST[35.0]


@pytest.mark.usefixtures("path_tracer")
def test_means_traced_on_the_spot_are_a_of_view(small_probe, smooth_light):
    coefficients = received_coefficients(smooth_light, small_probe.slab, small_probe.frequencies)[None]
    views = views_of((35.0,), (24.0,))
    traced = trace_responses(small_probe, [smooth_light], coefficients, views, GatherSettings(9, 8, 1))
    error, level = deviation(traced, small_probe, 0)
    relative = error / level[:, None]
    # few paths: their own error is up to a per cent
    assert np.sqrt(np.mean(relative**2)) < 0.01
    assert np.abs(relative).max() < 0.03


def test_responses_survive_storage(tmp_path, stored):
    traced, _ = stored
    save_responses(traced, tmp_path / "again.npz")
    again = load_responses(tmp_path / "again.npz")
    np.testing.assert_allclose(again.means, traced.means, rtol=1e-6)
    np.testing.assert_array_equal(again.views, traced.views)
    assert (again.design, again.order) == (traced.design, traced.order)


@pytest.mark.parametrize("content", [None, b"not an archive"])
def test_a_file_that_cannot_be_read_is_named(tmp_path, content):
    path = tmp_path / "means.npz"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(ArlightError, match=r"means\.npz"):
        load_responses(path)
