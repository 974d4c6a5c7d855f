"""The inner loops of colour conversion, compiled. Planes are codes; Y', Cb, Cr and R'G'B' are float, 1 is full scale."""

import numpy as np
from numba import njit

MIN_LUMA = np.float32(0.02)
"""Below this luma, relative to white, chroma is no longer scaled by it: there the ratio is noise."""
MAX_GAIN = np.float32(2.0)
"""Chroma follows luma at most by this factor upward; the ratio of box means seldom exceeds it."""
UNCHANGED = np.float32(1e-5)
"""Linear light within this of what a pixel had is not a change: a thirtieth of an 8-bit level in the dark."""


@njit(cache=True)
def interpolate(table, position):
    """Linear interpolation in a table over [0, 1]; clamps."""
    last = table.size - 1
    if not position > 0.0:
        return table[0]
    if position >= 1.0:
        return table[last]
    x = position * np.float32(last)
    i = np.int32(x)
    return table[i] + (table[i + 1] - table[i]) * (x - np.float32(i))


@njit(cache=True)
def chroma_means(plane, black, scale, columns, column_weights, rows, row_weights):
    """Luma as chroma sees it: averaged with the chroma filter at each chroma sample."""
    out = np.empty((rows.shape[0], columns.shape[0]), np.float32)
    for r in range(rows.shape[0]):
        for c in range(columns.shape[0]):
            total = np.float32(0.0)
            for j in range(row_weights.size):
                line = np.float32(0.0)
                for i in range(column_weights.size):
                    line += column_weights[i] * np.float32(plane[rows[r, j], columns[c, i]])
                total += row_weights[j] * line
            out[r, c] = (total - black) * scale
    return out


@njit(cache=True)
def full_resolution(luma, cb, cr, black, scale, neutral, chroma_scale, luma_low, guided, columns, rows):
    """Y', Cb, Cr (h, w, 3) at every pixel of a region, not clamped; see `conversion.Upsampling`."""
    x0, cx0, count, left, right, weight_x = columns[:6]
    y0, cy0, _, above, below, weight_y = rows[:6]
    out = np.empty((above.size, left.size, 3), np.float32)
    line = np.empty((3, count), np.float32)
    for y in range(above.size):
        wy = weight_y[y]
        a, b = above[y], below[y]
        for c in range(count):
            u = np.float32(cb[cy0 + a, cx0 + c])
            v = np.float32(cr[cy0 + a, cx0 + c])
            line[0, c] = (u + wy * (np.float32(cb[cy0 + b, cx0 + c]) - u) - neutral) * chroma_scale
            line[1, c] = (v + wy * (np.float32(cr[cy0 + b, cx0 + c]) - v) - neutral) * chroma_scale
            if guided:
                line[2, c] = luma_low[a, c] + wy * (luma_low[b, c] - luma_low[a, c])
        for x in range(left.size):
            l, r, wx = left[x], right[x], weight_x[x]  # noqa: E741
            value = (np.float32(luma[y0 + y, x0 + x]) - black) * scale
            gain = np.float32(1.0)
            if guided:
                low = line[2, l] + wx * (line[2, r] - line[2, l])
                gain = min(MAX_GAIN, max(value, MIN_LUMA) / max(low, MIN_LUMA))
            out[y, x, 0] = value
            out[y, x, 1] = gain * (line[0, l] + wx * (line[0, r] - line[0, l]))
            out[y, x, 2] = gain * (line[1, l] + wx * (line[1, r] - line[1, l]))
    return out


@njit(cache=True)
def to_rgb(image, matrix, table):
    """Y'CbCr (h, w, 3) to R'G'B' through `table` (values over [0, 1]), in place."""
    for y in range(image.shape[0]):
        for x in range(image.shape[1]):
            a, b, c = image[y, x, 0], image[y, x, 1], image[y, x, 2]
            for k in range(3):
                image[y, x, k] = interpolate(table, matrix[k, 0] * a + matrix[k, 1] * b + matrix[k, 2] * c)


