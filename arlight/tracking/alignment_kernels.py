"""Compiled: the normal equations of the alignment.

Plain loops over plain arrays, without linear algebra calls, so that a cold compilation stays short.

Feature vector of a point, in this order: [T, u T, v T, 1 | 6 pose derivatives | I], with T the template (0 black,
1 white), I the picture in linear light. The first four absorb a marker's lighting: gain, its slope, and bias.
"""

import math

import numpy as np
from numba import njit

from arlight.tracking.lens import project

LIGHTING = 4
POSE = 6
FEATURES = LIGHTING + POSE + 1
SMALLEST_VARIANCE = 4e-4
"""Residual variance, relative to the gain's square, that no marker is trusted beyond: 2 % of the contrast."""


@njit(cache=True, error_model="numpy")
def sample(codes, table, x, y):
    """Linear light between four pixels; -1 outside the picture."""
    height, width = codes.shape
    if not (x >= 0.0 and y >= 0.0 and x <= width - 1 and y <= height - 1):
        return -1.0
    i, j = min(int(x), width - 2), min(int(y), height - 2)
    a, b = x - i, y - j
    top = table[codes[j, i]] * (1.0 - a) + table[codes[j, i + 1]] * a
    bottom = table[codes[j + 1, i]] * (1.0 - a) + table[codes[j + 1, i + 1]] * a
    return top * (1.0 - b) + bottom * b


@njit(cache=True, error_model="numpy")
def observe(codes, table, window, camera, pose, place, size, points, values, f):
    """Features of one marker's points, a column each; -1 in the last row where a point is outside the picture.

    Args:
        codes, table, window: luma codes, their linear light, and x0, y0, scale of `codes` in the frame.
        camera, pose: as in `project`; rotation row by row, translation.
        place: origin, one module to the right, one module down (x, y each) on the sheet [mm].
        size: modules on a side.
        points, values: as `render` leaves them.
        f: (11, p) the features.

    The pose derivatives (rotation about the sheet's origin, translation) are taken on the plane, where lens distortion
    cancels: dT/dpose = dT/d(u, v) (dx/d(u, v))^-1 dx/dpose with x the undistorted image.
    """
    step = np.empty(6)
    for k in range(3):
        step[k] = pose[3 * k] * place[2] + pose[3 * k + 1] * place[3]
        step[3 + k] = pose[3 * k] * place[4] + pose[3 * k + 1] * place[5]
    for p in range(f.shape[1]):
        u, v = points[0, p], points[1, p]
        t, tu, tv = values[0, p], values[1, p], values[2, p]
        x_mm = place[0] + u * place[2] + v * place[4]
        y_mm = place[1] + u * place[3] + v * place[5]
        qx, qy, qz = pose[0] * x_mm + pose[1] * y_mm, pose[3] * x_mm + pose[4] * y_mm, pose[6] * x_mm + pose[7] * y_mm
        z = max(qz + pose[11], 1e-6)
        x, y = (qx + pose[9]) / z, (qy + pose[10]) / z
        xu, yu, xv, yv = step[0] - x * step[2], step[1] - y * step[2], step[3] - x * step[5], step[4] - y * step[5]
        determinant = xu * yv - xv * yu
        a, b = (tu * yv - tv * yu) / determinant, (tv * xu - tu * xv) / determinant
        c = -(a * x + b * y)
        f[0, p], f[1, p], f[2, p], f[3, p] = t, t * (2.0 * u / size - 1.0), t * (2.0 * v / size - 1.0), 1.0
        f[4, p], f[5, p], f[6, p] = qy * c - qz * b, qz * a - qx * c, qx * b - qy * a
        f[7, p], f[8, p], f[9, p] = a, b, c
        x, y = project(camera, x, y)
        f[10, p] = sample(
            codes, table, (x - window[0] + 0.5) * window[2] - 0.5, (y - window[1] + 0.5) * window[2] - 0.5
        )


