/* How the blocks lie in a picture: their usable windows, and the film's phase and place as cubics of the pixel. */
#ifndef ARLIGHT_BLOCK_VIEW_H
#define ARLIGHT_BLOCK_VIEW_H

#include "blocks.h"
#include "rays.h"

#define RESOLVED_CYCLES 0.55f /* harmonics up to this frequency are fitted: beyond, pixels alias them [1/px] */
#define FIRST_CYCLES 0.85f    /* the first is fitted up to here, so that its alias does not leak into the mean [1/px] */
#define NODES (CUBIC * CUBIC)
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

static const float CORNER_X[4] = {-1, 1, 1, -1}, CORNER_Y[4] = {-1, -1, 1, 1};

/* The part of each block's bounding box that is in the picture, and the vignetting in its middle; corners: 1 to 4. */
INLINE void frame_blocks(const Blocks *b, int first, const Lane *px, const Lane *py, const Lane *depth)
{
    int64_t n = b->blocks;
    float *box = b->box + first, *gain = b->gain + first, diagonal = 1.0f / (float)b->half_diagonal_px;
    float right = (float)(b->width - 1), bottom = (float)(b->height - 1);
    float centre_x = (float)b->lens[2], centre_y = (float)b->lens[3];
    float k1 = (float)b->vignetting[0], k2 = (float)b->vignetting[1], k3 = (float)b->vignetting[2];
    int32_t *seen = b->seen + first;
    EACH_LANE
    {
        float left = px[1][l], top = py[1][l], last_x = left, last_y = top, nearest = depth[1][l];
        for (int k = 2; k < 5; k++) {
            left = px[k][l] < left ? px[k][l] : left;
            top = py[k][l] < top ? py[k][l] : top;
            last_x = px[k][l] > last_x ? px[k][l] : last_x;
            last_y = py[k][l] > last_y ? py[k][l] : last_y;
            nearest = depth[k][l] < nearest ? depth[k][l] : nearest;
        }
        left = left > 0.0f ? left : 0.0f;
        top = top > 0.0f ? top : 0.0f;
        last_x = last_x < right ? last_x : right;
        last_y = last_y < bottom ? last_y : bottom;
        box[l] = 0.5f * (left + last_x);
        box[n + l] = 0.5f * (top + last_y);
        box[2 * n + l] = 0.5f * (last_x - left);
        box[3 * n + l] = 0.5f * (last_y - top);
        seen[l] = (last_x > left) & (last_y > top) & (nearest > 0.0f);
        float x = (px[0][l] - centre_x) * diagonal, y = (py[0][l] - centre_y) * diagonal, squared = x * x + y * y;
        gain[l] = 1.0f + squared * (k1 + squared * (k2 + squared * k3));
    }
}

/* The pattern's frequency in the picture, and the margin on the sheet, from the corners' central differences. */
INLINE void measure_slopes(const Blocks *b, int first, const Lane *px, const Lane *py)
{
    int64_t n = b->blocks;
    const float *s = b->sheet + first;
    float *frequency = b->frequency + first, *margin = b->margin + first, edge = (float)b->edge_px;
    int32_t *seen = b->seen + first;
    EACH_LANE
    {
        float side = 0.25f / s[2 * n + l], u = s[3 * n + l], v = s[4 * n + l];
        float xx = side * (px[2][l] + px[3][l] - px[1][l] - px[4][l]);
        float yx = side * (py[2][l] + py[3][l] - py[1][l] - py[4][l]);
        float xy = side * (px[3][l] + px[4][l] - px[1][l] - px[2][l]);
        float yy = side * (py[3][l] + py[4][l] - py[1][l] - py[2][l]);
        float determinant = xx * yy - xy * yx, over = 1.0f / determinant, size = over < 0.0f ? -edge * over : edge * over;
        frequency[l] = (yy * u - yx * v) * over;
        frequency[n + l] = (xx * v - xy * u) * over;
        margin[l] = size * sqrtf(yy * yy + xy * xy);
        margin[n + l] = size * sqrtf(xx * xx + yx * yx);
        seen[l] &= (determinant > 1e-6f) | (determinant < -1e-6f);
    }
}

/* Where blocks lie; seen are those whose every corner is in front of the camera. */
static HOT void place_blocks(const Blocks *b, const Eye *from, int first)
{
    const Eye eye = *from;
    int64_t n = b->blocks;
    const float *s = b->sheet + first;
    Lane px[5], py[5], depth[5];
    for (int k = 0; k < 5; k++) {
        float u = k ? CORNER_X[k - 1] : 0.0f, v = k ? CORNER_Y[k - 1] : 0.0f;
        EACH_LANE look_at(&eye, s[l] + u * s[2 * n + l], s[n + l] + v * s[2 * n + l], &px[k][l], &py[k][l],
                          &depth[k][l]);
    }
    frame_blocks(b, first, px, py, depth);
    measure_slopes(b, first, px, py);
}

