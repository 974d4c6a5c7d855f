"""Compiled loops of the camera's view: a pixel's samples, and what light reaches each through glass and film.

`place` is (6,): the first texture sample's x and y [mm], samples per mm, the sheet's half width and height [mm], the
frame's pixels per mm; `glass` is (2,): its thickness [mm] and refractive index.
"""

import numpy as np
from numba import njit, prange


@njit(inline="always")
def _bilinear_weights(x, y, rows, columns):  # type: ignore[no-untyped-def]
    """Place and weights of the four samples around (x, y); the place is -1 outside."""
    column, row = int(np.floor(x)), int(np.floor(y))
    if column < 0 or row < 0 or column >= columns - 1 or row >= rows - 1:
        return -1, -1, 0.0, 0.0
    return row, column, np.float32(x - column), np.float32(y - row)


@njit(inline="always")
def _read(image, x, y):  # type: ignore[no-untyped-def]
    row, column, fx, fy = _bilinear_weights(x, y, image.shape[0], image.shape[1])
    if row < 0:
        return np.float32(0.0)
    upper = image[row, column] * (1 - fx) + image[row, column + 1] * fx
    lower = image[row + 1, column] * (1 - fx) + image[row + 1, column + 1] * fx
    return upper * (1 - fy) + lower * fy


@njit(inline="always")
def _add_paper(target, paper, x, y, weight):  # type: ignore[no-untyped-def]
    row, column, fx, fy = _bilinear_weights(x, y, paper.shape[0], paper.shape[1])
    if row < 0:
        return
    weight = np.float32(weight)
    a, b = weight * (1 - fx) * (1 - fy), weight * fx * (1 - fy)
    c, d = weight * (1 - fx) * fy, weight * fx * fy
    p, q = paper[row, column], paper[row, column + 1]
    r, s = paper[row + 1, column], paper[row + 1, column + 1]
    for k in range(target.size):
        target[k] += a * p[k] + b * q[k] + c * r[k] + d * s[k]


@njit(inline="always")
def _look_through(target, x, y, offset, face, mirrored, film, paper, place):  # type: ignore[no-untyped-def]
    """Add the radiance that leaves the upper face at (x, y) [mm] toward the viewer; offset is D(v) [mm]."""
    for k in range(target.size):
        target[k] += np.float32(face) * mirrored[k]
    left, top, per_mm = place[0], place[1], place[2]
    weight = (1.0 - face) * _read(film, (x - left) * per_mm, (top - y) * per_mm)
    for _ in range(6):
        if weight < 1e-5:
            return
        x, y = x - offset[0], y - offset[1]
        _add_paper(target, paper, (x - left) * per_mm, (top - y) * per_mm, weight * (1.0 - face) / np.pi)
        x, y = x - offset[0], y - offset[1]
        passed = _read(film, (x - left) * per_mm, (top - y) * per_mm)
        weight *= face * passed
        for k in range(target.size):
            target[k] += np.float32(weight * (1.0 - face)) * mirrored[k]
        weight *= face * passed


@njit(cache=True, fastmath=True)
def look_from_points(out, points, offset, face, mirrored, film, paper, place):  # type: ignore[no-untyped-def]
    for i in range(len(points)):
        _look_through(out[i], points[i, 0], points[i, 1], offset, face, mirrored, film, paper, place)


@njit(inline="always")
def _jitter(state, cell, samples):  # type: ignore[no-untyped-def]
    """The next state of a linear congruential generator, and a place in a stratum of the pixel, -1/2 to 1/2."""
    state = np.uint32(state * np.uint32(1664525) + np.uint32(1013904223))
    return state, (cell + (state >> np.uint32(8)) / 16777216.0) / samples - 0.5


@njit(inline="always")
def _toward_viewer(v, ray_map, rotation, x_px, y_px, jx, jy):  # type: ignore[no-untyped-def]
    """Unit vector from the sheet to the camera along a ray beside a pixel's centre."""
    height, width = ray_map.shape[:2]
    up, down = max(y_px - 1, 0), min(y_px + 1, height - 1)
    left, right = max(x_px - 1, 0), min(x_px + 1, width - 1)
    rx, ry = ray_map[y_px, x_px]
    rx += jx * (ray_map[y_px, right, 0] - ray_map[y_px, left, 0]) / (right - left)
    rx += jy * (ray_map[down, x_px, 0] - ray_map[up, x_px, 0]) / (down - up)
    ry += jx * (ray_map[y_px, right, 1] - ray_map[y_px, left, 1]) / (right - left)
    ry += jy * (ray_map[down, x_px, 1] - ray_map[up, x_px, 1]) / (down - up)
    for axis in range(3):
        v[axis] = -(rotation[axis, 0] * rx + rotation[axis, 1] * ry + rotation[axis, 2])
    v /= np.sqrt(v[0] ** 2 + v[1] ** 2 + v[2] ** 2)


@njit(inline="always")
def _frame_at(frame, x, y, place):  # type: ignore[no-untyped-def]
    """Reflectance of the frame, negative in its window."""
    row = min(int((place[4] - y) * place[5]), frame.shape[0] - 1)
    return frame[row, min(int((x + place[3]) * place[5]), frame.shape[1] - 1)]


@njit(inline="always")
def _look_at_glass(target, v, x, y, offset, mirrored, film, paper, place, glass, reflectance):  # type: ignore[no-untyped-def]
    stretch = glass[0] / np.sqrt(glass[1] ** 2 - v[0] ** 2 - v[1] ** 2)
    offset[0], offset[1] = v[0] * stretch, v[1] * stretch
    at = v[2] * (reflectance.size - 1)
    node = min(int(at), reflectance.size - 2)
    face = reflectance[node] + (at - node) * (reflectance[node + 1] - reflectance[node])
    _look_through(target, x, y, offset, face, mirrored, film, paper, place)


@njit(parallel=True, cache=True, fastmath=True)
def draw(  # type: ignore[no-untyped-def]
    image, first, mirrored, ray_map, rotation, centre, film, paper, frame, place, glass, reflectance, open_light, table,
    samples, seed,
):  # fmt: skip
    """Draw a rectangle of the image, each pixel the mean of samples x samples jittered rays."""
    rows, columns, channels = mirrored.shape
    for row in prange(rows):
        total = np.zeros(channels, np.float32)
        v, offset = np.zeros(3), np.zeros(2)
        y_px = row + first[1]
        state = np.uint32((seed * 9781 + y_px) * 6271 + 12345)
        for column in range(columns):
            x_px = column + first[0]
            total[:] = 0.0
            for sample in range(samples * samples):
                state, jx = _jitter(state, sample % samples, samples)
                state, jy = _jitter(state, sample // samples, samples)
                _toward_viewer(v, ray_map, rotation, x_px, y_px, jx, jy)
                x = centre[0] - v[0] * centre[2] / v[2]
                y = centre[1] - v[1] * centre[2] / v[2]
                if v[2] <= 0.0 or abs(x) >= place[3] or abs(y) >= place[4]:
                    for k in range(channels):
                        total[k] += table[k]
                    continue
                matte = _frame_at(frame, x, y, place)
                if matte >= 0.0:
                    for k in range(channels):
                        total[k] += matte * open_light[k]
                    continue
                _look_at_glass(total, v, x, y, offset, mirrored[row, column], film, paper, place, glass, reflectance)
            image[y_px, x_px, :] = total / np.float32(samples * samples)
