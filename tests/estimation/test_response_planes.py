"""The response as the compiled fit takes it: in a sequence of its own, some blocks alone, overtones by their share."""

from types import SimpleNamespace

import numpy as np
import pytest

from arlight.estimation.response import BlockResponse
from arlight.probe.assembly import Assembly, Print, Registration
from arlight.probe.layout import design_probe
from arlight.tracking.block_layout import field_blocks


def seen(probe):
    """What the response reads of measurements: every block from a direction of its own."""
    generator, count = np.random.default_rng(len(probe.blocks)), len(field_blocks(probe))
    return SimpleNamespace(
        view_phasor=np.exp(-1j * generator.uniform(-np.pi, np.pi, count)),
        view_cosine=generator.uniform(0.4, 1.0, count),
    )


PRINTED = Assembly(film=Print(dot_gain=0.12), paper=Print(Registration((0.05, -0.1), 0.1), dot_gain=0.1))
"""A sheet whose film has a second harmonic and whose paper is printed beside its place."""


@pytest.mark.parametrize("design", ["matched", "doubled"])
def test_light_of_twice_the_frequency_counts_with_the_mean_by_its_share(design):
    probe = design_probe(order=3, design=design)
    response, means = BlockResponse(probe, PRINTED), seen(probe)
    generator = np.random.default_rng(61)
    shape = 0.2 * generator.normal(size=2 * len(probe.frequencies) - 1)
    shape[0] = 1.0
    rows = response.light(means, shape)
    assert rows.shape[2] == 5
    overtone = np.where(response.places[:, 3:] > 0, shape[response.places[:, 3:]], 0.0)
    expected = rows[:, :, 0] + np.einsum("brk,bk->br", rows[:, :, 3:], overtone)
    response.fill(len(field_blocks(probe)), shape)
    found = response.rows[:3, :, : len(field_blocks(probe))]
    np.testing.assert_allclose(found[0].T, expected[response.sequence], atol=1e-14)
    np.testing.assert_allclose(np.moveaxis(found[1:], 0, 2).swapaxes(0, 1), rows[response.sequence, :, 1:3], atol=1e-14)
    # it is there, and small
    assert 1e-4 < np.abs(expected - rows[:, :, 0]).max() < 0.1 * np.abs(expected).max()


def test_a_part_of_the_sequence_is_the_same_part_of_all():
    probe = design_probe(order=3)
    response = BlockResponse(probe)
    everything = response.light(seen(probe))
    for planes in (response.rows, response.mirror):
        planes[:] = np.nan
    response.fill(9)
    np.testing.assert_array_equal(
        response.rows[..., :9], np.moveaxis(everything[response.sequence[:9]], 0, 2).swapaxes(0, 1)
    )
    # the lanes beyond are filled up, no more
    assert np.all(np.isnan(response.rows[..., 12:]))


def test_blocks_are_in_the_sequence_of_their_orders():
    probe = design_probe(order=3)
    lengths = [np.hypot(*(field_blocks(probe)[i].frequency or (0, 0))) for i in BlockResponse(probe).sequence]
    assert np.all(np.diff(lengths) >= 0.0)
