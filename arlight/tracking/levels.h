/* Where each marker is looked for in the picture, at full resolution or a shrunk one. */
#ifndef ARLIGHT_LEVELS_H
#define ARLIGHT_LEVELS_H

#include "observation.h"

#define MARGIN 6.0f /* pixels of the shrunk picture around a marker: its blurred edges, and its way to its place */

static inline Plane whole_picture(const Alignment *a)
{
    return (Plane){
        .rows = a->codes, .table = a->table, .stride = a->stride, .bytes = (int)a->code_bytes,
        .last_code = (int)a->entries - 1, .x1 = (int)a->width - 1, .y1 = (int)a->height - 1, .scale = 1.0f,
    };
}

/* An end of a box, within 0 and `last`; nan becomes an empty box's. */
static inline int clipped(float value, int last, int otherwise)
{
    if (!(value == value))
        return otherwise;
    return value <= 0.0f ? 0 : value >= (float)last ? last : (int)value;
}

/* The box around a marker in the picture shrunk to width x height. */
static void enclose(const Alignment *a, int64_t m, int shrink, const Lens *lens, Plane *box, int width, int height)
{
    Placed q = placed_at(a->pose, a->places + 6 * m, a->size);
    float low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    for (int corner = 0; corner < 4; corner++) {
        float u = corner & 1 ? q.half : -q.half, v = corner & 2 ? q.half : -q.half, at[2];
        float z = q.middle[2] + u * q.u[2] + v * q.v[2], nearness = 1.0f / (z > NEAREST_MM ? z : NEAREST_MM);
        project(lens, (q.middle[0] + u * q.u[0] + v * q.v[0]) * nearness,
                (q.middle[1] + u * q.u[1] + v * q.v[1]) * nearness, &at[0], &at[1]);
        for (int k = 0; k < 2; k++) {
            low[k] = at[k] >= low[k] ? low[k] : at[k];
            high[k] = at[k] <= high[k] ? high[k] : at[k];
        }
    }
    float share = 1.0f / (float)shrink;
    box->x0 = clipped(low[0] * share - MARGIN, width - 1, 1);
    box->y0 = clipped(low[1] * share - MARGIN, height - 1, 1);
    box->x1 = clipped(high[0] * share + MARGIN, width - 1, 0);
    box->y1 = clipped(high[1] * share + MARGIN, height - 1, 0);
}

/* The planes (m) to look at, one a marker: the picture itself, or the box around each of it shrunk. */
static void look_at(const Alignment *a, int shrink, Plane *planes)
{
    Plane whole = whole_picture(a), box = whole;
    Lens lens = lens_of(a->camera);
    int width = (int)a->width / shrink, height = (int)a->height / shrink;
    box.rows = (const char *)a->shrunk;
    box.stride = (int64_t)sizeof(float) * width;
    box.bytes = sizeof(float);
    box.scale = 1.0f / (float)shrink;
    for (int64_t m = 0; m < a->markers; m++) {
        planes[m] = whole;
        if (shrink == 1)
            continue;
        planes[m].x1 = -1;
        if (width < 2 || height < 2)
            continue;
        enclose(a, m, shrink, &lens, &box, width, height);
        shrink_box(&whole, shrink, &box, a->shrunk, width);
        planes[m] = box;
    }
}

#endif
