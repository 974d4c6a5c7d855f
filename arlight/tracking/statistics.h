/* How well a pose is determined, and how blurred the picture is, from the last step's equations. */
#ifndef ARLIGHT_STATISTICS_H
#define ARLIGHT_STATISTICS_H

#include "equations.h"

#define OCCLUDED_BELOW 0.8 /* correlation of a marker with its picture below which it counts as occluded */
#define SHARPEST_PX 0.5
#define MOST_BLURRED_PX 3.0

/* Rms over the used markers of how far each would still move by itself, freed of the fit's own degrees [px]. */
static double residual_rms_px(const Alignment *a)
{
    double sum = 0.0;
    int freedom = -POSE;
    for (int m = 0; m < a->markers; m++) {
        const double *x = a->gram + (m * FEATURES + LIGHTING + 3) * FEATURES, *y = x + FEATURES;
        double xx = x[LIGHTING + 3], xy = x[LIGHTING + 4], yy = y[LIGHTING + 4], trace = xx + yy;
        double determinant = xx * yy - xy * xy;
        if (!(a->weight[m] > 0.0 && determinant > 1e-12 * trace * trace))
            continue;
        Placed marker = placed_at(a->pose, a->places + 6 * m, a->size);
        double across = (yy * x[LIGHT] - xy * y[LIGHT]) / determinant;
        double down = (xx * y[LIGHT] - xy * x[LIGHT]) / determinant;
        double scale = a->camera[0] / marker.middle[2] / a->coefficients[m * LIGHTING];
        sum += scale * scale * (across * across + down * down);
        freedom += 2;
    }
    return sqrt(2.0 * sum / (freedom > 1 ? freedom : 1));
}

/* Rms standard deviation of the outline's corners that follows from the equations [px]; infinite where they leave the
 * pose open. */
static double corner_stddev_px(const Alignment *a, const Equations *equations)
{
    const double *r = a->pose, *t = a->pose + 9;
    double scale[POSE], factor[POSE][POSE], sum = 0.0;
    if (!factorise(equations, 0.0, scale, factor))
        return INFINITY;
    for (int corner = 0; corner < 4; corner++) {
        const double *p = a->outline + 3 * corner;
        double q[3];
        for (int k = 0; k < 3; k++)
            q[k] = r[3 * k] * p[0] + r[3 * k + 1] * p[1] + r[3 * k + 2] * p[2];
        double z = q[2] + t[2], unit = a->camera[0] / z;
        for (int axis = 0; axis < 2; axis++) {
            /* derivative of the pixel by translation, then by rotation: q crossed with it */
            double by[3] = {axis == 0 ? unit : 0.0, axis == 1 ? unit : 0.0, -unit * (q[axis] + t[axis]) / z};
            double row[POSE], share[POSE];
            for (int k = 0; k < 3; k++) {
                row[k] = scale[k] * (q[(k + 1) % 3] * by[(k + 2) % 3] - q[(k + 2) % 3] * by[(k + 1) % 3]);
                row[3 + k] = scale[3 + k] * by[k];
            }
            substitute(factor, row, 0, share);
            for (int k = 0; k < POSE; k++)
                sum += share[k] * share[k];
        }
    }
    return sqrt(sum / 4.0);
}

/* The blur [px] after the change of variance that best explains the pixels near the edges; at most by half or double. */
static double next_blur_px(const Equations *equations, double blur_px)
{
    double variance = blur_px * blur_px, least = 0.5 * variance, most = 2.0 * variance;
    if (equations->blur_below > 0.0)
        variance += equations->blur_above / equations->blur_below;
    double blur = sqrt(variance < least ? least : variance > most ? most : variance);
    return blur < SHARPEST_PX ? SHARPEST_PX : blur > MOST_BLURRED_PX ? MOST_BLURRED_PX : blur;
}

#endif
