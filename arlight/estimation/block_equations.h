/* A block's own normal equations: precision of its rows, an unknown lamp eliminated, and products of all columns. */
#ifndef ARLIGHT_BLOCK_EQUATIONS_H
#define ARLIGHT_BLOCK_EQUATIONS_H

#include "row_model.h"

/* Products in GRAM: of the columns among each other (00, 01, 11, 02, 12, 22), of the field with the columns and itself,
   and of the values with columns and field. A field of 1 is mirrored as strongly as `face` says. */
enum { WITH_MIRROR = 6, MIRROR_SQUARE = 9, VALUES = 10, VALUES_MIRROR = 13 };

#define SINGULAR 1e-12 /* what is left of a variance given other rows, relative to it, at least */

/* Inverse of four covariance matrices, lower triangles in place: factors L D L', without roots, which take long. */
INLINE void invert(lanes *a)
{
    lanes reciprocal[ROWS];
    UNROLLED for (int r = 0; r < ROWS; r++) {
        lanes scaled[ROWS], diagonal = a[PAIR[r][r]], pivot = diagonal;
        UNROLLED for (int s = 0; s < r; s++) {
            scaled[s] = a[PAIR[r][s]];
            for (int k = 0; k < s; k++)
                scaled[s] -= scaled[k] * a[PAIR[s][k]];
            a[PAIR[r][s]] = scaled[s] * reciprocal[s];
            pivot -= scaled[s] * a[PAIR[r][s]];
        }
        reciprocal[r] = 1.0 / larger(pivot, SINGULAR * diagonal);
    }
    /* the factor's inverse, below a diagonal of ones */
    UNROLLED for (int s = 0; s < ROWS; s++)
        UNROLLED for (int r = s + 1; r < ROWS; r++) {
            lanes sum = a[PAIR[r][s]];
            for (int k = s + 1; k < r; k++)
                sum += a[PAIR[r][k]] * a[PAIR[k][s]];
            a[PAIR[r][s]] = -sum;
        }
    UNROLLED for (int r = 0; r < ROWS; r++)
        UNROLLED for (int s = 0; s <= r; s++) {
            lanes sum = r == s ? reciprocal[r] : reciprocal[r] * a[PAIR[r][s]];
            for (int k = r + 1; k < ROWS; k++)
                sum += reciprocal[k] * a[PAIR[k][r]] * a[PAIR[k][s]];
            a[PAIR[r][s]] = sum;
        }
}

/* Precision of four blocks' rows without lamps: of the usable ones, weighted, and 0 elsewhere. */
INLINE void row_precision(const ChannelFit *f, int64_t b, lanes *p)
{
    lanes noise = at(f, NOISE, b), trust = at(f, TRUST, b), weight = load(f->weight + b), counts[HARMONICS + 1];
    for (int h = 0; h <= HARMONICS; h++)
        counts[h] = at(f, USABLE + h, b);
    UNROLLED for (int r = 0; r < ROWS; r++)
        for (int s = 0; s <= r; s++) {
            int h = harmonic_of_row(r);
            lanes both = counts[h] * counts[harmonic_of_row(s)];
            lanes value = load(f->m->pixels + PAIR[r][s] * f->m->stride + b) * noise * both;
            if (r == s) {
                lanes model = at(f, MODEL + h, b) * f->scale[h > 0] + (h ? at(f, INFERRED + h - 1, b) : splat(0.0));
                value += both * model + (1.0 - both);
            }
            p[PAIR[r][s]] = value;
        }
    invert(p);
    UNROLLED for (int r = 0; r < ROWS; r++)
        for (int s = 0; s <= r; s++) {
            lanes seen = s ? trust * trust * weight : r ? trust * weight : weight;
            p[PAIR[r][s]] *= counts[harmonic_of_row(r)] * counts[harmonic_of_row(s)] * seen;
        }
}

/* Precision times a column of rows. */
INLINE void weigh(const lanes *p, const lanes *column, lanes *weighted)
{
    UNROLLED for (int r = 0; r < ROWS; r++) {
        weighted[r] = p[PAIR[r][0]] * column[0];
        for (int s = 1; s < ROWS; s++)
            weighted[r] += p[PAIR[r][s]] * column[s];
    }
}

INLINE lanes product(const lanes *a, const lanes *b)
{
    lanes sum = a[0] * b[0];
    for (int r = 1; r < ROWS; r++)
        sum += a[r] * b[r];
    return sum;
}

INLINE void load_rows(const ChannelFit *f, int64_t number, int64_t b, lanes *rows)
{
    for (int r = 0; r < ROWS; r++)
        rows[r] = at(f, number + r, b);
}

INLINE void put_rows(const ChannelFit *f, int64_t number, int64_t b, const lanes *rows)
{
    for (int r = 0; r < ROWS; r++)
        put(f, number + r, b, rows[r]);
}

/* The precision when each block mirrors an unknown lamp (Sherman and Morrison); leaves SPREAD and TELLING. */
INLINE void eliminate_lamp(const ChannelFit *f, int64_t b, lanes *p, const lanes *mirror)
{
    lanes telling[ROWS], lamp = load(f->lamp + b);
    weigh(p, mirror, telling);
    lanes spread = lamp / (1.0 + lamp * product(telling, mirror));
    UNROLLED for (int r = 0; r < ROWS; r++)
        for (int s = 0; s <= r; s++)
            p[PAIR[r][s]] -= spread * telling[r] * telling[s];
    put_rows(f, TELLING, b, telling);
    put(f, SPREAD, b, spread);
}

/* Fills PRECISION, TELLING, SPREAD, WEIGHTED and GRAM. */
static HOT void block_equations(const ChannelFit *f)
{
    const MeasuredBlocks *m = f->m;
    for (int64_t b = 0; b < m->blocks; b += LANES) {
        lanes p[PAIRS], mirror[ROWS], columns[COLUMNS][ROWS], values[ROWS], weighted[ROWS];
        row_precision(f, b, p);
        load_rows(f, MIRROR, b, mirror);
        eliminate_lamp(f, b, p, mirror);
        for (int r = 0; r < ROWS; r++)
            mirror[r] *= load(m->face + b);
        UNROLLED for (int i = 0; i < PAIRS; i++)
            put(f, PRECISION + i, b, p[i]);
        for (int r = 0; r < ROWS; r++)
            values[r] = load(m->measured + (f->channel * ROWS + r) * m->stride + b);
        UNROLLED for (int k = 0, pair = 0; k < COLUMNS; k++) {
            load_rows(f, DESIGN + k * ROWS, b, columns[k]);
            weigh(p, columns[k], weighted);
            put_rows(f, WEIGHTED + k * ROWS, b, weighted);
            UNROLLED for (int l = 0; l <= k; l++, pair++)
                put(f, GRAM + pair, b, product(weighted, columns[l]));
            put(f, GRAM + WITH_MIRROR + k, b, product(weighted, mirror));
            put(f, GRAM + VALUES + k, b, product(weighted, values));
        }
        weigh(p, mirror, weighted);
        put_rows(f, WEIGHTED + COLUMNS * ROWS, b, weighted);
        put(f, GRAM + MIRROR_SQUARE, b, product(weighted, mirror));
        put(f, GRAM + VALUES_MIRROR, b, product(weighted, values));
    }
}

#endif
