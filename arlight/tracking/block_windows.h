/* Where blocks lie in a picture, and the part of each whose pixels may be used. */
#ifndef ARLIGHT_BLOCK_WINDOWS_H
#define ARLIGHT_BLOCK_WINDOWS_H

#include "eye.h"

#define RESOLVED_CYCLES 0.55f /* harmonics up to this frequency are fitted: beyond, pixels alias them [1/px] */
#define FIRST_CYCLES 0.85f    /* the first is fitted up to here, so that its alias does not leak into the mean [1/px] */

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
        float determinant = xx * yy - xy * yx, over = 1.0f / determinant;
        float size = over < 0.0f ? -edge * over : edge * over;
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

#endif
