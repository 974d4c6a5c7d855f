/* Rows that blocks show for unit light, from one point of view: products of short Fourier series, block by block.

A real function has harmonics 0 to 4 as a mean and four complex numbers; those of -l are the conjugates. */
#ifndef ARLIGHT_RESPONSE_H
#define ARLIGHT_RESPONSE_H

#include "measured_blocks.h"
#include "reflection.h"

#define TOP 4                     /* highest harmonic of a layer that is followed */
#define PARTS (2 * TOP + 1)       /* real numbers of a series: mean, then real and imaginary parts */

typedef struct {
    int64_t blocks;             /* that are asked for, the first ones; planes are filled to whole lanes */
    int64_t stride;             /* length of a plane */
    int64_t columns;            /* 3, or 5 where the film has a second harmonic */
    int64_t unknown;            /* real coefficients of the light, 2k - 1, filled up to whole lanes */
    int64_t kinds;              /* of blocks that are alike to light going back and forth in the glass; 0 without it */
    int64_t parts;              /* of such light's series that are not 0 */
    int64_t folded;             /* whether light of twice the frequency is counted with that of L_0, by the shape */
    int64_t whole;              /* real coefficients of the light, 2k - 1 */
    double index;               /* of refraction */
    const double *film;         /* (9, stride) series of the transmittance */
    const double *radiosity;    /* (columns, 9, stride) series of the paper's radiosity for unit coefficients */
    const double *gathered;     /* (9, parts, stride) radiosity for unit irradiance, part by part */
    const double *echo;         /* (kinds, parts, unknown) irradiance from light that went back and forth */
    const int32_t *kind;        /* (stride) of each block */
    const int32_t *overtone;    /* (stride) place of Re L_2n; 0 for none */
    const double *passed_twice; /* (stride) share of the light that a second crossing of the film leaves */
    const double *usual;        /* (whole) coefficients relative to L_0 as long as none are known */
    const double *beyond;       /* (whole - known, known) what known coefficients predict of the others */
    double *shape;              /* (unknown) coefficients relative to L_0, as far as known */
    const double *phasor;       /* (2, stride) mean of exp(-i b) over the view */
    const double *cosine;       /* (stride) of the angle between viewer and normal */
    double *echoed;             /* (kinds, parts) irradiance for the shape */
    double *rows;               /* (columns, 7, stride) result */
    double *mirror;             /* (7, stride) result: of the lower face where the upper face mirrors 1 */
} Response;

/* Four blocks' real functions. */
typedef struct {
    lanes mean, real[TOP + 1], imaginary[TOP + 1]; /* place 0 of the arrays is not used */
} Series;

INLINE Series series_at(const double *planes, int64_t stride, int64_t block)
{
    Series s = {.mean = load(planes + block)};
    for (int l = 1; l <= TOP; l++) {
        s.real[l] = load(planes + (2 * l - 1) * stride + block);
        s.imaginary[l] = load(planes + 2 * l * stride + block);
    }
    return s;
}

/* Powers exp(-i l step b), averaged over a narrow spread of b: their lengths fall as that of the first to the l^2. */
INLINE Series view_powers(const Response *r, int64_t block, int step)
{
    lanes x = load(r->phasor + block), y = load(r->phasor + r->stride + block);
    lanes length = root(x * x + y * y);
    lane_bits none = length == 0.0;
    x = select_lanes(none, splat(1.0), x / length);
    y = select_lanes(none, splat(0.0), y / length);
    length = larger(length, splat(1e-6));
    if (step == 2) {
        lanes double_x = x * x - y * y, square = length * length;
        y = 2.0 * x * y;
        x = double_x;
        length = square * square;
    }
    Series p = {.mean = splat(1.0)};
    lanes turn_x = x, turn_y = y, shrink = length, step_down = length * length * length, square = length * length;
    for (int l = 1; l <= TOP; l++) {
        p.real[l] = turn_x * shrink;
        p.imaginary[l] = turn_y * shrink;
        lanes next = turn_x * x - turn_y * y;
        turn_y = turn_x * y + turn_y * x;
        turn_x = next;
        shrink *= step_down;
        step_down *= square;
    }
    return p;
}

INLINE Series turned(Series s, Series turn)
{
    for (int l = 1; l <= TOP; l++) {
        lanes real = s.real[l] * turn.real[l] - s.imaginary[l] * turn.imaginary[l];
        s.imaginary[l] = s.real[l] * turn.imaginary[l] + s.imaginary[l] * turn.real[l];
        s.real[l] = real;
    }
    return s;
}

