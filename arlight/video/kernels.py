"""The inner loops of colour conversion, compiled. Planes hold codes; Y', Cb, Cr and R'G'B' are float32.

Tables are curves over [0, 1], evenly spaced, with their last entry repeated so that the entry after 1 exists. Indices
are unsigned: the compiler then leaves out Python's wrap-around.
"""

import numpy as np
from numba import njit

MIN_LUMA = np.float32(0.02)
"""Below this luma, relative to white, chroma is no longer scaled by it: there the ratio is noise."""
MAX_GAIN = np.float32(2.0)
"""Chroma follows luma at most by this factor upward; grey stripes seldom reach it, coloured edges would pass it."""
UNCHANGED = np.float32(1e-5)
"""Linear light within this of what a pixel had is no change: a thirtieth of an 8-bit level in the dark."""
ZERO, HALF, ONE = np.float32(0.0), np.float32(0.5), np.float32(1.0)


@njit(cache=True)
def interpolate(table, position):
    """Linear interpolation in a table over [0, 1]; clamps."""
    x = min(ONE, max(ZERO, position)) * np.float32(table.size - 2)
    i = np.uint32(x)
    return table[i] + (table[i + np.uint32(1)] - table[i]) * (x - np.float32(i))


@njit(cache=True)
def chroma_means(plane, black, scale, columns, column_weights, rows, row_weights):
    """Luma as chroma sees it: averaged with the chroma filter at each chroma sample."""
    first = columns.min()
    line = np.empty(columns.max() - first + 1, np.float32)
    out = np.empty((rows.shape[0], columns.shape[0]), np.float32)
    for r in range(out.shape[0]):
        line[:] = -black
        for j in range(row_weights.size):
            codes, weight = plane[rows[r, j]], row_weights[j]
            for x in range(line.size):
                line[x] += weight * np.float32(codes[first + x])
        for c in range(out.shape[1]):
            total = ZERO
            for i in range(column_weights.size):
                total += column_weights[i] * line[columns[c, i] - first]
            out[r, c] = total * scale
    return out


@njit(cache=True)
def full_resolution(luma, cb, cr, black, scale, neutral, chroma_scale, luma_low, guided, columns, rows):
    """Y', Cb, Cr (h, w, 3) at every pixel of a region, not clamped; see `conversion.Upsampling`.

    Args:
        luma_low: `chroma_means` of the region where `guided`, else not read.
        columns, rows: the region's `AxisGrid`s.
    """
    x0, cx0, count, left, right, weight_x = columns[:6]
    y0, cy0, _, above, below, weight_y = rows[:6]
    out = np.empty((above.size, left.size, 3), np.float32)
    line = np.zeros((3, count), np.float32)
    for y in range(above.size):
        wy, a, b = weight_y[y], above[y], below[y]
        for c in range(count):
            u, v = np.float32(cb[cy0 + a, cx0 + c]), np.float32(cr[cy0 + a, cx0 + c])
            line[0, c] = (u + wy * (np.float32(cb[cy0 + b, cx0 + c]) - u) - neutral) * chroma_scale
            line[1, c] = (v + wy * (np.float32(cr[cy0 + b, cx0 + c]) - v) - neutral) * chroma_scale
            if guided:
                line[2, c] = luma_low[a, c] + wy * (luma_low[b, c] - luma_low[a, c])
        for x in range(left.size):
            i, j, wx = np.uint32(left[x]), np.uint32(right[x]), weight_x[x]
            value = (np.float32(luma[y0 + y, x0 + x]) - black) * scale
            gain = ONE
            if guided:
                low = line[2, i] + wx * (line[2, j] - line[2, i])
                gain = min(MAX_GAIN, max(value, MIN_LUMA) / max(low, MIN_LUMA))
            out[y, x, 0] = value
            out[y, x, 1] = gain * (line[0, i] + wx * (line[0, j] - line[0, i]))
            out[y, x, 2] = gain * (line[1, i] + wx * (line[1, j] - line[1, i]))
    return out


