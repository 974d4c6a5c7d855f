/* Sorts a frame's measurements into planes, and reads off them how bright white is and how much the film mirrors. */
#ifndef ARLIGHT_GATHERING_H
#define ARLIGHT_GATHERING_H

#include "measured_blocks.h"
#include "quantile.h"
#include "reflection.h"

#define DARKEST 1e-3        /* white, at least */
#define PATTERN_TO_WHITE 8. /* how much brighter white is than the mean of a pattern, about */
#define FIELD_FLOOR 1e-3    /* least standard deviation of the mirror reflection, relative to white */

#define NOTHING_LEFT 1e-30  /* least share whose logarithm is taken */

/* One block's rows and their covariance; zeros where nothing was seen. */
INLINE void gather_rows(const MeasuredBlocks *m, int64_t j, int64_t i, int rows)
{
    const int64_t n = m->stride;
    const double *values = m->values + i * ROWS * CHANNELS, *covariance = m->covariance + i * ROWS * ROWS;
    double *measured = m->measured + j, *pixels = m->pixels + j;
    for (int r = 0, pair = 0; r < ROWS; r++) {
        for (int c = 0; c < CHANNELS; c++)
            measured[(c * ROWS + r) * n] = r < rows ? values[r * CHANNELS + c] : 0.0;
        for (int s = 0; s <= r; s++, pair++)
            pixels[pair * n] = r < rows ? covariance[r * ROWS + s] : 0.0;
    }
}

/* What else is known of a block; `seen` or not. */
INLINE void gather_rest(const MeasuredBlocks *m, int64_t j, int64_t i, int seen)
{
    const int64_t n = m->stride;
    for (int c = 0; c < CHANNELS; c++) {
        m->noise[c * n + j] = seen ? m->pixel_variance[i * CHANNELS + c] : 0.0;
        m->uneven[c * n + j] = seen ? m->shading[i * CHANNELS + c] : 0.0;
    }
    m->resolved[j] = seen ? (double)m->harmonics[i] : 0.0;
    m->seen[j] = seen;
    m->trust[j] = m->color_trust[i];
    m->phasor[j] = m->view_phasor[2 * i];
    m->phasor[n + j] = m->view_phasor[2 * i + 1];
    m->cosine[j] = m->view_cosine[i];
    m->cycles[j] = m->cycles_per_px[2 * i];
    m->cycles[n + j] = m->cycles_per_px[2 * i + 1];
}

/* All blocks; lanes beyond them repeat the last one, unseen. */
static HOT void gather_blocks(const MeasuredBlocks *m)
{
    int64_t whole = (m->blocks + LANES - 1) / LANES * LANES;
    for (int64_t j = 0; j < whole; j++) {
        int64_t i = m->sequence[j < m->blocks ? j : m->blocks - 1];
        int seen = j < m->blocks && m->valid[i];
        gather_rows(m, j, i, seen ? 1 + 2 * (int)m->harmonics[i] : 0);
        gather_rest(m, j, i, seen);
    }
}

/* sin(pi f) / (pi f) and cos(pi f). */
INLINE lanes sinc(lanes f, lanes *cosine)
{
    lanes whole = nearest(f), sine_over, rest = f - whole;
    half_turn(rest, &sine_over, cosine);
    /* half turns change the sign */
    lanes odd = whole - 2.0 * nearest(0.5 * whole), sign = 1.0 - 2.0 * odd * odd;
    *cosine *= sign;
    lane_bits middle = whole == 0.0;
    lanes beyond = sign * rest * sine_over / select_lanes(middle, splat(1.0), f);
    return select_lanes(middle, sine_over, beyond) / PI;
}

