/* How colourful a scene's light is. */
#ifndef ARLIGHT_PRIOR_H
#define ARLIGHT_PRIOR_H

#include "native.h"

#define LEAST_COLOR_SPREAD 0.004
#define MOST_COLOR_SPREAD 0.24
#define LEAST_DETERMINED 0.02
#define DARKEST_IRRADIANCE 1e-3

/* The spread under which n - 1 differences of red or blue from green are most likely; `colorful` is their deviation for
   an irradiance and a spread of 1, place 0 of all is L_0's and does not count.

   A damped step of MacKay's evidence update, which divides by the number of well-determined differences; repeated frame
   by frame it converges. */
static double next_color_spread(int64_t n, const double *colorful, double irradiance, const double *difference,
                                const double *variance, int64_t variance_step, double last)
{
    double squares = 0.0, determined = 0.0;
    irradiance = fmax(irradiance, DARKEST_IRRADIANCE);
    for (int64_t i = 1; i < n; i++) {
        double unit = colorful[i] * irradiance, usual = last * unit;
        squares += difference[i] * difference[i] / (unit * unit);
        determined += fmin(fmax(1.0 - variance[i * variance_step] / (usual * usual), LEAST_DETERMINED), 1.0);
    }
    if (!(determined > 0.0))
        return last;
    double spread = sqrt(sqrt(squares / determined) * last);
    return fmin(fmax(spread, LEAST_COLOR_SPREAD), MOST_COLOR_SPREAD);
}

#endif