@njit(cache=True)
def stack(first, second, third, x0, y0, x1, y1, black, scale):
    """A region (h, w, 3) of three full planes of codes as values, not clamped."""
    out = np.empty((y1 - y0, x1 - x0, 3), np.float32)
    for y in range(out.shape[0]):
        for x in range(out.shape[1]):
            out[y, x, 0] = (np.float32(first[y0 + y, x0 + x]) - black) * scale
            out[y, x, 1] = (np.float32(second[y0 + y, x0 + x]) - black) * scale
            out[y, x, 2] = (np.float32(third[y0 + y, x0 + x]) - black) * scale
    return out


@njit(cache=True)
def row_product(matrix, k, a, b, c):
    """Component k of matrix @ (a, b, c)."""
    return matrix[k, 0] * a + matrix[k, 1] * b + matrix[k, 2] * c


@njit(cache=True)
def to_rgb(image, matrix, table):
    """Y'CbCr (h, w, 3) to R'G'B' through `table`, in place."""
    for y in range(image.shape[0]):
        for x in range(image.shape[1]):
            a, b, c = image[y, x, 0], image[y, x, 1], image[y, x, 2]
            image[y, x, 0] = interpolate(table, row_product(matrix, 0, a, b, c))
            image[y, x, 1] = interpolate(table, row_product(matrix, 1, a, b, c))
            image[y, x, 2] = interpolate(table, row_product(matrix, 2, a, b, c))


@njit(cache=True)
def recombine(image, matrix):
    """Multiplies every pixel (h, w, 3) by a matrix, in place."""
    for y in range(image.shape[0]):
        for x in range(image.shape[1]):
            a, b, c = image[y, x, 0], image[y, x, 1], image[y, x, 2]
            image[y, x, 0] = row_product(matrix, 0, a, b, c)
            image[y, x, 1] = row_product(matrix, 1, a, b, c)
            image[y, x, 2] = row_product(matrix, 2, a, b, c)


@njit(cache=True)
def through_table(plane, x0, y0, x1, y1, black, scale, table):
    """A region (h, w) of codes as values through `table`."""
    out = np.empty((y1 - y0, x1 - x0), np.float32)
    for y in range(out.shape[0]):
        for x in range(out.shape[1]):
            out[y, x] = interpolate(table, (np.float32(plane[y0 + y, x0 + x]) - black) * scale)
    return out


@njit(cache=True)
def to_bytes(plane, black, scale):
    """Codes as uint8, 0 black and 255 white."""
    out = np.empty(plane.shape, np.uint8)
    factor = scale * np.float32(255.0)
    for y in range(plane.shape[0]):
        for x in range(plane.shape[1]):
            value = (np.float32(plane[y, x]) - black) * factor + HALF
            out[y, x] = np.uint8(min(np.float32(255.0), max(ZERO, value)))
    return out


@njit(cache=True)
def weighted_bytes(first, second, third, weights, black, scale):
    """Weighted sum of three planes of codes as uint8, 0 black and 255 white."""
    out = np.empty(first.shape, np.uint8)
    factor = scale * np.float32(255.0)
    a, b, c = weights
    for y in range(out.shape[0]):
        for x in range(out.shape[1]):
            code = a * np.float32(first[y, x]) + b * np.float32(second[y, x]) + c * np.float32(third[y, x])
            out[y, x] = np.uint8(min(np.float32(255.0), max(ZERO, (code - black) * factor + HALF)))
    return out