@njit(cache=True)
def scaled(plane, x0, y0, x1, y1, black, scale, table):
    """A region of codes as values through `table`."""
    out = np.empty((y1 - y0, x1 - x0), np.float32)
    for y in range(out.shape[0]):
        for x in range(out.shape[1]):
            out[y, x] = interpolate(table, (np.float32(plane[y0 + y, x0 + x]) - black) * scale)
    return out


@njit(cache=True)
def quantised(plane, black, scale):
    """Codes as uint8, 0 black and 255 white."""
    out = np.empty(plane.shape, np.uint8)
    for y in range(plane.shape[0]):
        for x in range(plane.shape[1]):
            value = (np.float32(plane[y, x]) - black) * scale * np.float32(255.0) + np.float32(0.5)
            out[y, x] = np.uint8(min(np.float32(255.0), max(np.float32(0.0), value)))
    return out


@njit(cache=True)
def replace_pixels(ycc, left, top, linear, to_rgb_matrix, to_ycc_matrix, decode, encode):
    """Puts new linear light (h, w, 3) at (left, top) of Y'CbCr (h, w, 3), in place.

    Returns:
        Which pixels changed (h, w), 1 or 0.
    """
    changed = np.zeros(ycc.shape[:2], np.uint8)
    encoded = np.empty(3, np.float32)
    for y in range(linear.shape[0]):
        for x in range(linear.shape[1]):
            pixel = ycc[top + y, left + x]
            a, b, c = pixel[0], pixel[1], pixel[2]
            differs = False
            for k in range(3):
                own = interpolate(decode, to_rgb_matrix[k, 0] * a + to_rgb_matrix[k, 1] * b + to_rgb_matrix[k, 2] * c)
                differs = differs or not abs(linear[y, x, k] - own) <= UNCHANGED
            if differs:
                changed[top + y, left + x] = 1
                for k in range(3):
                    encoded[k] = interpolate(encode, np.sqrt(max(linear[y, x, k], np.float32(0.0))))
                for k in range(3):
                    pixel[k] = (
                        to_ycc_matrix[k, 0] * encoded[0]
                        + to_ycc_matrix[k, 1] * encoded[1]
                        + to_ycc_matrix[k, 2] * encoded[2]
                    )
    return changed


@njit(cache=True)
def write_plane(plane, x0, y0, values, changed, zero, scale, top_code):
    """Rounds values (h, w) into a plane at (x0, y0) where `changed`."""
    for y in range(values.shape[0]):
        for x in range(values.shape[1]):
            if changed[y, x]:
                code = np.floor(values[y, x] * scale + zero + np.float32(0.5))
                plane[y0 + y, x0 + x] = plane.dtype.type(min(top_code, max(np.float32(0.0), code)))


@njit(cache=True)
def write_chroma(plane, own, new, changed, x0, y0, columns, rows, zero, scale, top_code):
    """Averages new chroma into the samples whose pixels changed.

    What upsampling left unexplained in a sample (its code against the mean of its own pixels) stays in the share of pixels
    that did not change.
    """
    cx0, cy0 = columns[1], rows[1]
    taps_x, weights_x, taps_y, weights_y = columns[6], columns[7], rows[6], rows[7]
    for r in range(taps_y.shape[0]):
        for c in range(taps_x.shape[0]):
            share, before, after = np.float32(0.0), np.float32(0.0), np.float32(0.0)
            inside = True
            for j in range(weights_y.size):
                for i in range(weights_x.size):
                    y, x = taps_y[r, j] - y0, taps_x[c, i] - x0
                    if y < 0 or x < 0 or y >= own.shape[0] or x >= own.shape[1]:
                        inside = False
                        continue
                    weight = weights_y[j] * weights_x[i]
                    share += weight * np.float32(changed[y, x])
                    before += weight * own[y, x]
                    after += weight * new[y, x]
            if inside and share > 0.0:
                code = np.float32(plane[cy0 + r, cx0 + c])
                value = after + (np.float32(1.0) - share) * ((code - zero) / scale - before)
                code = np.floor(value * scale + zero + np.float32(0.5))
                plane[cy0 + r, cx0 + c] = plane.dtype.type(min(top_code, max(np.float32(0.0), code)))
