/* Differential rendering in linear light: the plane darkens by a ratio. */
#include "native.h"

enum {
    CELL = 8, /* pixels between two nodes of the net of rays, as in composite.py */
    NODE = 4, /* pixels between two at which the ratio is looked up: it is smooth, a texel of the map wider than this */
};

typedef float Four __attribute__((vector_size(16), aligned(4), may_alias));

typedef struct {
    float *gain;        /* (height * width * 3 + 1) what the light of a region of the frame is multiplied by */
    const float *rays;  /* (node_rows, node_columns, 2) undistorted rays (x, y, 1) at every CELL-th pixel */
    const float *ratio; /* (side, side, 4) red, green, blue, unused */
    float *lines;       /* (3, width / NODE + 2, 4) scratch: the ratio at two lines of nodes, and between them */
    int64_t x0, y0, width, height, node_columns, side;
    double texel_from_ray[9]; /* homogeneous (column, row) of the plane's point that a ray meets */
} Plane;

/* Homogeneous texel (u, v, w) of the plane's point that a pixel sees. */
static inline void texel_of_pixel(const Plane *p, int64_t x, int64_t y, float texel[3])
{
    float right = (float)(x % CELL) / CELL, below = (float)(y % CELL) / CELL;
    const float *upper = p->rays + 2 * (y / CELL * p->node_columns + x / CELL), *lower = upper + 2 * p->node_columns;
    float ray[2];
    for (int i = 0; i < 2; i++) {
        float above = upper[i] + right * (upper[i + 2] - upper[i]), under = lower[i] + right * (lower[i + 2] - lower[i]);
        ray[i] = above + below * (under - above);
    }
    for (int i = 0; i < 3; i++) {
        const double *m = p->texel_from_ray + 3 * i;
        texel[i] = (float)(m[0] * ray[0] + m[1] * ray[1] + m[2]);
    }
}

/* The ratio at a texel, bilinear; 1 outside of the map, and above the horizon. */
static inline Four ratio_at(const Plane *p, const float texel[3])
{
    float last = (float)(p->side - 1), inverse = 1.0f / texel[2], u = texel[0] * inverse, v = texel[1] * inverse;
    if (!(texel[2] > 0.0f && u >= 0.0f && u < last && v >= 0.0f && v < last))
        return (Four){1.0f, 1.0f, 1.0f, 1.0f};
    int32_t column = (int32_t)u, row = (int32_t)v;
    const Four *at = (const Four *)p->ratio + row * p->side + column;
    float fu = u - (float)column, fv = v - (float)row;
    Four upper = at[0] + fu * (at[1] - at[0]);
    Four lower = at[p->side] + fu * (at[p->side + 1] - at[p->side]);
    return upper + fv * (lower - upper);
}

/* The ratio at the nodes of one of the picture's rows. */
static void look_up_line(const Plane *p, int64_t y, int64_t nodes, Four *restrict line)
{
    float texel[3];
    for (int64_t k = 0; k < nodes; k++) {
        texel_of_pixel(p, p->x0 + NODE * k, y, texel);
        line[k] = ratio_at(p, texel);
    }
}

/* A row of pixels between nodes; each one's fourth number is overwritten by the next one's first. */
static HOT void spread_line(const Four *restrict line, int64_t width, float *restrict gain)
{
    for (int64_t x = 0; x < width; x++) {
        float share = (float)(x % NODE) / NODE;
        const Four *node = line + x / NODE;
        *(Four *)(gain + 3 * x) = node[0] + share * (node[1] - node[0]);
    }
}

/* What the light of a region is multiplied by: the ratio at each pixel's point of the plane. */
EXPORT HOT void plane_gain(const Plane *p)
{
    int64_t nodes = (p->width + NODE - 1) / NODE + 1;
    Four *above = (Four *)p->lines, *below = above + nodes, *between = below + nodes;
    look_up_line(p, p->y0, nodes, below);
    for (int64_t row = 0; row < p->height; row++) {
        float share = (float)(row % NODE) / NODE;
        if (row % NODE == 0) {
            Four *used = above;
            above = below, below = used;
            look_up_line(p, p->y0 + row + NODE, nodes, below);
        }
        for (int64_t k = 0; k < nodes; k++)
            between[k] = above[k] + share * (below[k] - above[k]);
        spread_line(between, p->width, p->gain + 3 * row * p->width);
    }
}
