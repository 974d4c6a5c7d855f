"""Compiled loops over the pixels of the blocks; `blocks` says what they are for."""

import numpy as np
from numba import njit

ROWS = 7
"""What is kept of a block's fit: the mean, and cosine and sine of three harmonics."""
MAX_COLUMNS = 16
"""Columns of a block's fit at most: ten monomials of x and y up to degree 3, and the harmonics."""


@njit(cache=True)
def gather(boxes, centers, half_mm, reach_mm, margin_mm, cycles_per_mm, phase_rad, rays, plane_from_ray, camera_mm,
           glass_mm, index_squared, stride, pixels, positions, phases, first, views):  # fmt: skip
    """List the pixels whose film point and paper point both lie inside their block.

    The paper point must keep `reach_mm` from the block's border, so that all light that reaches it came through the
    block's own film; the film point must keep `margin_mm`, so that no neighbour is blurred into it.

    Fills pixels (n,) with flat indices, positions (n, 2) in [-1, 1], phases (n,) of the film's pattern, first (b + 1,)
    with the start of each block, views (b, 3) with sums of cos b, sin b and the view's cosine.
    """
    h, w = rays.shape[:2]
    count = 0
    capacity = pixels.shape[0]
    g = plane_from_ray
    for block in range(centers.shape[0]):
        first[block] = count
        cx, cy = centers[block]
        paper_limit = half_mm[block] - reach_mm
        fx, fy = cycles_per_mm[block]
        sum_cos = 0.0
        sum_sin = 0.0
        sum_view = 0.0
        step = stride[block]
        for top in range(max(boxes[block, 1], 0), min(boxes[block, 3] + 1, h), step):
            for left in range(max(boxes[block, 0], 0), min(boxes[block, 2] + 1, w), step):
                # any pixel of the cell: evenly spaced ones would alias the stripes
                chance = ((top * 73856093) ^ (left * 19349663)) >> 7
                row, column = top + chance % step, left + (chance // step) % step
                if row >= h or column >= w:
                    continue
                rx, ry = rays[row, column]
                depth = g[2, 0] * rx + g[2, 1] * ry + g[2, 2]
                qx = (g[0, 0] * rx + g[0, 1] * ry + g[0, 2]) / depth
                qy = (g[1, 0] * rx + g[1, 1] * ry + g[1, 2]) / depth
                if (
                    abs(qx - cx) > half_mm[block] - margin_mm[block, 0]
                    or abs(qy - cy) > half_mm[block] - margin_mm[block, 1]
                ):
                    continue
                vx, vy = camera_mm[0] - qx, camera_mm[1] - qy
                across = vx * vx + vy * vy
                total = across + camera_mm[2] * camera_mm[2]
                scale = glass_mm / np.sqrt(index_squared * total - across)
                px, py = qx - scale * vx, qy - scale * vy
                if abs(px - cx) > paper_limit or abs(py - cy) > paper_limit or count == capacity:
                    continue
                pixels[count] = row * w + column
                positions[count, 0] = (px - cx) / paper_limit
                positions[count, 1] = (py - cy) / paper_limit
                phases[count] = 2.0 * np.pi * (fx * qx + fy * qy) + phase_rad[block]
                view_phase = 2.0 * np.pi * scale * (fx * vx + fy * vy)
                sum_cos += np.cos(view_phase)
                sum_sin += np.sin(view_phase)
                sum_view += camera_mm[2] / np.sqrt(total)
                count += 1
        views[block, 0] = sum_cos
        views[block, 1] = sum_sin
        views[block, 2] = sum_view
    first[centers.shape[0]] = count


@njit(cache=True)
def fit(
    values, used, first, positions, phases, harmonics, degree, coefficients, covariance, variance, shading, samples
):
    """Least squares of each block's pixels on its harmonics and a polynomial of x and y.

    Args:
        values: (n, r) one row a pixel; used: (n,) False for pixels to leave out.
        harmonics: (b,) how many harmonics to fit.
        degree: (b,) of the polynomial, 1 to 3, or 0 to leave the block alone.

    Fills coefficients (b, 7, r) and their covariance (b, 7, 7) for unit variance, variance (b, r) of a pixel about the
    fit, shading (b, r), the slope from the block's middle to its border, samples (b,); blocks with too few pixels get
    0 samples. The polynomial's constant is the mean over the middle of the block's symmetric window, which is what the
    block's mean is without stripes.
    """
    rights = values.shape[1]
    normal = np.empty((MAX_COLUMNS, MAX_COLUMNS))
    inverse = np.empty((MAX_COLUMNS, MAX_COLUMNS))
    right = np.empty((MAX_COLUMNS, rights))
    squares = np.empty(rights)
    row = np.empty(MAX_COLUMNS)
    solved = np.empty(MAX_COLUMNS)
    for block in range(first.shape[0] - 1):
        if degree[block] == 0:
            continue
        kept = 1 + 2 * harmonics[block]
        columns = kept + (degree[block] + 1) * (degree[block] + 2) // 2 - 1
        normal[:] = 0.0
        right[:] = 0.0
        squares[:] = 0.0
        count = 0
        for i in range(first[block], first[block + 1]):
            if not used[i]:
                continue
            _fill_row(row, positions[i, 0], positions[i, 1], phases[i], harmonics[block], degree[block])
            for a in range(columns):
                for b in range(a + 1):
                    normal[a, b] += row[a] * row[b]
                for c in range(rights):
                    right[a, c] += row[a] * values[i, c]
            for c in range(rights):
                squares[c] += values[i, c] * values[i, c]
            count += 1
        coefficients[block] = 0.0
        covariance[block] = 0.0
        variance[block] = 0.0
        samples[block] = 0
        if count < 2 * columns or not _invert(normal, columns, inverse):
            continue
        samples[block] = count
        covariance[block, :kept, :kept] = inverse[:kept, :kept]
        for c in range(rights):
            explained = 0.0
            for a in range(columns):
                solved[a] = 0.0
                for b in range(columns):
                    solved[a] += inverse[a, b] * right[b, c]
                explained += solved[a] * right[a, c]
            coefficients[block, :kept, c] = solved[:kept]
            variance[block, c] = max(squares[c] - explained, 0.0) / (count - columns)
            shading[block, c] = np.hypot(solved[kept], solved[kept + 1])


@njit(cache=True)
def _fill_row(row, x, y, phase, harmonics, degree):
    """1, the harmonics, then monomials of rising degree; even ones less their mean over the square."""
    row[0] = 1.0
    at = 1
    if harmonics > 0:
        c1, s1 = np.cos(phase), np.sin(phase)
        c, s = c1, s1
        for _ in range(harmonics):
            row[at] = c
            row[at + 1] = s
            c, s = c * c1 - s * s1, s * c1 + c * s1
            at += 2
    row[at] = x
    row[at + 1] = y
    if degree > 1:
        row[at + 2] = x * x - 1.0 / 3.0
        row[at + 3] = x * y
        row[at + 4] = y * y - 1.0 / 3.0
    if degree > 2:
        row[at + 5] = x * x * x
        row[at + 6] = x * x * y
        row[at + 7] = x * y * y
        row[at + 8] = y * y * y


@njit(cache=True)
def _invert(normal, size, inverse):
    """Inverse of a positive definite matrix (lower half given) by Cholesky; False where it is too near singular."""
    factor = np.zeros((size, size))
    for i in range(size):
        for j in range(i + 1):
            total = normal[i, j]
            for k in range(j):
                total -= factor[i, k] * factor[j, k]
            if i == j:
                if total <= 1e-6 * normal[i, i] or total <= 0.0:
                    return False
                factor[i, i] = np.sqrt(total)
            else:
                factor[i, j] = total / factor[j, j]
    solved = np.zeros((size, size))
    for i in range(size):
        solved[i, i] = 1.0 / factor[i, i]
        for j in range(i):
            total = 0.0
            for k in range(j, i):
                total -= factor[i, k] * solved[k, j]
            solved[i, j] = total / factor[i, i]
    for i in range(size):
        for j in range(size):
            total = 0.0
            for k in range(max(i, j), size):
                total += solved[k, i] * solved[k, j]
            inverse[i, j] = total
    return True


@njit(cache=True)
def read_codes(plane, shift_x, shift_y, width, pixels, count, offset, scale, column, out):
    """out[i, column] = (code - offset) * scale of the plane's sample that pixel i shares."""
    for i in range(count):
        row = pixels[i] // width
        out[i, column] = (plane[row >> shift_y, (pixels[i] - row * width) >> shift_x] - offset) * scale


@njit(cache=True)
def block_average(values, first, average):
    """average (b, c): mean of values (n, c) over each block's pixels."""
    for block in range(first.shape[0] - 1):
        start, stop = first[block], first[block + 1]
        for c in range(values.shape[1]):
            total = 0.0
            for i in range(start, stop):
                total += values[i, c]
            average[block, c] = total / max(stop - start, 1)


@njit(cache=True)
def flatten_chroma(first, flat, expected):
    """Chroma 0 for the pixels of blocks of one colour: their own mean is all that is to be known."""
    for block in range(first.shape[0] - 1):
        if flat[block]:
            expected[first[block] : first[block + 1]] = 0.0


@njit(cache=True)
def modelled_chroma(ycc, first, phases, stripes, ycc_from_rgb, encoding, expected):
    """Chroma (n, 2) of each pixel from the radiance (b, 7, 3) that a model gives its block at the pixel's phase.

    Where the pixel is brighter or darker than the model its chroma is taken to scale with its luma. `encoding` holds
    encoded values over the square root of linear light.
    """
    last = encoding.shape[0] - 1
    for block in range(first.shape[0] - 1):
        for i in range(first[block], first[block + 1]):
            c1, s1 = np.cos(phases[i]), np.sin(phases[i])
            c2, s2 = c1 * c1 - s1 * s1, 2.0 * s1 * c1
            c3, s3 = c2 * c1 - s2 * s1, s2 * c1 + c2 * s1
            luma, blue, red = 0.0, 0.0, 0.0
            for k in range(3):
                v = stripes[block, :, k]
                light = v[0] + v[1] * c1 + v[2] * s1 + v[3] * c2 + v[4] * s2 + v[5] * c3 + v[6] * s3
                x = np.sqrt(min(max(light, 0.0), 1.0)) * last
                j = min(int(x), last - 1)
                e = encoding[j] + (x - j) * (encoding[j + 1] - encoding[j])
                luma += ycc_from_rgb[0, k] * e
                blue += ycc_from_rgb[1, k] * e
                red += ycc_from_rgb[2, k] * e
            scale = min(max(ycc[i, 0] / max(luma, 0.02), 0.5), 2.0)
            expected[i, 0] = scale * blue
            expected[i, 1] = scale * red


@njit(cache=True)
def correct_chroma(ycc, first, phases, expected, shift, swing):
    """Replace the chroma in ycc (n, 3) by the expected one plus its block's correction.

    The correction's mean `shift` (b, 2) grows with the pixel's luma above the block's darkest, because colour
    differences scale with the light of the stripes; `swing` (b, 2, 2) are its cosine and sine at the stripes' phase.
    """
    for block in range(first.shape[0] - 1):
        start, stop = first[block], first[block + 1]
        total = 0.0
        dark = 1.0
        for i in range(start, stop):
            dark = min(dark, max(ycc[i, 0], 0.0))
        for i in range(start, stop):
            total += max(ycc[i, 0], 0.0) - dark + 0.02
        mean = total / max(stop - start, 1)
        for i in range(start, stop):
            weight = (max(ycc[i, 0], 0.0) - dark + 0.02) / mean
            c, s = np.cos(phases[i]), np.sin(phases[i])
            for k in range(2):
                ycc[i, 1 + k] = (
                    expected[i, k] + shift[block, k] * weight + swing[block, k, 0] * c + swing[block, k, 1] * s
                )


@njit(cache=True)
def linearise(encoded, count, matrix, table, linear):
    """Linear RGB (n, 3) of encoded triples by matrix and transfer table."""
    last = table.shape[0] - 1
    for i in range(count):
        for c in range(3):
            e = matrix[c, 0] * encoded[i, 0] + matrix[c, 1] * encoded[i, 1] + matrix[c, 2] * encoded[i, 2]
            x = min(max(e, 0.0), 1.0) * last
            k = min(int(x), last - 1)
            linear[i, c] = table[k] + (x - k) * (table[k + 1] - table[k])


@njit(cache=True)
def below(linear, first, ceiling, used):
    """Mark the pixels all of whose channels are below their block's ceiling (b, 3)."""
    for block in range(first.shape[0] - 1):
        for i in range(first[block], first[block + 1]):
            used[i] = True
            for c in range(3):
                if linear[i, c] > ceiling[block, c]:
                    used[i] = False