@njit(cache=True, error_model="numpy")
def weigh(f, coefficients, limit, weights):
    """Weights of points against outliers, 0 outside the picture; the number inside and the correlation of T with I.

    coefficients: the marker's lighting in the step before, 0 when there is none. limit: residuals above it, relative to
    the gain, lose weight.
    """
    bound = limit * coefficients[0]
    n, st, si, stt, sii, sti = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for p in range(f.shape[1]):
        t, light = f[0, p], f[10, p]
        inside = 1.0 if light >= 0.0 else 0.0
        residual = light - coefficients[0] * t - coefficients[1] * f[1, p] - coefficients[2] * f[2, p] - coefficients[3]
        relative = residual / bound if bound > 0.0 else 0.0
        weights[p] = inside / (1.0 + relative * relative)
        n, st, si = n + inside, st + inside * t, si + inside * light
        stt, sii, sti = stt + inside * t * t, sii + inside * light * light, sti + inside * t * light
    spread = (n * stt - st * st) * (n * sii - si * si)
    return n, (n * sti - st * si) / math.sqrt(spread) if spread > 1e-12 else 0.0


@njit(cache=True, error_model="numpy", fastmath={"reassoc", "contract", "nsz"})
def weighted_gram(f, weights, scratch, gram):
    """Weighted products of all pairs of features, summed over the points."""
    for i in range(FEATURES):
        for p in range(f.shape[1]):
            scratch[p] = weights[p] * f[i, p]
        for j in range(i, FEATURES):
            total = 0.0
            for p in range(f.shape[1]):
                total += scratch[p] * f[j, p]
            gram[i, j] = total
            gram[j, i] = total


@njit(cache=True, error_model="numpy")
def eliminate_lighting(gram, coefficients):
    """Gauss elimination of a marker's lighting, in place, and its solution; what is left is the Schur complement."""
    for k in range(LIGHTING):
        if gram[k, k] <= 1e-12:
            continue
        for i in range(k + 1, FEATURES):
            factor = gram[k, i] / gram[k, k]
            for j in range(k + 1, FEATURES):
                gram[i, j] -= factor * gram[k, j]
    for k in range(LIGHTING - 1, -1, -1):
        value = gram[k, FEATURES - 1]
        for j in range(k + 1, LIGHTING):
            value -= gram[k, j] * coefficients[j]
        coefficients[k] = value / gram[k, k] if gram[k, k] > 1e-12 else 0.0


@njit(cache=True, error_model="numpy")
def linearise(codes, table, window, camera, pose, places, size, points, values, floor, limit,
              coefficients, features, scratch, gram, correlation, weight, normal):  # fmt: skip
    """The pose's normal equations from all markers at a pose; the number of markers that take part.

    Args:
        codes ... values: as in `observe`, for all markers.
        floor: correlation below which a marker counts as occluded.
        limit: as in `weigh`.
        coefficients: (m, 4) lighting, read for the weights and replaced.
        features (m, 11, p), scratch (2, p), gram (m, 11, 11): left behind, the lighting eliminated from `gram`; of each
            marker's points, only the first p are used.
        correlation, weight: (m,) of each marker; weight 0 is left out.
        normal: (7, 7) sum over the markers of weight * gram[4:, 4:], in units of their gains.
    """
    normal[:] = 0.0
    used = 0
    for m in range(gram.shape[0]):
        f = features[m]
        observe(codes, table, window, camera, pose, places[m], size, points[m], values[m], f)
        inside, correlation[m] = weigh(f, coefficients[m], limit, scratch[0])
        weighted_gram(f, scratch[0], scratch[1], gram[m])
        eliminate_lighting(gram[m], coefficients[m])
        gain = coefficients[m, 0]
        weight[m] = 0.0
        if inside < 0.5 * f.shape[1] or correlation[m] < floor or gain <= 0.0:
            continue
        variance = max(gram[m, FEATURES - 1, FEATURES - 1], 0.0) / (gain * gain * inside)
        weight[m] = 1.0 / (variance + SMALLEST_VARIANCE)
        used += 1
        for i in range(POSE + 1):
            for j in range(POSE + 1):
                scale = (1.0 if i < POSE else 1.0 / gain) * (1.0 if j < POSE else 1.0 / gain)
                normal[i, j] += weight[m] * scale * gram[m, LIGHTING + i, LIGHTING + j]
    return used
