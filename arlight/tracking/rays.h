/* From pixels back to rays: the lens's distortion undone. */
#ifndef ARLIGHT_RAYS_H
#define ARLIGHT_RAYS_H

#include "lens.h"
#include "native.h"

/* Bent normalised coordinates of a pixel: the sensor's tilt undone. upright: (9) inverse of the tilt. */
INLINE void untilted(const Lens *lens, const float *upright, float px, float py, float *x, float *y)
{
    float u = (px - lens->centre_x) / lens->focal_x, v = (py - lens->centre_y) / lens->focal_y;
    float scale = 1.0f / (upright[6] * u + upright[7] * v + upright[8]);
    *x = (upright[0] * u + upright[1] * v + upright[2]) * scale;
    *y = (upright[3] * u + upright[4] * v + upright[5]) * scale;
}

/* One round of undoing the distortion: bent (u, v), and the guess (x, y) that it improves. */
INLINE void straighten(const Lens *lens, float u, float v, float *x, float *y)
{
    float r2 = *x * *x + *y * *y, twist = 2.0f * *x * *y;
    float radial = 1.0f + r2 * (lens->k4 + r2 * (lens->k5 + r2 * lens->k6));
    radial /= 1.0f + r2 * (lens->k1 + r2 * (lens->k2 + r2 * lens->k3));
    float dx = lens->p1 * twist + lens->p2 * (r2 + 2.0f * *x * *x) + r2 * (lens->s1 + r2 * lens->s2);
    float dy = lens->p1 * (r2 + 2.0f * *y * *y) + lens->p2 * twist + r2 * (lens->s3 + r2 * lens->s4);
    *x = (u - dx) * radial;
    *y = (v - dy) * radial;
}

#define LANES 16 /* that are worked on together */

/* Rays (x, y, 1) of LANES pixels. */
INLINE void undistort(const Lens *lens, const float *upright, int64_t rounds, const float *restrict px,
                      const float *restrict py, float *restrict x, float *restrict y)
{
    float bent_x[LANES], bent_y[LANES];
    for (int l = 0; l < LANES; l++) {
        untilted(lens, upright, px[l], py[l], bent_x + l, bent_y + l);
        x[l] = bent_x[l], y[l] = bent_y[l];
    }
    for (int64_t round = 0; round < rounds; round++)
        for (int l = 0; l < LANES; l++)
            straighten(lens, bent_x[l], bent_y[l], x + l, y + l);
}

#endif