@njit(cache=True)
def replace_pixels(ycc, left, top, linear, to_rgb_matrix, to_ycc_matrix, decode, encode):
    """Puts new linear light (h, w, 3) at (left, top) of Y'CbCr (h, w, 3), in place, where it differs from the old.

    Args:
        decode: table from encoded values to linear light.
        encode: table from the square root of linear light to encoded values.

    Returns:
        Which pixels changed (h, w), 1 or 0.
    """
    changed = np.zeros(ycc.shape[:2], np.uint8)
    for y in range(linear.shape[0]):
        for x in range(linear.shape[1]):
            i, j = top + y, left + x
            a, b, c = ycc[i, j, 0], ycc[i, j, 1], ycc[i, j, 2]
            red, green, blue = linear[y, x, 0], linear[y, x, 1], linear[y, x, 2]
            difference = max(
                abs(red - interpolate(decode, row_product(to_rgb_matrix, 0, a, b, c))),
                abs(green - interpolate(decode, row_product(to_rgb_matrix, 1, a, b, c))),
                abs(blue - interpolate(decode, row_product(to_rgb_matrix, 2, a, b, c))),
            )
            if difference > UNCHANGED:
                changed[i, j] = 1
                red = interpolate(encode, np.sqrt(max(red, ZERO)))
                green = interpolate(encode, np.sqrt(max(green, ZERO)))
                blue = interpolate(encode, np.sqrt(max(blue, ZERO)))
                ycc[i, j, 0] = row_product(to_ycc_matrix, 0, red, green, blue)
                ycc[i, j, 1] = row_product(to_ycc_matrix, 1, red, green, blue)
                ycc[i, j, 2] = row_product(to_ycc_matrix, 2, red, green, blue)
    return changed


@njit(cache=True)
def write_plane(plane, x0, y0, values, channel, changed, zero, scale, top_code):
    """Rounds one channel of values (h, w, 3) into a plane at (x0, y0) where `changed`."""
    for y in range(values.shape[0]):
        for x in range(values.shape[1]):
            if changed[y, x]:
                code = np.floor(values[y, x, channel] * scale + zero + HALF)
                plane[y0 + y, x0 + x] = np.uint16(min(top_code, max(ZERO, code)))


@njit(cache=True)
def write_chroma(plane, own, new, channel, changed, x0, y0, columns, rows, zero, scale, top_code):
    """Averages one channel of new chroma (h, w, 3) into the samples whose pixels changed.

    What upsampling left unexplained of a sample (its code against the mean of its own pixels) stays, in the share of
    pixels that did not change. Samples that average pixels outside the region's array are left alone.
    """
    cx0, taps_x, weights_x = columns[1], columns[6], columns[7]
    cy0, taps_y, weights_y = rows[1], rows[6], rows[7]
    width = own.shape[1]
    share, before, after = np.empty(width, np.float32), np.empty(width, np.float32), np.empty(width, np.float32)
    for r in range(taps_y.shape[0]):
        if taps_y[r, 0] < y0 or taps_y[r, -1] >= y0 + own.shape[0]:
            continue
        share[:], before[:], after[:] = ZERO, ZERO, ZERO
        for j in range(weights_y.size):
            y, weight = taps_y[r, j] - y0, weights_y[j]
            for x in range(width):
                share[x] += weight * np.float32(changed[y, x])
                before[x] += weight * own[y, x, channel]
                after[x] += weight * new[y, x, channel]
        for c in range(taps_x.shape[0]):
            if taps_x[c, 0] < x0 or taps_x[c, -1] >= x0 + width:
                continue
            part, old, value = ZERO, ZERO, ZERO
            for i in range(weights_x.size):
                x, weight = taps_x[c, i] - x0, weights_x[i]
                part += weight * share[x]
                old += weight * before[x]
                value += weight * after[x]
            if part > ZERO:
                stored = (np.float32(plane[cy0 + r, cx0 + c]) - zero) / scale
                value += (ONE - part) * (stored - old)
                code = np.floor(value * scale + zero + HALF)
                plane[cy0 + r, cx0 + c] = np.uint16(min(top_code, max(ZERO, code)))


@njit(cache=True)
def average_chroma(image, channel, columns, column_weights, rows, row_weights, plane, zero, scale, top_code):
    """Averages one channel of a whole picture (h, w, 3) into a chroma plane of codes."""
    line = np.empty(image.shape[1], np.float32)
    for r in range(plane.shape[0]):
        line[:] = ZERO
        for j in range(row_weights.size):
            values, weight = image[rows[r, j]], row_weights[j]
            for x in range(line.size):
                line[x] += weight * values[x, channel]
        for c in range(plane.shape[1]):
            total = ZERO
            for i in range(column_weights.size):
                total += column_weights[i] * line[columns[c, i]]
            plane[r, c] = np.uint16(min(top_code, max(ZERO, np.floor(total * scale + zero + HALF))))
