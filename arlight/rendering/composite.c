/* Differential rendering in linear light: the plane darkens by a ratio. */
#include "native.h"

enum {
    CELL = 8,     /* pixels between two nodes of the net of rays, as in composite.py */
    STRETCH = 16, /* cells of a row that are looked up before they are written */
};

typedef float Four __attribute__((vector_size(16), aligned(4), may_alias));

typedef struct {
    float *gain;        /* (height, width, 3) what the light of a region of the frame is multiplied by */
    const float *rays;  /* (node_rows, node_columns, 2) undistorted rays (x, y, 1) at every CELL-th pixel */
    const float *ratio; /* (side, side, 4) red, green, blue, unused */
    int64_t x0, y0, width, height, node_columns, side;
    double texel_from_ray[9]; /* homogeneous (column, row) of the plane's point that a ray meets */
} Plane;

/* Homogeneous texels (u, v, w) at two neighbouring nodes of a row: the first, and the change to the second. */
static inline void texels_of_cell(const Plane *p, int64_t column, int64_t y, float start[3], float change[3])
{
    float below = (float)(y % CELL) / CELL;
    const float *upper = p->rays + 2 * (y / CELL * p->node_columns + column), *lower = upper + 2 * p->node_columns;
    float x0 = upper[0] + below * (lower[0] - upper[0]), y0 = upper[1] + below * (lower[1] - upper[1]);
    float x1 = upper[2] + below * (lower[2] - upper[2]), y1 = upper[3] + below * (lower[3] - upper[3]);
    for (int i = 0; i < 3; i++) {
        const double *m = p->texel_from_ray + 3 * i;
        start[i] = (float)(m[0] * x0 + m[1] * y0 + m[2]);
        change[i] = (float)(m[0] * (x1 - x0) + m[1] * (y1 - y0));
    }
}

/* Texels (u, v) of a cell's pixels; u is negative where they do not see the plane. */
static inline void texels_of_pixels(const float start[3], const float change[3], float *restrict u, float *restrict v)
{
#pragma GCC unroll 1
    for (int i = 0; i < CELL; i++) {
        float share = (float)i / CELL, w = start[2] + share * change[2], inverse = 1.0f / w;
        float across = (start[0] + share * change[0]) * inverse;
        u[i] = w > 0.0f ? across : -1.0f;
        v[i] = (start[1] + share * change[1]) * inverse;
    }
}

/* The ratio at a texel (u, v), bilinear; 1 outside of the map. */
static inline Four ratio_at(const Plane *p, float last, float u, float v)
{
    if (!(u >= 0.0f && u < last && v >= 0.0f && v < last))
        return (Four){1.0f, 1.0f, 1.0f, 1.0f};
    int32_t column = (int32_t)u, row = (int32_t)v;
    const Four *texel = (const Four *)p->ratio + row * p->side + column;
    float fu = u - (float)column, fv = v - (float)row;
    Four upper = texel[0] + fu * (texel[1] - texel[0]);
    Four lower = texel[p->side] + fu * (texel[p->side + 1] - texel[p->side]);
    return upper + fv * (lower - upper);
}

/* The ratio at each pixel's point of the plane; 1 outside of the map, and above the horizon. */
EXPORT HOT void plane_gain(const Plane *p)
{
    float last = (float)(p->side - 1), u[CELL], v[CELL], factors[3 * CELL * STRETCH + 1];
    int64_t end = p->x0 + p->width;
    for (int64_t row = 0; row < p->height; row++)
        for (int64_t cell = p->x0 / CELL; cell * CELL < end; cell += STRETCH) {
            int64_t stop = (cell + STRETCH) * CELL < end ? STRETCH * CELL : end - cell * CELL;
            for (int64_t i = 0; i < stop; i += CELL) {
                float start[3], change[3];
                texels_of_cell(p, cell + i / CELL, p->y0 + row, start, change);
                texels_of_pixels(start, change, u, v);
                /* the fourth number is overwritten by the next pixel's first */
                for (int j = 0; j < CELL; j++)
                    *(Four *)(factors + 3 * (i + j)) = ratio_at(p, last, u[j], v[j]);
            }
            int64_t first = cell * CELL < p->x0 ? p->x0 - cell * CELL : 0;
            float *pixels = p->gain + 3 * (row * p->width + cell * CELL - p->x0);
            for (int64_t i = 3 * first; i < 3 * stop; i++)
                pixels[i] = factors[i];
        }
}
