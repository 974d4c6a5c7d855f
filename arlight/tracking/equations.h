/* The pose's normal equations from all markers, and their solution. */
#ifndef ARLIGHT_EQUATIONS_H
#define ARLIGHT_EQUATIONS_H

#include <string.h>

#include "observation.h"

#define SMALLEST_VARIANCE 4e-4 /* relative to the gain's square: no marker is trusted beyond 2 % of its contrast */

/* Adds a marker's equations. Its derivatives by rotation are about its middle, where single precision resolves them;
 * about the sheet's origin they are larger by the arm from there, crossed with those by translation. */
static void add_marker(const double *gram, double gain, double weight, const double arm[3], double change, Equations *sum)
{
    double g[POSE + 1][POSE + 1];
    for (int i = 0; i <= POSE; i++)
        for (int j = 0; j <= POSE; j++) {
            int row = i < POSE ? LIGHTING + i : LIGHT, column = j < POSE ? LIGHTING + j : LIGHT;
            g[i][j] = row < column ? gram[row * FEATURES + column] : gram[column * FEATURES + row];
        }
    for (int k = 0; k < 3; k++)
        for (int j = 0; j <= POSE; j++)
            g[k][j] += arm[(k + 1) % 3] * g[3 + (k + 2) % 3][j] - arm[(k + 2) % 3] * g[3 + (k + 1) % 3][j];
    for (int i = 0; i <= POSE; i++)
        for (int k = 0; k < 3; k++)
            g[i][k] += arm[(k + 1) % 3] * g[i][3 + (k + 2) % 3] - arm[(k + 2) % 3] * g[i][3 + (k + 1) % 3];
    for (int i = 0; i < POSE; i++) {
        for (int j = 0; j < POSE; j++)
            sum->matrix[i][j] += weight * g[i][j];
        sum->right[i] += weight / gain * g[i][POSE];
    }
    const double *blur = gram + BLUR * FEATURES;
    sum->blur_above += weight * (blur[LIGHT] / gain + blur[BLUR] * change);
    sum->blur_below += weight * blur[BLUR];
    sum->used++;
}

/* Observes one marker: its features' last rows, weights, gram and lighting; the number of points inside the picture. */
static double observe(const Alignment *a, int m, int n, const Plane *plane, const Lens *lens)
{
    int64_t points = a->points;
    float *f = a->features + m * FEATURES * points, *weights = a->scratch, *spare = weights + points;
    Placed marker = placed_at(a->pose, a->places + 6 * m, a->size);
    derive(lens, &marker, points, n, a->at + 2 * m * points, a->slope + 2 * m * points, f + LIGHTING * points,
           f + LIGHT * points, spare);
    sample(plane, n, f + LIGHT * points, spare, (int32_t *)(spare + points));
    double inside, *lighting = a->coefficients + m * LIGHTING, *gram = a->gram + m * FEATURES * FEATURES;
    a->correlation[m] = weigh(f, points, n, lighting, weights, &inside);
    weighted_gram(f, points, n, weights, spare, gram);
    eliminate_lighting(gram, lighting);
    return inside;
}

/* The equations at the pose; a marker below the correlation `floor`, or not half inside, is left out.
 * planes: (m) where each marker is looked for. */
static Equations linearise(const Alignment *a, int n, const Plane *planes, double floor, double blur_px)
{
    Equations sum = {.used = 0};
    Lens lens = lens_of(a->camera);
    for (int m = 0; m < a->markers; m++) {
        double inside = observe(a, m, n, &planes[m], &lens), gain = a->coefficients[m * LIGHTING];
        a->weight[m] = 0.0;
        if (!(inside >= 0.5 * n && a->correlation[m] >= floor && gain > 0.0))
            continue;
        const double *gram = a->gram + m * FEATURES * FEATURES, *place = a->places + 6 * m;
        double left = gram[LIGHT * FEATURES + LIGHT];
        a->weight[m] = 1.0 / ((left > 0.0 ? left : 0.0) / (gain * gain * inside) + SMALLEST_VARIANCE);
        double x = place[0] + 0.5 * (double)a->size * (place[2] + place[4]), arm[3];
        double y = place[1] + 0.5 * (double)a->size * (place[3] + place[5]);
        for (int k = 0; k < 3; k++)
            arm[k] = a->pose[3 * k] * x + a->pose[3 * k + 1] * y;
        add_marker(gram, gain, a->weight[m], arm, a->drawn[4 * m + 2] - blur_px * blur_px, &sum);
    }
    return sum;
}

/* Cholesky factor, in place below the diagonal, of the equations' matrix scaled to a unit diagonal; 0 where it is not
 * positive. scale: of each parameter; added: to the diagonal, for directions that the markers leave open. */
static int factorise(const Equations *equations, double added, double scale[POSE], double factor[POSE][POSE])
{
    for (int i = 0; i < POSE; i++) {
        double own = equations->matrix[i][i];
        scale[i] = 1.0 / sqrt(own > 1e-300 ? own : 1e-300);
    }
    for (int i = 0; i < POSE; i++)
        for (int j = 0; j <= i; j++) {
            double value = scale[i] * scale[j] * equations->matrix[i][j] + (i == j ? added : 0.0);
            for (int k = 0; k < j; k++)
                value -= factor[i][k] * factor[j][k];
            if (i == j && !(value > 0.0 && isfinite(value)))
                return 0;
            factor[i][j] = i == j ? sqrt(value) : value / factor[j][j];
        }
    return 1;
}

/* Solves L x = right for a factor L, and with `both` L L^T x = right. */
static void substitute(double factor[POSE][POSE], const double *right, int both, double *x)
{
    for (int i = 0; i < POSE; i++) {
        x[i] = right[i];
        for (int k = 0; k < i; k++)
            x[i] -= factor[i][k] * x[k];
        x[i] /= factor[i][i];
    }
    for (int i = POSE - 1; both && i >= 0; i--) {
        for (int k = i + 1; k < POSE; k++)
            x[i] -= factor[k][i] * x[k];
        x[i] /= factor[i][i];
    }
}

#endif
