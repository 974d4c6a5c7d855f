/* Phase, place and direction of the view as expansions about each block: exact values at a few points, no more. */
#ifndef ARLIGHT_BLOCK_SURFACES_H
#define ARLIGHT_BLOCK_SURFACES_H

#include "eye.h"

#define NODES (CUBIC * CUBIC)

/* Chebyshev nodes from -1 to 1, and the coefficients of the cubic through values there. */
static const float NODE[CUBIC] = {0.92387953f, 0.38268343f, -0.38268343f, -0.92387953f};
static const float OF_NODES[CUBIC][CUBIC] = {
    {-0.10355339f, 0.60355339f, 0.60355339f, -0.10355339f},
    {-0.11208538f, 1.57716101f, -1.57716101f, 0.11208538f},
    {0.70710678f, -0.70710678f, -0.70710678f, 0.70710678f},
    {0.76536686f, -1.84775907f, 1.84775907f, -0.76536686f},
};

/* Rays (NODES) of the nodes of each block's box. */
INLINE void cast_rays(const Blocks *b, const Eye *eye, int first, Lane *x, Lane *y)
{
    int64_t n = b->blocks;
    const float *box = b->box + first;
    for (int k = 0; k < NODES; k++) {
        Lane px, py;
        EACH_LANE
        {
            px[l] = box[l] + NODE[k % CUBIC] * box[2 * n + l];
            py[l] = box[n + l] + NODE[k / CUBIC] * box[3 * n + l];
        }
        undistort(&eye->lens, eye->upright, b->rounds, px, py, x[k], y[k]);
    }
}

/* Replaces rays by the film's phase and the places in the paper's window that they meet. */
INLINE void meet_sheet(const Blocks *b, const Eye *eye, int first, Lane *x, Lane *y, Lane *phase)
{
    int64_t n = b->blocks;
    const float *s = b->sheet + first, *r = eye->rotation, reach = (float)b->reach_mm;
    for (int k = 0; k < NODES; k++)
        EACH_LANE
        {
            float far = eye->centre[2] / (r[2] * x[k][l] + r[5] * y[k][l] + r[8]), cosine;
            float film_x = eye->centre[0] - far * (r[0] * x[k][l] + r[3] * y[k][l] + r[6]);
            float film_y = eye->centre[1] - far * (r[1] * x[k][l] + r[4] * y[k][l] + r[7]);
            float scale = parallax(eye, film_x, film_y, &cosine), room = 1.0f / (s[2 * n + l] - reach);
            x[k][l] = (film_x - scale * (eye->centre[0] - film_x) - s[l]) * room;
            y[k][l] = (film_y - scale * (eye->centre[1] - film_y) - s[n + l]) * room;
            phase[k][l] = s[3 * n + l] * (film_x - s[l]) + s[4 * n + l] * (film_y - s[n + l]) + s[5 * n + l];
        }
}

/* Cubics of the pixel through the exact values at 4 x 4 nodes of each block's box. */
static HOT void expand_surfaces(const Blocks *b, const Eye *from, int first)
{
    const Eye eye = *from;
    Lane at[SURFACES][NODES], by_row[CUBIC];
    cast_rays(b, &eye, first, at[X], at[Y]);
    meet_sheet(b, &eye, first, at[X], at[Y], at[PHASE]);
    for (int surface = 0; surface < SURFACES; surface++)
        for (int power = 0; power < CUBIC; power++) {
            const float *of = OF_NODES[power];
            float *out = b->surfaces + (int64_t)first * CUBIC * TERMS + surface * CUBIC + power;
            for (int row = 0; row < CUBIC; row++) {
                const Lane *node = at[surface] + row * CUBIC;
                EACH_LANE by_row[row][l] =
                    of[0] * node[0][l] + of[1] * node[1][l] + of[2] * node[2][l] + of[3] * node[3][l];
            }
            for (int k = 0; k < CUBIC; k++) {
                Lane term;
                of = OF_NODES[k];
                EACH_LANE term[l] =
                    of[0] * by_row[0][l] + of[1] * by_row[1][l] + of[2] * by_row[2][l] + of[3] * by_row[3][l];
                EACH_LANE out[(l * CUBIC + k) * TERMS] = term[l];
            }
        }
}

/* The view's phase and cosine over the window of the paper, from its middle and the middles of its sides. */
static HOT void expand_look(const Blocks *b, const Eye *from, int first)
{
    const Eye eye = *from;
    int64_t n = b->blocks;
    const float *s = b->sheet + first, reach = (float)b->reach_mm;
    static const float side_x[5] = {0, 1, -1, 0, 0}, side_y[5] = {0, 0, 0, 1, -1};
    Lane value[2][5];
    for (int k = 0; k < 5; k++)
        EACH_LANE
        {
            float room = s[2 * n + l] - reach, film_x, film_y;
            float x = s[l] + side_x[k] * room, y = s[n + l] + side_y[k] * room;
            film_over(&eye, x, y, &film_x, &film_y);
            parallax(&eye, film_x, film_y, &value[1][k][l]);
            value[0][k][l] = 2.0f * (float)PI * (s[3 * n + l] * (film_x - x) + s[4 * n + l] * (film_y - y));
        }
    for (int q = 0; q < 2; q++) {
        float *out = b->look + q * 5 * n + first;
        EACH_LANE
        {
            const Lane *v = value[q];
            out[l] = v[0][l];
            out[n + l] = 0.5f * (v[1][l] - v[2][l]);
            out[2 * n + l] = 0.5f * (v[3][l] - v[4][l]);
            out[3 * n + l] = 0.5f * (v[1][l] + v[2][l]) - v[0][l];
            out[4 * n + l] = 0.5f * (v[3][l] + v[4][l]) - v[0][l];
        }
    }
}

#endif
