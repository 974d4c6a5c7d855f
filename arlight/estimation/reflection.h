/* How strongly a film mirrors, and how much of the room it shows. */
#ifndef ARLIGHT_REFLECTION_H
#define ARLIGHT_REFLECTION_H

#include "lanes.h"
#include "quantile.h"

#define PATCH 15.0 /* how bright a mirrored patch may be, relative to the usual, before it is a lamp's */

/* Reflectance of one face of the glass (Fresnel, unpolarised). */
INLINE lanes face_reflectance(lanes cosine, double index)
{
    lanes air = larger(smaller(cosine, splat(1.0)), splat(0.0));
    lanes glass = root(1.0 - (1.0 - air * air) / (index * index));
    lanes s = (air - index * glass) / (air + index * glass), p = (index * air - glass) / (index * air + glass);
    return 0.5 * (s * s + p * p);
}

/* Standard deviation of the reflection, from what n black regions mirror; their values change.

   A bright patch is mirrored in few of them; a deviation that ignored it would let the patch pass for light. A lamp
   counts as such a patch and no more. */
static inline double field_amplitude(double *observed, int64_t n, double floor)
{
    if (n < 3)
        return 10.0 * floor;
    double middle = quantile(observed, n, 0.5), sum = 0.0, squares = 0.0;
    for (int64_t i = 0; i < n; i++)
        observed[i] = observed[i] - middle;
    double all[n];
    for (int64_t i = 0; i < n; i++)
        all[i] = fabs(observed[i]);
    double usual = fmax(1.5 * quantile(all, n, 0.5), floor);
    for (int64_t i = 0; i < n; i++) {
        double away = fmin(fmax(observed[i], -PATCH * usual), PATCH * usual);
        sum += away;
        squares += away * away;
    }
    double mean = sum / (double)n;
    return fmax(sqrt(fmax(squares / (double)n - mean * mean, 0.0)), usual);
}

#endif
