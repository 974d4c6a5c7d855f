"""Compiled: error diffusion."""

import numpy as np
from numba import njit

_THRESHOLD_NOISE = 0.3
"""Width of the threshold's noise: breaks up worms, and takes part of the sharpening away."""


@njit(cache=True)
def diffuse(target, seed):
    """Floyd and Steinberg's error diffusion on a serpentine path with a noisy threshold.

    Args:
        target: (rows, columns) float32, about [0, 1].
        seed: of the noise.

    Returns:
        (rows, columns) uint8, 1 or 0; even areas of exactly 0 or 1 have no dots of the other kind once settled.
    """
    rows, columns = target.shape
    dots = np.zeros((rows, columns), np.uint8)
    # a column beyond either end spares the tests
    here, below = np.zeros(columns + 2), np.zeros(columns + 2)
    state = np.uint64(seed) * np.uint64(0x9E3779B97F4A7C15) + np.uint64(0xD1B54A32D192ED03)
    for y in range(rows):
        step = -1 if y & 1 else 1
        x = columns - 1 if y & 1 else 0
        below[:] = 0.0
        for _ in range(columns):
            # xorshift: enough for a threshold, and the same on every machine
            state ^= state << np.uint64(13)
            state ^= state >> np.uint64(7)
            state ^= state << np.uint64(17)
            noise = (float(state >> np.uint64(40)) / 16777216.0 - 0.5) * _THRESHOLD_NOISE
            value = target[y, x] + here[x + 1]
            error = value
            if value > 0.5 + noise:
                dots[y, x] = 1
                error = value - 1.0
            here[x + 1 + step] += error * (7.0 / 16.0)
            below[x + 1 - step] += error * (3.0 / 16.0)
            below[x + 1] += error * (5.0 / 16.0)
            below[x + 1 + step] += error * (1.0 / 16.0)
            x += step
        here, below = below, here
    return dots
