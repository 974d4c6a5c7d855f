/* What a picture says about one marker at a pose: features of its points, their weights and weighted products. */
#ifndef ARLIGHT_OBSERVATION_H
#define ARLIGHT_OBSERVATION_H

#include "alignment.h"
#include "lens.h"
#include "plane.h"

#define OUTLIER_LIMIT 0.25f /* residual, relative to a marker's gain, at which a point's weight is halved */
#define NEAREST_MM 1e-3f    /* depth that what lies behind the camera is given: far out of the picture */

/* A marker in the camera's frame. */
typedef struct {
    float middle[3];      /* [mm] */
    float u[3], v[3];     /* one module to the right, one down [mm] */
    float half;           /* modules from an edge to the middle */
} Placed;

static inline Placed placed_at(const double *pose, const double *place, int64_t size)
{
    Placed marker = {.half = 0.5f * (float)size};
    double x = place[0] + 0.5 * (double)size * (place[2] + place[4]);
    double y = place[1] + 0.5 * (double)size * (place[3] + place[5]);
    for (int k = 0; k < 3; k++) {
        const double *row = pose + 3 * k;
        marker.middle[k] = (float)(row[0] * x + row[1] * y + pose[9 + k]);
        marker.u[k] = (float)(row[0] * place[2] + row[1] * place[3]);
        marker.v[k] = (float)(row[0] * place[4] + row[1] * place[5]);
    }
    return marker;
}

/* Pose derivatives of the template (rotation about the marker's middle, translation) into 6 rows of features, and the
 * points' pixels into x and y. The derivatives are taken on the plane, where lens distortion cancels:
 * dT/dpose = dT/d(u, v) (dx/d(u, v))^-1 dx/dpose with x the undistorted image. */
static HOT void derive(const Lens *camera, const Placed *marker, int64_t stride, int n, const float *at,
                       const float *slope, float *rows, float *px, float *py)
{
    const Placed q = *marker;
    const Lens lens = *camera;
#pragma GCC ivdep
    for (int p = 0; p < n; p++) {
        float u = at[p] - q.half, v = at[stride + p] - q.half, tu = slope[p], tv = slope[stride + p];
        float qx = u * q.u[0] + v * q.v[0], qy = u * q.u[1] + v * q.v[1], qz = u * q.u[2] + v * q.v[2];
        float z = qz + q.middle[2];
        float nearness = 1.0f / (z > NEAREST_MM ? z : NEAREST_MM);
        float x = (qx + q.middle[0]) * nearness, y = (qy + q.middle[1]) * nearness;
        float xu = q.u[0] - x * q.u[2], yu = q.u[1] - y * q.u[2], xv = q.v[0] - x * q.v[2], yv = q.v[1] - y * q.v[2];
        float share = 1.0f / (xu * yv - xv * yu);
        float a = (tu * yv - tv * yu) * share, b = (tv * xu - tu * xv) * share, c = -(a * x + b * y);
        rows[p] = qy * c - qz * b;
        rows[stride + p] = qz * a - qx * c;
        rows[2 * stride + p] = qx * b - qy * a;
        rows[3 * stride + p] = a;
        rows[4 * stride + p] = b;
        rows[5 * stride + p] = c;
        project(&lens, x, y, &px[p], &py[p]);
    }
}

/* Weights of points against outliers, 0 outside the picture; the number inside and the correlation of T with I.
 * lighting: the marker's in the step before, 0 when there is none. */
static HOT double weigh(const float *f, int64_t stride, int n, const double *lighting, float *weights, double *number)
{
    const float gain = (float)lighting[0], right = (float)lighting[1], down = (float)lighting[2];
    const float bias = (float)lighting[3], per_bound = gain > 0.0f ? 1.0f / (OUTLIER_LIMIT * gain) : 0.0f;
    const float *light = f + LIGHT * stride;
    float inside = 0.0f, st = 0.0f, si = 0.0f, stt = 0.0f, sii = 0.0f, sti = 0.0f;
#pragma GCC ivdep
    for (int p = 0; p < n; p++) {
        float is_in = light[p] > 0.5f * OUTSIDE ? 1.0f : 0.0f;
        float t = f[p] - 0.5f, i = light[p] * is_in;
        float residual = light[p] - gain * f[p] - right * f[stride + p] - down * f[2 * stride + p] - bias;
        float relative = residual * per_bound;
        weights[p] = is_in / (1.0f + relative * relative);
        inside += is_in;
        st += is_in * t;
        si += i;
        stt += is_in * t * t;
        sii += i * i;
        sti += i * t;
    }
    *number = inside;
    double of_t = (double)inside * stt - (double)st * st, of_i = (double)inside * sii - (double)si * si;
    /* contrast below what single precision resolves is none */
    int flat = !(of_t > 0.0 && of_i > 1e-5 * inside * sii);
    return flat ? 0.0 : ((double)inside * sti - (double)st * si) / sqrt(of_t * of_i);
}

/* Weighted products of all pairs of features, summed over the points; the upper triangle. Four sums at a time keep the
 * processor's adders busy. */
static HOT void weighted_gram(const float *f, int64_t stride, int n, const float *weights, float *scaled, double *gram)
{
    for (int i = 0; i < FEATURES; i++) {
#pragma GCC ivdep
        for (int p = 0; p < n; p++)
            scaled[p] = weights[p] * f[i * stride + p];
        for (int j = i & ~3; j < FEATURES; j += 4) {
            const float *a = f + j * stride, *b = a + stride, *c = b + stride, *d = c + stride;
            float sa = 0.0f, sb = 0.0f, sc = 0.0f, sd = 0.0f;
            for (int p = 0; p < n; p++) {
                sa += scaled[p] * a[p];
                sb += scaled[p] * b[p];
                sc += scaled[p] * c[p];
                sd += scaled[p] * d[p];
            }
            double *out = gram + i * FEATURES + j;
            out[0] = sa;
            out[1] = sb;
            out[2] = sc;
            out[3] = sd;
        }
    }
}

/* Gauss elimination of a marker's lighting from the upper triangle, and its solution; what is left is the Schur
 * complement. */
static void eliminate_lighting(double *gram, double *lighting)
{
    for (int k = 0; k < LIGHTING; k++) {
        const double *pivot = gram + k * FEATURES;
        if (!(pivot[k] > 1e-12))
            continue;
        for (int i = k + 1; i < FEATURES; i++) {
            double factor = pivot[i] / pivot[k];
            for (int j = i; j < FEATURES; j++)
                gram[i * FEATURES + j] -= factor * pivot[j];
        }
    }
    for (int k = LIGHTING - 1; k >= 0; k--) {
        const double *row = gram + k * FEATURES;
        double value = row[LIGHT];
        for (int j = k + 1; j < LIGHTING; j++)
            value -= row[j] * lighting[j];
        lighting[k] = row[k] > 1e-12 ? value / row[k] : 0.0;
    }
}

#endif
