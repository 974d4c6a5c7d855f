"""Laws of gathering lights: strength and centroid are kept, and waves are kept where there are enough groups."""

import numpy as np
import pytest

from arlight.synthetic.light_groups import group_lights


def scattered(seed=0, count=400):
    generator = np.random.default_rng(seed)
    return generator.uniform(-2, 2, (count, 2)), generator.exponential(1.0, (count, 3)) ** 2


@pytest.mark.parametrize("count", [1, 7, 64, 1000])
def test_every_light_belongs_to_one_group_which_keeps_its_strength_and_centroid(count):
    positions, strengths = scattered()
    groups = group_lights(positions, strengths, count)
    assert len(groups.members) == min(count, len(positions))
    assert sorted(np.concatenate(groups.members)) == list(range(len(positions)))
    for centroid, strength, members in zip(*groups, strict=True):
        np.testing.assert_allclose(strength, strengths[members].sum(axis=0))
        mass = strengths[members].sum(axis=1)
        np.testing.assert_allclose(centroid, mass @ positions[members] / mass.sum(), atol=1e-12)


def test_more_groups_keep_a_wave_better():
    positions, strengths = scattered(1)
    wave = np.exp(2j * np.pi * positions @ [1.0, 0.6])
    exact = strengths.sum(axis=1) @ wave

    def error(count):
        groups = group_lights(positions, strengths, count)
        return abs(groups.strengths.sum(axis=1) @ np.exp(2j * np.pi * groups.positions @ [1.0, 0.6]) - exact)

    assert error(300) < error(100) < error(5)
    # what a wave's modulus may lose: half of the phase's variance
    assert error(100) < 0.1 * strengths.sum()


def test_a_lamp_among_faint_lights_keeps_its_place():
    positions, strengths = scattered(2)
    strengths[17] = 1e5
    groups = group_lights(positions, strengths, 20)
    strongest = np.argmax(groups.strengths.sum(axis=1))
    np.testing.assert_allclose(groups.positions[strongest], positions[17], atol=1e-3)


def test_gathering_does_not_depend_on_the_lights_scale():
    positions, strengths = scattered(3)
    faint, bright = (group_lights(positions, scale * strengths, 30) for scale in (1.0, 2.0**20))
    np.testing.assert_array_equal(faint.positions, bright.positions)


def test_lights_in_one_place_are_one_group():
    groups = group_lights(np.full((50, 2), 0.1), np.ones((50, 3)), 8)
    assert len(groups.members) == 1
    np.testing.assert_allclose(groups.positions, [[0.1, 0.1]])


def test_darkness_has_no_groups():
    groups = group_lights(np.zeros((5, 2)), np.zeros((5, 3)), 8)
    assert groups.positions.shape == (0, 2)
    assert groups.strengths.shape == (0, 3)
    assert groups.members == ()
