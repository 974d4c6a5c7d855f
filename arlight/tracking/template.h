/* The template at the picture's blur: what the markers look like at the points that alignment compares.
 *
 * A marker is a sum of black unit squares, a Gaussian blurs it along u and v by itself, so its values on the grid of all
 * positions are products of small matrices: (positions along v, rows) times (rows, positions along u). */
#ifndef ARLIGHT_TEMPLATE_H
#define ARLIGHT_TEMPLATE_H

#include <string.h>

#include "alignment.h"

#define FAR 4.9f /* standard deviations from where on an edge is not seen any more */
#define MAX_REACH_MODULES 0.9f /* the quiet zone around a marker is only sure to be one module wide */

/* Share of the half-line above `line` that a Gaussian at each position sees, and its first two derivatives.
 * The exponential is a 16th power of a short series (relative error 1e-6), the error function Abramowitz and Stegun's
 * 7.1.26 (1.5e-7). */
static HOT void half_line(const float *at, int n, float line, float sigma, float *share, float *slope, float *bend)
{
    float inverse = 1.0f / sigma;
#pragma GCC ivdep
    for (int i = 0; i < n; i++) {
        float z = (at[i] - line) * inverse;
        z = z > -FAR ? z : -FAR;
        z = z < FAR ? z : FAR;
        float far = z < 0.0f ? -z : z;
        float r = far * far * (-1.0f / 32.0f);
        float e = 1.0f + r * (1.0f / 7.0f) * (1.0f + r * (1.0f / 8.0f));
        e = 1.0f + r * (1.0f + r * 0.5f * (1.0f + r * (1.0f / 3.0f) * (1.0f + r * 0.25f * (1.0f + r * 0.2f
            * (1.0f + r * (1.0f / 6.0f) * e)))));
        e *= e;
        e *= e;
        e *= e;
        e *= e;
        float t = 1.0f / (1.0f + 0.23164189f * far);
        float beyond = 0.5f * e * t * (0.254829592f + t * (-0.284496736f + t * (1.421413741f
            + t * (-1.453152027f + t * 1.061405429f))));
        share[i] = z > 0.0f ? 1.0f - beyond : beyond;
        slope[i] = 0.39894228f * inverse * e;
        bend[i] = -z * inverse * slope[i];
    }
}

/* The same for every module, a unit box of one axis: (3, size, n), from lines (3, size + 1, n) in place. */
static HOT void unit_boxes(const float *at, int n, int size, float sigma, float *boxes)
{
    int64_t plane = (int64_t)(size + 1) * n;
    for (int line = 0; line <= size; line++) {
        float *row = boxes + (int64_t)line * n;
        half_line(at, n, (float)line, sigma, row, row + plane, row + 2 * plane);
    }
    for (int quantity = 0; quantity < 3; quantity++)
        for (int64_t i = 0; i < (int64_t)size * n; i++)
            boxes[quantity * plane + i] -= boxes[quantity * plane + i + n];
}

/* For each row of modules, the sum over its black ones of the columns' shares; (size, n) each. */
static HOT void over_columns(const float *black, int size, int n, const float *columns, float *rows)
{
    memset(rows, 0, sizeof(float) * (size_t)(size * n));
    for (int row = 0; row < size; row++)
        for (int column = 0; column < size; column++) {
            if (black[row * size + column] == 0.0f)
                continue;
#pragma GCC ivdep
            for (int i = 0; i < n; i++)
                rows[row * n + i] += columns[column * n + i];
        }
}

/* grid[j][i] += scale * sum over rows of along_v[row][j] * along_u[row][i]; (n, n) from (size, n) each. */
static HOT void add_product(const float *along_v, const float *along_u, int size, int n, float scale, float *grid)
{
    for (int j = 0; j < n; j++)
        for (int row = 0; row < size; row++) {
            float share = scale * along_v[row * n + j];
            if (share == 0.0f) /* most rows are out of a position's sight */
                continue;
#pragma GCC ivdep
            for (int i = 0; i < n; i++)
                grid[j * n + i] += share * along_u[row * n + i];
        }
}

