/* The camera's projection with lens distortion: OpenCV's model with all of its 14 terms. */
#ifndef ARLIGHT_LENS_H
#define ARLIGHT_LENS_H

typedef struct {
    float focal_x, focal_y, centre_x, centre_y; /* [px] */
    float k1, k2, p1, p2, k3, k4, k5, k6;       /* radial, tangential, radial, rational */
    float s1, s2, s3, s4;                       /* thin prism */
    float tilt[9];                              /* homography of a tilted sensor, row by row */
} Lens;

/* The terms as `camera_parameters` of lens.py lists them. */
static inline Lens lens_of(const double *parameters)
{
    union {
        float values[25];
        Lens lens;
    } both;
    for (int i = 0; i < 25; i++)
        both.values[i] = (float)parameters[i];
    return both.lens;
}

/* Pixel of normalised image coordinates (x, y). */
static inline void project(const Lens *lens, float x, float y, float *px, float *py)
{
    float r2 = x * x + y * y;
    float radial = 1.0f + r2 * (lens->k1 + r2 * (lens->k2 + r2 * lens->k3));
    radial /= 1.0f + r2 * (lens->k4 + r2 * (lens->k5 + r2 * lens->k6));
    float twist = 2.0f * x * y;
    float bent_x = x * radial + lens->p1 * twist + lens->p2 * (r2 + 2.0f * x * x) + r2 * (lens->s1 + r2 * lens->s2);
    float bent_y = y * radial + lens->p1 * (r2 + 2.0f * y * y) + lens->p2 * twist + r2 * (lens->s3 + r2 * lens->s4);
    const float *h = lens->tilt;
    float scale = 1.0f / (h[6] * bent_x + h[7] * bent_y + h[8]);
    *px = lens->focal_x * (h[0] * bent_x + h[1] * bent_y + h[2]) * scale + lens->centre_x;
    *py = lens->focal_y * (h[3] * bent_x + h[4] * bent_y + h[5]) * scale + lens->centre_y;
}

#endif