/* Mean, cosine and sine rows of the product of two functions, written to `to` with one plane a row. */
INLINE void write_product(const Series *f, const Series *q, lanes factor, double *to, int64_t stride)
{
    lanes mean = 0.5 * f->mean * q->mean;
    for (int l = 1; l <= TOP; l++)
        mean += f->real[l] * q->real[l] + f->imaginary[l] * q->imaginary[l];
    factor *= 2.0;
    store(to, mean * factor);
    for (int m = 1; m <= HARMONICS; m++) {
        lanes real = f->real[m] * q->mean + f->mean * q->real[m];
        lanes imaginary = f->imaginary[m] * q->mean + f->mean * q->imaginary[m];
        for (int l = 1; l < m; l++) {
            real += f->real[m - l] * q->real[l] - f->imaginary[m - l] * q->imaginary[l];
            imaginary += f->real[m - l] * q->imaginary[l] + f->imaginary[m - l] * q->real[l];
        }
        for (int l = 1; l <= TOP - m; l++) {
            /* harmonics m + l of one and -l of the other */
            real += f->real[m + l] * q->real[l] + f->imaginary[m + l] * q->imaginary[l];
            real += f->real[l] * q->real[m + l] + f->imaginary[l] * q->imaginary[m + l];
            imaginary += f->imaginary[m + l] * q->real[l] - f->real[m + l] * q->imaginary[l];
            imaginary += f->real[l] * q->imaginary[m + l] - f->imaginary[l] * q->real[m + l];
        }
        store(to + (2 * m - 1) * stride, real * factor);
        store(to + 2 * m * stride, -imaginary * factor);
    }
}

/* Radiosity for L_0 = 1, with what the rest of the light's shape adds to it. */
INLINE Series lit(const Response *r, int64_t block)
{
    Series s = series_at(r->radiosity, r->stride, block);
    lanes irradiance[PARTS];
    for (int j = 0; j < r->parts; j++)
        for (int k = 0; k < LANES; k++)
            irradiance[j][k] = r->echoed[r->kind[block + k] * r->parts + j];
    lanes added[PARTS];
    for (int i = 0; i < PARTS; i++) {
        added[i] = splat(0.0);
        for (int j = 0; j < r->parts; j++)
            added[i] += load(r->gathered + (i * r->parts + j) * r->stride + block) * irradiance[j];
    }
    for (int k = 3; k < r->columns && r->folded; k++) {
        lanes share;
        for (int i = 0; i < LANES; i++)
            share[i] = r->overtone[block + i] ? r->shape[r->overtone[block + i] + k - 3] : 0.0;
        for (int i = 0; i < PARTS; i++)
            added[i] += share * load(r->radiosity + (k * PARTS + i) * r->stride + block);
    }
    s.mean += added[0];
    for (int l = 1; l <= TOP; l++) {
        s.real[l] += added[2 * l - 1];
        s.imaginary[l] += added[2 * l];
    }
    return s;
}

static HOT void echo_of_shape(const Response *r)
{
    for (int64_t i = 0; i < r->kinds * r->parts; i++) {
        lanes sum = splat(0.0);
        for (int64_t k = 0; k < r->unknown; k += LANES)
            sum += load(r->echo + i * r->unknown + k) * load(r->shape + k);
        r->echoed[i] = total(sum);
    }
}

/* Fills `rows`. */
static HOT void light_rows(const Response *r)
{
    echo_of_shape(r);
    int64_t columns = r->folded ? 3 : r->columns;
    for (int64_t b = 0; b < r->blocks; b += LANES) {
        Series film = series_at(r->film, r->stride, b), turn = view_powers(r, b, 1);
        lanes face = face_reflectance(load(r->cosine + b), r->index), twice = face * face;
        lanes leaving = (1.0 - face) / ((1.0 + face) * PI);
        /* what the upper face sends back crosses the film twice more before it leaves */
        if (r->kinds)
            leaving *= (1.0 - twice) / (1.0 - twice * load(r->passed_twice + b));
        for (int64_t k = 0; k < columns; k++) {
            Series light = k ? series_at(r->radiosity + k * PARTS * r->stride, r->stride, b) : lit(r, b);
            light = turned(light, turn);
            write_product(&film, &light, leaving, r->rows + k * ROWS * r->stride + b, r->stride);
        }
    }
}

/* Fills `mirror`: the lower face mirrors through the film twice, 2 D(v) apart. */
EXPORT HOT void mirror_rows(const Response *r)
{
    for (int64_t b = 0; b < r->blocks; b += LANES) {
        Series film = series_at(r->film, r->stride, b);
        Series image = turned(film, view_powers(r, b, 2));
        lanes passed = 1.0 - face_reflectance(load(r->cosine + b), r->index);
        write_product(&film, &image, passed * passed, r->mirror + b, r->stride);
    }
}

/* Fills `shape` from its first `known` coefficients; NULL for those of usual light. */
static void expect_shape(const Response *r, const double *shape, int64_t known)
{
    for (int64_t i = 0; i < r->whole; i++) {
        double value = 0.0;
        for (int64_t k = 0; shape && i >= known && k < known; k++)
            value += r->beyond[(i - known) * known + k] * shape[k];
        r->shape[i] = !shape ? r->usual[i] : i < known ? shape[i] : value;
    }
}

/* Fills `rows` and `mirror` for light whose first `known` coefficients relative to L_0 are `shape`, NULL for usual. */
EXPORT void respond(const Response *r, const double *shape, int64_t known)
{
    expect_shape(r, shape, known);
    light_rows(r);
    mirror_rows(r);
}

#endif
