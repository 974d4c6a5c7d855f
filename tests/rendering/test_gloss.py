import numpy as np
import pytest

from arlight.environment import Environment
from arlight.fourier import pack_real
from arlight.rendering.gloss import gloss_rows, octahedral_directions
from arlight.rendering.reconstruction import reconstruct


def test_octahedral_directions_cover_the_sphere_evenly_enough():
    w = octahedral_directions(32)
    assert np.allclose(np.linalg.norm(w, axis=1), 1.0)
    assert np.abs(w.mean(axis=0)).max() < 1e-9
    assert np.count_nonzero(w[:, 2] > 1e-9) == np.count_nonzero(w[:, 2] < -1e-9) > 450
    # every direction has a texel near it
    rng = np.random.default_rng(0)
    v = rng.standard_normal((200, 3))
    v /= np.linalg.norm(v, axis=1, keepdims=True)
    assert (v @ w.T).max(axis=1).min() > np.cos(np.radians(5.0))


def test_a_narrow_lobe_sees_the_radiance_itself(reconstruction, environment, probe):
    packed = pack_real(environment.coefficients(probe.slab, probe.frequencies))
    w = octahedral_directions(32)
    high = w[:, 2] > 0.3
    mirrored = gloss_rows(reconstruction, 0.1) @ packed
    radiance = reconstruction.radiance_rows(w) @ packed
    assert np.abs(mirrored - radiance)[high].max() < 0.08 * radiance.max()


def test_a_wide_lobe_blurs(reconstruction, environment, probe):
    packed = pack_real(environment.coefficients(probe.slab, probe.frequencies))
    spread = [np.ptp(gloss_rows(reconstruction, r) @ packed, axis=0) for r in (0.2, 0.5, 0.9)]
    assert np.all(spread[0] > spread[1])
    assert np.all(spread[1] > spread[2])


def test_uniform_surroundings_are_mirrored_as_they_are(probe):
    packed = pack_real(Environment(np.ones((64, 128, 3), np.float32)).coefficients(probe.slab, probe.frequencies))
    mirrored = gloss_rows(reconstruct(probe.slab, probe.frequencies, 1.0), 0.6) @ packed
    assert np.abs(mirrored - 1.0).max() < 0.05


@pytest.mark.parametrize("roughness", [0.0, 1.5, np.nan])
def test_impossible_roughness_is_refused(reconstruction, roughness):
    with pytest.raises(ValueError, match="roughness"):
        gloss_rows(reconstruction, roughness)
