/* Linear light of a block's pixels. */
#ifndef ARLIGHT_BLOCK_LIGHT_H
#define ARLIGHT_BLOCK_LIGHT_H

#include "block_chroma.h"

/* A block's pixels: lists of cos and sin of the phase, the place x, y, and CHANNELS lists of light, `room` apart. */
typedef struct {
    int total;
    int32_t largest[CHANNELS]; /* largest place in the decoding table */
    float *cosine, *sine, *x, *y, *light;
} Pixels;

/* The entry of a table nearest to a value between 0 and `last`, its last entry. */
INLINE int32_t place_of(float value, int32_t last)
{
    int32_t at = (int32_t)(value + 0.5f);
    at = at > 0 ? at : 0;
    return at < last ? at : last;
}

/* Places in the decoding table of one channel that follows from luma and phase. */
INLINE void colour_pixels(int harmonics, int total, const Tint *from, int32_t last, const float *restrict luma,
                          const float *restrict limited, const float *restrict c, const float *restrict s,
                          int32_t *restrict places)
{
    const Tint tint = *from;
    int steps = (total + STEP - 1) & -STEP;
    for (int i = 0; i < steps; i++) {
        float ck = c[i], sk = s[i], series = tint.series[0];
        float level = tint.luma * luma[i] + tint.level[0] + tint.level[1] * ck + tint.level[2] * sk;
#pragma GCC unroll 3
        for (int k = 1; k <= harmonics; k++) {
            series += tint.series[2 * k - 1] * ck + tint.series[2 * k] * sk;
            float next = ck * c[i] - sk * s[i];
            sk = sk * c[i] + ck * s[i];
            ck = next;
        }
        places[i] = place_of(limited[i] * series + level, last);
    }
}

/* The same of what three planes hold at full resolution. */
INLINE void mix_pixels(int total, const double *matrix, int32_t last, const float *restrict first,
                       const float *restrict second, const float *restrict third, int32_t *restrict places)
{
    float by_first = (float)(matrix[0] * last), by_second = (float)(matrix[1] * last);
    float by_third = (float)(matrix[2] * last);
    int steps = (total + STEP - 1) & -STEP;
    for (int i = 0; i < steps; i++)
        places[i] = place_of(by_first * first[i] + by_second * second[i] + by_third * third[i], last);
}

INLINE int32_t largest_place(int total, const int32_t *restrict places)
{
    int32_t most = 0;
    for (int i = 0; i < total; i++)
        most = places[i] > most ? places[i] : most;
    return most;
}

/* Reads two places at a time, one entry after another: processors gather from tables more slowly. */
static void look_up(const float *restrict table, int total, const int32_t *restrict places, float *restrict out)
{
    for (int i = 0; i < total; i += 4) {
        uint64_t pair[2];
        memcpy(pair, places + i, sizeof pair);
        out[i] = table[(uint32_t)pair[0]];
        out[i + 1] = table[pair[0] >> 32];
        out[i + 2] = table[(uint32_t)pair[1]];
        out[i + 3] = table[pair[1] >> 32];
    }
}

/* Mean light of a channel. */
static HOT float mean_light(const Pixels *p, int64_t room, int channel)
{
    const float *light = p->light + channel * room;
    float sum = 0.0f;
    int steps = (p->total + STEP - 1) & -STEP;
    for (int i = 0; i < steps; i++)
        sum += light[i];
    return p->total ? sum / (float)p->total : 0.0f;
}

/* Places in the decoding table of one channel's light. */
static HOT int32_t find_places(const Blocks *b, int block, int channel, const Pixels *p)
{
    const Tint *tint = b->tints + block * CHANNELS + channel;
    const float *c = p->cosine, *s = p->sine, *codes = b->lists, *others = codes + b->room;
    int32_t last = (int32_t)b->entries - 1, *places = table_places(b);
    int harmonics = b->harmonics[block], total = p->total;
    if (b->shift_x == 0 && b->shift_y == 0)
        mix_pixels(total, b->rgb_from_ycc + 3 * channel, last, codes, others, others + b->room, places);
    else if (harmonics == 0)
        colour_pixels(0, total, tint, last, codes, others, c, s, places);
    else if (harmonics == 1)
        colour_pixels(1, total, tint, last, codes, others, c, s, places);
    else if (harmonics == 2)
        colour_pixels(2, total, tint, last, codes, others, c, s, places);
    else
        colour_pixels(3, total, tint, last, codes, others, c, s, places);
    return largest_place(total, places);
}

/* Turns phases into cosines and sines, and limits the luma that chroma is scaled with. */
static HOT void prepare_pixels(const Blocks *b, int block, const Pixels *p)
{
    float *luma = b->lists;
    turn_all(p->total, p->cosine, p->sine);
    if (b->shift_x > 0 || b->shift_y > 0)
        limit_luma(b->harmonics[block], p->total, limit_of(b, block), luma, p->cosine, p->sine, luma + b->room);
}

/* Lists the pixels of a block and their light. place: as for `list_of`. */
static Pixels light_pixels(const Blocks *b, int block, int place, const Grid *grid)
{
    int what = b->shift_x > 0 || b->shift_y > 0 ? LUMA : ALL_PLANES;
    int total = list_cells(b, block, place, grid, (int)b->limit, what);
    Pixels p = {total, {0}, list_of(b, place, PHASE_LIST), list_of(b, place, SINE_LIST), list_of(b, place, X_LIST),
                list_of(b, place, Y_LIST), list_of(b, place, LIGHT_LIST)};
    prepare_pixels(b, block, &p);
    for (int c = 0; c < CHANNELS; c++) {
        p.largest[c] = find_places(b, block, c, &p);
        look_up(b->light, p.total, table_places(b), p.light + c * b->room);
        clear_rest(p.light + c * b->room, p.total);
    }
    for (int k = PHASE_LIST; k < LIGHT_LIST; k++)
        clear_rest(list_of(b, place, k), p.total);
    return p;
}

#endif
