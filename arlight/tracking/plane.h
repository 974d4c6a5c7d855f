/* Linear light between the pixels of a plane: a picture's codes, or the light of a shrunk picture. */
#ifndef ARLIGHT_PLANE_H
#define ARLIGHT_PLANE_H

#include "native.h"

typedef struct {
    const char *rows;
    const float *table;  /* linear light of a code */
    int64_t stride;      /* bytes from row to row */
    int bytes;           /* of a pixel: codes of 1 or 2 bytes, or light in 4 */
    int last_code;       /* entries of the table but one */
    int x0, y0, x1, y1;  /* first and last pixel that may be read; none where x1 <= x0 or y1 <= y0 */
    float scale;         /* pixels of this plane per pixel of the frame */
} Plane;

static inline float light_at(const Plane *plane, int bytes, const char *row, int x)
{
    if (bytes == 4)
        return ((const float *)row)[x];
    if (bytes == 1)
        return plane->table[((const uint8_t *)row)[x]];
    int code = ((const uint16_t *)row)[x];
    return plane->table[code < plane->last_code ? code : plane->last_code];
}

#define AHEAD 24 /* points */
#define OUTSIDE (-1.0f) /* light where there is no picture; that of the darkest codes may lie a little below 0 */

/* Where the pixel at the upper left of each (x, y) of the frame lies [bytes], -1 outside the plane and where a coordinate
 * is nan; x and y become the way from there to the next pixels. */
static HOT void locate(const Plane *plane, int n, float *x, float *y, int32_t *offsets)
{
    const float scale = plane->scale, shift = 0.5f * scale - 0.5f;
    const float left = (float)plane->x0, top = (float)plane->y0, right = (float)plane->x1, bottom = (float)plane->y1;
    const int last_x = plane->x1 - 1, last_y = plane->y1 - 1, bytes = plane->bytes, stride = (int)plane->stride;
    const int some = plane->x1 > plane->x0 && plane->y1 > plane->y0;
#pragma GCC ivdep
    for (int p = 0; p < n; p++) {
        float at_x = x[p] * scale + shift, at_y = y[p] * scale + shift;
        int inside = some & (at_x >= left) & (at_y >= top) & (at_x <= right) & (at_y <= bottom);
        at_x = inside ? at_x : 0.0f;
        at_y = inside ? at_y : 0.0f;
        int i = (int)at_x, j = (int)at_y;
        i = i < last_x ? i : last_x;
        j = j < last_y ? j : last_y;
        x[p] = at_x - (float)i;
        y[p] = at_y - (float)j;
        offsets[p] = inside ? j * stride + i * bytes : -1;
    }
}

/* Replaces x by the light at the points that `locate` found, OUTSIDE elsewhere. The pixels of later points are fetched
 * ahead: a picture that was just decoded lies far from the processor. */
static inline void sample_bytes(const Plane *plane, int bytes, int n, float *x, const float *y, const int32_t *offsets)
{
    for (int p = 0; p < n; p++) {
        int ahead = offsets[p + AHEAD < n ? p + AHEAD : n - 1];
        __builtin_prefetch(plane->rows + (ahead > 0 ? ahead : 0));
        __builtin_prefetch(plane->rows + (ahead > 0 ? ahead : 0) + plane->stride);
        if (offsets[p] < 0) {
            x[p] = OUTSIDE;
            continue;
        }
        const char *upper = plane->rows + offsets[p], *lower = upper + plane->stride;
        float above = light_at(plane, bytes, upper, 0), below = light_at(plane, bytes, lower, 0);
        above += x[p] * (light_at(plane, bytes, upper, 1) - above);
        below += x[p] * (light_at(plane, bytes, lower, 1) - below);
        x[p] = above + y[p] * (below - above);
    }
}

/* Replaces x by the light at each (x, y) of the frame [px], with a loop of its own for each kind of plane. */
static HOT void sample(const Plane *plane, int n, float *x, float *y, int32_t *offsets)
{
    locate(plane, n, x, y, offsets);
    if (plane->bytes == 1)
        sample_bytes(plane, 1, n, x, y, offsets);
    else if (plane->bytes == 2)
        sample_bytes(plane, 2, n, x, y, offsets);
    else
        sample_bytes(plane, 4, n, x, y, offsets);
}

static inline void shrink_bytes(const Plane *plane, int bytes, int shrink, const Plane *box, float *light, int width)
{
    float share = 1.0f / (float)(shrink * shrink);
    for (int y = box->y0; y <= box->y1; y++)
        for (int x = box->x0; x <= box->x1; x++) {
            float sum = 0.0f;
            const char *row = plane->rows + (int64_t)y * shrink * plane->stride;
            for (int j = 0; j < shrink; j++, row += plane->stride)
                for (int i = x * shrink; i < (x + 1) * shrink; i++)
                    sum += light_at(plane, bytes, row, i);
            light[(int64_t)y * width + x] = share * sum;
        }
}

/* Averages blocks of shrink x shrink pixels of a picture into the box of another plane (row stride `width` floats). */
static HOT void shrink_box(const Plane *plane, int shrink, const Plane *box, float *light, int width)
{
    if (plane->bytes == 1)
        shrink_bytes(plane, 1, shrink, box, light, width);
    else
        shrink_bytes(plane, 2, shrink, box, light, width);
}

#endif
