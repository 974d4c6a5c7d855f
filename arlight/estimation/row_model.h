/* A block's rows as blur and shift make them: response to the light and to what film and glass mirror. */
#ifndef ARLIGHT_ROW_MODEL_H
#define ARLIGHT_ROW_MODEL_H

#include "row_noise.h"

/* Turns of the harmonics' phases when all stripes are shifted. */
typedef struct {
    lanes cosine[HARMONICS + 1], sine[HARMONICS + 1]; /* place 0 is not used */
} Turn;

INLINE Turn turn_of_shift(const MeasuredBlocks *m, int64_t block, const double *shift)
{
    lanes turns = -(load(m->cycles + block) * shift[0] + load(m->cycles + m->stride + block) * shift[1]);
    lanes x = turns - nearest(turns), sine_over, half;
    half_turn(x, &sine_over, &half);
    lanes s = sine_over * x;
    Turn t;
    t.cosine[1] = half * half - s * s;
    t.sine[1] = 2.0 * half * s;
    for (int h = 2; h <= HARMONICS; h++) {
        t.cosine[h] = t.cosine[h - 1] * t.cosine[1] - t.sine[h - 1] * t.sine[1];
        t.sine[h] = t.cosine[h - 1] * t.sine[1] + t.sine[h - 1] * t.cosine[1];
    }
    return t;
}

/* Rows from sharp ones in their place; `to` and `from` have one plane a row. */
INLINE void blur_rows(const double *from, const lanes *transfer, const Turn *turn, double *to, int64_t stride)
{
    store(to, load(from));
    for (int h = 1; h <= HARMONICS; h++) {
        lanes cosine = load(from + (2 * h - 1) * stride) * transfer[h];
        lanes sine = load(from + 2 * h * stride) * transfer[h];
        store(to + (2 * h - 1) * stride, cosine * turn->cosine[h] + sine * turn->sine[h]);
        store(to + 2 * h * stride, sine * turn->cosine[h] - cosine * turn->sine[h]);
    }
}

/* Fills TRANSFER, USABLE, DESIGN, FACE and MIRROR for the nuisance at hand. */
static HOT void row_model(const ChannelFit *f)
{
    const MeasuredBlocks *m = f->m;
    const int64_t n = m->stride;
    for (int64_t b = 0; b < m->blocks; b += LANES) {
        lanes transfer[HARMONICS + 1], seen = load(m->seen + b), resolved = load(m->resolved + b);
        put(f, USABLE, b, seen);
        for (int h = 1; h <= HARMONICS; h++) {
            transfer[h] = load(m->left + (h - 1) * n + b) * exponential(blur_log(m, b, h, f->nuisance));
            put(f, TRANSFER + h - 1, b, transfer[h]);
            put(f, USABLE + h, b, seen * indicator((transfer[h] > f->weakest) & (resolved >= (double)h)));
        }
        Turn turn = turn_of_shift(m, b, f->nuisance + 3);
        for (int k = 0; k < COLUMNS; k++)
            blur_rows(f->rows + k * ROWS * n + b, transfer, &turn, plane(f, DESIGN + k * ROWS) + b, n);
        blur_rows(f->lower + b, transfer, &turn, plane(f, FACE) + b, n);
        for (int r = 0; r < ROWS; r++)
            put(f, MIRROR + r, b, f->nuisance[2] * at(f, FACE + r, b) + (r == 0 ? 1.0 : 0.0));
    }
}

#endif