/* One straight edge after another of a window whose corners are given, from its box's middle. */
INLINE void draw_edges(const Blocks *b, int first, const Lane *px, const Lane *py, float *edges)
{
    int64_t n = b->blocks;
    for (int k = 0; k < 4; k++) {
        int next = (k + 1) % 4, opposite = (k + 2) % 4;
        float *a = edges + 3 * k * n;
        EACH_LANE
        {
            float mx = b->box[first + l], my = b->box[n + first + l];
            float nx = py[next][l] - py[k][l], ny = px[k][l] - px[next][l];
            float limit = nx * (px[k][l] - mx) + ny * (py[k][l] - my);
            float inside = nx * (px[opposite][l] - mx) + ny * (py[opposite][l] - my);
            float sign = inside > limit ? -1.0f : 1.0f;
            a[l] = sign * nx;
            a[n + l] = sign * ny;
            a[2 * n + l] = sign * limit;
        }
    }
}

/* The part of each block whose pixels may be used: the film point keeps the margin from the block's border, so that
 * no neighbour is blurred into it, and the paper point the reach, so that all its light came through the block. */
static HOT void cut_windows(const Blocks *b, const Eye *from, int first)
{
    const Eye eye = *from;
    int64_t n = b->blocks;
    const float *s = b->sheet + first, reach = (float)b->reach_mm;
    int32_t *seen = b->seen + first;
    for (int paper = 0; paper < 2; paper++) {
        Lane px[4], py[4], depth, room_x, room_y;
        const float *margin = b->margin + first;
        EACH_LANE
        {
            room_x[l] = s[2 * n + l] - (paper ? reach : margin[l]);
            room_y[l] = s[2 * n + l] - (paper ? reach : margin[n + l]);
            seen[l] &= (room_x[l] > 0.0f) & (room_y[l] > 0.0f);
        }
        for (int k = 0; k < 4; k++) {
            EACH_LANE
            {
                float x = s[l] + CORNER_X[k] * room_x[l], y = s[n + l] + CORNER_Y[k] * room_y[l], film_x, film_y;
                film_over(&eye, x, y, &film_x, &film_y);
                film_x = paper ? film_x : x;
                film_y = paper ? film_y : y;
                look_at(&eye, film_x, film_y, &px[k][l], &py[k][l], &depth[l]);
            }
            EACH_LANE seen[l] &= depth[l] > 0.0f;
        }
        draw_edges(b, first, px, py, b->edges + paper * 4 * 3 * n + first);
    }
}

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
    for (int k = 0; k < NODES; k++) {
        Lane bent_x, bent_y;
        EACH_LANE
        {
            float px = b->box[first + l] + NODE[k % CUBIC] * b->box[2 * n + first + l];
            float py = b->box[n + first + l] + NODE[k / CUBIC] * b->box[3 * n + first + l];
            untilted(&eye->lens, eye->upright, px, py, &bent_x[l], &bent_y[l]);
            x[k][l] = bent_x[l];
            y[k][l] = bent_y[l];
        }
        for (int round = 0; round < b->rounds; round++)
            EACH_LANE straighten(&eye->lens, bent_x[l], bent_y[l], &x[k][l], &y[k][l]);
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

/* Harmonics that the pixels can tell from each other; 0 for blocks without a pattern. */
static void count_harmonics(const Blocks *b)
{
    int64_t n = b->blocks;
    for (int64_t i = 0; i < n; i++) {
        float frequency = hypotf(b->frequency[i], b->frequency[n + i]);
        int resolved = frequency > 0.0f && frequency <= FIRST_CYCLES;
        if (resolved && RESOLVED_CYCLES / frequency >= 2.0f)
            resolved = RESOLVED_CYCLES / frequency >= 3.0f ? 3 : 2;
        b->harmonics[i] = resolved;
    }
}

static void view_blocks(const Blocks *b)
{
    Eye eye = eye_of(b);
    for (int first = 0; first < b->blocks; first += LANES) {
        place_blocks(b, &eye, first);
        cut_windows(b, &eye, first);
        expand_surfaces(b, &eye, first);
        expand_look(b, &eye, first);
    }
    count_harmonics(b);
    for (int64_t i = 0; i < b->blocks; i++)
        b->seen[i] &= eye.centre[2] > 0.0f;
}

#endif