static HOT void pick(const float *grid, int n, const int32_t *u, const int32_t *v, int points, float *values)
{
    for (int p = 0; p < points; p++)
        values[p] = grid[v[p] * n + u[p]];
}

/* The points' coordinates, and the features that only depend on the template. */
static HOT void place_points(const Alignment *a, int m, const float *on_u, const float *on_v, float *features)
{
    int64_t points = a->points;
    const int32_t *u = a->index_u + m * points, *v = a->index_v + m * points;
    float *at = a->at + 2 * m * points, whole = 2.0f / (float)a->size;
#pragma GCC ivdep
    for (int64_t p = 0; p < points; p++) {
        at[p] = on_u[u[p]];
        at[points + p] = on_v[v[p]];
        features[points + p] = features[p] * (at[p] * whole - 1.0f);
        features[2 * points + p] = features[p] * (at[points + p] * whole - 1.0f);
        features[3 * points + p] = 1.0f;
    }
}

/* The grids of T, dT/du, dT/dv and dT/dvariance, white less the blurred black, at the points.
 * rows_u, boxes_v: (3, size + 1, n) share, slope and bend of each row of modules along u, of each module along v. */
static void fill_points(const Alignment *a, int m, const float *rows_u, const float *boxes_v, const float *growth)
{
    const int of_u[4] = {0, 1, 0, 2}, of_v[4] = {0, 0, 1, 0};
    int n = (int)a->positions, size = (int)a->size;
    int64_t points = a->points, plane = (int64_t)(size + 1) * n;
    float *grid = a->scratch + 2 * n + 7 * plane, *features = a->features + m * FEATURES * points;
    float *slope = a->slope + 2 * m * points;
    float *out[4] = {features, slope, slope + points, features + BLUR * points};
    for (int k = 0; k < 4; k++) {
        for (int i = 0; i < n * n; i++)
            grid[i] = k == 0 ? 1.0f : 0.0f;
        float scale = k == 3 ? -0.5f * growth[0] : -1.0f;
        add_product(boxes_v + of_v[k] * plane, rows_u + of_u[k] * plane, size, n, scale, grid);
        if (k == 3)
            add_product(boxes_v + 2 * plane, rows_u, size, n, -0.5f * growth[1], grid);
        pick(grid, n, a->index_u + m * points, a->index_v + m * points, (int)points, out[k]);
    }
}

/* Draws one marker, blurred by sigma[2] along u and v [modules], its points spaced by reach[2] [modules].
 * growth[2]: how the axes' variances grow with the blur's [modules^2 / px^2]. */
static void draw_marker(const Alignment *a, int m, const float *sigma, const float *reach, const float *growth)
{
    int n = (int)a->positions, size = (int)a->size;
    int64_t plane = (int64_t)(size + 1) * n;
    float *on = a->scratch, *boxes = on + 2 * n, *rows = boxes + 6 * plane;
    for (int axis = 0; axis < 2; axis++) {
        for (int i = 0; i < n; i++) {
            float offset = a->spread[i] * reach[axis];
            offset = offset < MAX_REACH_MODULES ? offset : MAX_REACH_MODULES;
            on[axis * n + i] = a->base[i] + (offset > -MAX_REACH_MODULES ? offset : -MAX_REACH_MODULES);
        }
        unit_boxes(on + axis * n, n, size, sigma[axis], boxes + 3 * axis * plane);
    }
    for (int quantity = 0; quantity < 3; quantity++) {
        over_columns(a->black + (int64_t)m * size * size, size, n, boxes + quantity * plane, rows);
        memcpy(boxes + quantity * plane, rows, sizeof(float) * (size_t)(size * n));
    }
    fill_points(a, m, boxes, boxes + 3 * plane, growth);
    place_points(a, m, on, on + n, a->features + m * FEATURES * a->points);
}

#endif
