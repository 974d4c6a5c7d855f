/* Differential rendering in linear light: the plane darkens by a ratio. */
#include "native.h"

typedef float Four __attribute__((vector_size(16), aligned(4), may_alias));

typedef struct {
    float *left;        /* (3, rows, columns) what is left of the light at some nodes of the picture */
    const float *rays;  /* (2, all_rows, all_columns) undistorted rays (x, y, 1) at all nodes */
    const float *ratio; /* (side, side, 4) red, green, blue, unused */
    float *texels;      /* (2, all_columns) scratch: where a row of nodes lies on the map */
    int64_t first_row, first_column, rows, columns, all_rows, all_columns, side;
    double texel_from_plane[6]; /* (column, row) of a point (x, y, 1) of the plane */
    double ray_from_plane[9];   /* homogeneous ray of a point (x, y, 1) of the plane, row by row */
} Plane;

/* Homogeneous (column, row) of the plane's point that a ray meets, up to a factor. The adjugate is the inverse up to
   one, and all zeros where the plane is seen edge-on. */
static void texel_from_ray(const Plane *p, float m[9])
{
    const double *r = p->ray_from_plane, *t = p->texel_from_plane;
    double sign = 0.0, adjugate[9];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            const double *a = r + 3 * ((j + 1) % 3), *b = r + 3 * ((j + 2) % 3);
            adjugate[3 * i + j] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
        }
    for (int j = 0; j < 3; j++)
        sign += adjugate[j] * r[3 * j];
    /* a positive factor, so that what is in front stays in front */
    double scale = sign < 0.0 ? -1.0 : 1.0;
    for (int j = 0; j < 3; j++) {
        for (int i = 0; i < 2; i++)
            m[3 * i + j] = (float)(scale * (t[3 * i] * adjugate[j] + t[3 * i + 1] * adjugate[3 + j]
                                            + t[3 * i + 2] * adjugate[6 + j]));
        m[6 + j] = (float)(scale * adjugate[6 + j]);
    }
}

/* The points of the plane that a row of nodes sees, as texels; outside of the map above the horizon. */
static HOT void locate(const Plane *p, const float *m, int64_t row)
{
    const float *x = p->rays + (p->first_row + row) * p->all_columns + p->first_column;
    const float *y = x + p->all_rows * p->all_columns;
    float *restrict u = p->texels, *restrict v = p->texels + p->all_columns;
    for (int64_t i = 0; i < p->columns; i++) {
        float w = m[6] * x[i] + m[7] * y[i] + m[8], inverse = w > 0.0f ? 1.0f / w : NAN;
        u[i] = (m[0] * x[i] + m[1] * y[i] + m[2]) * inverse;
        v[i] = (m[3] * x[i] + m[4] * y[i] + m[5]) * inverse;
    }
}

/* The ratio at a texel, bilinear; 1 outside of the map. */
static inline Four ratio_at(const Plane *p, float u, float v)
{
    float last = (float)(p->side - 1);
    if (!(u >= 0.0f && u < last && v >= 0.0f && v < last))
        return (Four){1.0f, 1.0f, 1.0f, 1.0f};
    int32_t column = (int32_t)u, row = (int32_t)v;
    const Four *at = (const Four *)p->ratio + row * p->side + column;
    float fu = u - (float)column, fv = v - (float)row;
    Four upper = at[0] + fu * (at[1] - at[0]);
    Four lower = at[p->side] + fu * (at[p->side + 1] - at[p->side]);
    return upper + fv * (lower - upper);
}

/* What is left of the plane's light: the ratio at the point that each node sees. */
EXPORT HOT void plane_left(const Plane *p)
{
    int64_t count = p->rows * p->columns;
    float m[9];
    texel_from_ray(p, m);
    for (int64_t row = 0; row < p->rows; row++) {
        float *left = p->left + row * p->columns;
        locate(p, m, row);
        for (int64_t i = 0; i < p->columns; i++) {
            Four ratio = ratio_at(p, p->texels[i], p->texels[p->all_columns + i]);
            for (int c = 0; c < 3; c++)
                left[c * count + i] = ratio[c];
        }
    }
}
