/* The camera in the sheet's frame: where it sees points of film and paper. */
#ifndef ARLIGHT_EYE_H
#define ARLIGHT_EYE_H

#include "blocks.h"
#include "rays.h"

#define EACH_LANE for (int l = 0; l < LANES; l++)

/* The camera in the sheet's frame. */
typedef struct {
    Lens lens;
    float upright[9];
    float rotation[9], translation[3]; /* camera from sheet */
    float centre[3];                   /* of the camera [mm] */
    float glass_mm, index_squared;
} Eye;

/* A coordinate of LANES blocks. */
typedef float Lane[LANES];

static Eye eye_of(const Blocks *b)
{
    Eye eye = {.lens = lens_of(b->lens), .glass_mm = (float)b->glass_mm, .index_squared = (float)(b->index * b->index)};
    for (int k = 0; k < 9; k++) {
        eye.upright[k] = (float)b->upright[k];
        eye.rotation[k] = (float)b->pose[k];
    }
    for (int k = 0; k < 3; k++) {
        const double *r = b->pose, *t = b->pose + 9;
        eye.translation[k] = (float)t[k];
        eye.centre[k] = (float)-(r[k] * t[0] + r[3 + k] * t[1] + r[6 + k] * t[2]);
    }
    return eye;
}

/* Pixel and depth [mm] of a point of the film. */
INLINE void look_at(const Eye *eye, float x, float y, float *px, float *py, float *depth)
{
    const float *r = eye->rotation, *t = eye->translation;
    float along = r[6] * x + r[7] * y + t[2], near = 1.0f / along;
    project(&eye->lens, (r[0] * x + r[1] * y + t[0]) * near, (r[3] * x + r[4] * y + t[1]) * near, px, py);
    *depth = along;
}

/* How far aside of its film point (x, y) the paper is seen, per component toward the camera; the view's cosine. */
INLINE float parallax(const Eye *eye, float x, float y, float *cosine)
{
    float vx = eye->centre[0] - x, vy = eye->centre[1] - y, across = vx * vx + vy * vy;
    float total = across + eye->centre[2] * eye->centre[2];
    *cosine = eye->centre[2] / sqrtf(total);
    return eye->glass_mm / sqrtf(eye->index_squared * total - across);
}

/* The film point through which a point (x, y) of the paper is seen. */
INLINE void film_over(const Eye *eye, float x, float y, float *film_x, float *film_y)
{
    float cosine, at_x = x, at_y = y;
    for (int k = 0; k < 3; k++) {
        float scale = parallax(eye, at_x, at_y, &cosine);
        at_x = x + scale * (eye->centre[0] - at_x);
        at_y = y + scale * (eye->centre[1] - at_y);
    }
    *film_x = at_x;
    *film_y = at_y;
}

#endif
