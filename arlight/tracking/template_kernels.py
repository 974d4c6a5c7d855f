"""Compiled: the template at the picture's blur, at the points that alignment compares."""

import math

import numpy as np
from numba import njit

MAX_REACH_MODULES = 0.9
"""How far from an edge a point may lie: the quiet zone is only sure to be one module wide."""


@njit(cache=True, error_model="numpy")
def render(black, base, spread, index_u, index_v, sigma, reach, points, values):
    """The template at its points: points[m, :, p] = (u, v) [modules], values[m, :, p] = (T, dT/du, dT/dv).

    sigma, reach: (m, 2) blur on each marker's axes, and the deviation that spaces the points [modules].
    """
    size, places = black.shape[1], base.shape[0]
    coordinates = np.empty((2, places))
    share, slope = np.empty((2, places, size + 1)), np.empty((2, places, size + 1))
    for m in range(black.shape[0]):
        for axis in range(2):
            for i in range(places):
                offset = min(max(spread[i] * reach[m, axis], -MAX_REACH_MODULES), MAX_REACH_MODULES)
                coordinates[axis, i] = base[i] + offset
            _blurred_modules(coordinates[axis], sigma[m, axis], share[axis], slope[axis])
        _over_columns(black[m], share[0])
        _over_columns(black[m], slope[0])
        for p in range(index_u.shape[1]):
            i, j = index_u[m, p], index_v[m, p]
            t, tu, tv = 1.0, 0.0, 0.0
            for row in range(size):
                t -= share[1, j, row] * share[0, i, row]
                tu -= share[1, j, row] * slope[0, i, row]
                tv -= slope[1, j, row] * share[0, i, row]
            points[m, 0, p], points[m, 1, p] = coordinates[0, i], coordinates[1, j]
            values[m, 0, p], values[m, 1, p], values[m, 2, p] = t, tu, tv


@njit(cache=True, error_model="numpy")
def _blurred_modules(position, sigma, share, slope):
    """Share (and its derivative) of each module, a unit box of one axis, that a Gaussian at a position sees."""
    size = share.shape[1] - 1
    for i in range(position.shape[0]):
        for line in range(size + 1):
            z = (position[i] - line) / sigma
            share[i, line] = 1.0 if z > 0.0 else 0.0
            slope[i, line] = 0.0
            if abs(z) < 4.5:
                share[i, line] = 0.5 + 0.5 * math.erf(z * 0.7071067811865476)
                slope[i, line] = 0.3989422804014327 * math.exp(-0.5 * z * z) / sigma
        for line in range(size):
            share[i, line] -= share[i, line + 1]
            slope[i, line] -= slope[i, line + 1]


@njit(cache=True, error_model="numpy")
def _over_columns(black, of_column):
    """Replace, at each position, the shares of the columns by their sums over the black modules of each row."""
    size = black.shape[0]
    sums = np.empty(size)
    for i in range(of_column.shape[0]):
        for row in range(size):
            sums[row] = 0.0
            for column in range(size):
                sums[row] += black[row, column] * of_column[i, column]
        for row in range(size):
            of_column[i, row] = sums[row]