/* What a pixel's square leaves of the harmonics: sinc(m f) of both axes, by the sines of multiple angles. */
static HOT void square_pixels(const MeasuredBlocks *m)
{
    int64_t n = m->stride;
    for (int64_t j = 0; j < m->blocks; j += LANES) {
        lanes x, y, sinc_x = sinc(load(m->cycles + j), &x), sinc_y = sinc(load(m->cycles + n + j), &y);
        lanes first = sinc_x * sinc_y;
        const lanes left[] = {first, first * x * y, first * (4.0 * x * x - 1.0) * (4.0 * y * y - 1.0) / 9.0};
        for (int h = 0; h < HARMONICS; h++) {
            lanes turn = splat(2.0 * PI * (h + 1)), fourth = splat(0.0);
            for (int axis = 0; axis < 2; axis++) {
                /* pixels show no wave beyond half their own frequency */
                lanes wave = smaller(magnitude(turn * load(m->cycles + axis * n + j)), splat(PI));
                fourth += wave * wave * wave * wave;
            }
            store(m->fineness + h * n + j, fourth);
            store(m->left + h * n + j, left[h]);
            store(m->left_log + h * n + j, logarithm(larger(left[h], splat(NOTHING_LEFT))));
        }
    }
}

static HOT void mirrored_share(const MeasuredBlocks *m)
{
    double sum = 0.0;
    for (int64_t j = 0; j < m->blocks; j += LANES)
        store(m->face + j, face_reflectance(load(m->cosine + j), m->index));
    for (int64_t j = 0; j < m->blocks; j++)
        sum += m->face[j];
    for (int64_t j = 0; j < m->stride; j++)
        m->face[j] = j < m->blocks ? m->face[j] * (double)m->blocks / sum : 0.0;
}

/* Means of the seen blocks of some kinds, one after the other in `scratch`; how many. */
static int64_t collect(const MeasuredBlocks *m, int channel, unsigned kinds)
{
    int64_t count = 0;
    for (int64_t j = 0; j < m->blocks; j++)
        if (m->seen[j] > 0.0 && (kinds >> m->kind[j] & 1u))
            m->scratch[count++] = m->measured[channel * ROWS * m->stride + j];
    return count;
}

static double white_level(const MeasuredBlocks *m, int channel)
{
    int64_t count = collect(m, channel, 1u << CLEAR_WHITE);
    if (count > 0)
        return fmax(quantile(m->scratch, count, 0.5), DARKEST);
    count = collect(m, channel, 1u << PATTERN);
    return count > 0 ? fmax(PATTERN_TO_WHITE * quantile(m->scratch, count, 0.5), DARKEST) : 0.5;
}

static double quiet_variance(const MeasuredBlocks *m, int channel)
{
    int64_t count = 0;
    double floor = m->usual.floor * m->usual.floor * m->white[channel] * m->white[channel];
    double *noise = m->noise + channel * m->stride;
    for (int64_t j = 0; j < m->stride; j++) {
        noise[j] = noise[j] > floor ? noise[j] : floor;
        if (m->seen[j] > 0.0 && j < m->blocks)
            m->scratch[count++] = noise[j];
    }
    return count > 0 ? quantile(m->scratch, count, m->usual.quiet) : 0.0;
}

/* Fills the planes and levels from what was measured. */
EXPORT void gather(MeasuredBlocks *m)
{
    gather_blocks(m);
    square_pixels(m);
    mirrored_share(m);
    m->whole = 1;
    for (int64_t j = 0; j < m->blocks; j++)
        m->whole &= m->trust[j] >= 1.0;
    for (int c = 0; c < CHANNELS; c++) {
        m->white[c] = white_level(m, c);
        m->quiet[c] = quiet_variance(m, c);
        int64_t count = collect(m, c, 1u << BLACK_FILM | 1u << CLEAR_BLACK);
        m->amplitude[c] = field_amplitude(m->scratch, count, FIELD_FLOOR * m->white[c]);
    }
}

/* As in reflection.h. */
EXPORT double amplitude_of_field(double *observed, int64_t n, double floor)
{
    return field_amplitude(observed, n, floor);
}

#endif
