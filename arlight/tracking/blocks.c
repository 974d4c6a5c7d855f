/* The blocks of one frame: means, and harmonics of their stripes, in linear light. */
#include "block_lamps.h"
#include "block_view.h"

#define AHEAD 2 /* blocks */

/* Lists the blocks to measure: white ones first, then by harmonics. Returns their number. */
static int put_in_order(const Blocks *b, int *whites)
{
    int count = 0;
    for (int key = -1; key <= HARMONICS; key++) {
        for (int i = 0; i < b->blocks; i++) {
            int white = (b->flags[i] & WHITE) != 0;
            if ((b->flags[i] & WANTED) && b->seen[i] && (white ? key == -1 : key == b->harmonics[i]))
                b->order[count++] = i;
        }
        if (key == -1)
            *whites = count;
    }
    return count;
}

/* Reads the cells of all blocks; chroma: by place in the order. */
static void read_chroma(const Blocks *b, int count, int limited, Chroma *chroma)
{
    Grid grid = grid_of(b, 1);
    for (int at = 0; at < count; at++) {
        fetch_block(b, b->order[at + AHEAD < count ? at + AHEAD : count - 1], CHANNELS);
        sum_cells(b, b->order[at], &grid, limited, b->sums + at, chroma + at);
    }
}

/* Brings shared chroma to every pixel: coefficients of each block's colour. */
static void infer_colour(const Blocks *b, int count)
{
    Chroma chroma[count ? count : 1];
    predict_hues(b, count);
    read_chroma(b, count, 1, chroma);
    for (int at = 0, some; at < count; at += some) {
        some = alike(b, at, count);
        fit_cells(b, b->order + at, some, b->sums + at, chroma + at);
    }
    Stream stream = observe_stream(b, count, chroma);
    for (int at = 0; at < count; at++) {
        double correction[2][3];
        b->trust[b->order[at]] = correct(&stream, chroma + at, correction);
        mix_tints(b, b->order[at], chroma + at, correction);
    }
}

/* Sums over the usable pixels of every block; level: of white. */
static void sum_blocks(const Blocks *b, int whites, int count, float level[CHANNELS])
{
    Grid grid = grid_of(b, 0);
    float mean[MOST_WHITES][CHANNELS];
    int known = 0, planes = b->shift_x > 0 || b->shift_y > 0 ? 1 : CHANNELS;
    for (int c = 0; c < CHANNELS; c++)
        level[c] = 0.0f;
    for (int at = 0; at < count; at++) {
        if (at == whites)
            for (int c = 0; c < CHANNELS; c++)
                level[c] = white_level((const float(*)[CHANNELS])mean, known, c);
        int white = at < whites && known < MOST_WHITES;
        fetch_block(b, b->order[at + AHEAD < count ? at + AHEAD : count - 1], planes);
        Pixels p = usable_pixels(b, at, &grid, level, white ? mean[known] : NULL);
        sum_block(b->harmonics[b->order[at]], p.total, p.cosine, p.sine, p.x, p.y, p.light, b->room, b->sums + at);
        if (p.total > 0 && p.total == b->gathered[b->order[at]])
            average_look(b, b->order[at], b->sums + at);
        known += white && b->gathered[b->order[at]] >= LEAST_SAMPLES;
    }
}

static void fit_blocks(const Blocks *b, int count)
{
    SmallFits fits;
    fits.rights = CHANNELS;
    for (int at = 0, some; at < count; at += some) {
        int used[FITS];
        float squares[FITS][CHANNELS];
        some = alike(b, at, count);
        fill_fits(&fits, b->sums + at, some, b->harmonics[b->order[at]], 1);
        for (int l = 0; l < some; l++) {
            used[l] = (int)b->sums[at + l].cosine[0];
            memcpy(squares[l], b->sums[at + l].squares, sizeof squares[l]);
        }
        solve_fits(&fits);
        keep_fits(b, &fits, b->order + at, some, used, (const float(*)[CHANNELS])squares);
    }
}

/* Bytes of what is shared with Python, and lists of pixels. */
EXPORT const int64_t block_memory[] = {sizeof(Blocks), sizeof(Sums), sizeof(Tint), LISTS + COLUMNS + CHANNELS + 4};

/* Rays (2, count) of pixels (2, count), of whole LANES. */
EXPORT HOT void undistort_pixels(const Blocks *b, int64_t rounds, int64_t count, const float *pixels, float *rays)
{
    Eye eye = eye_of(b);
    for (int64_t i = 0; i + LANES <= count; i += LANES)
        undistort(&eye.lens, eye.upright, rounds, pixels + i, pixels + count + i, rays + i, rays + count + i);
}

/* Mean codes of all blocks where chroma is shared, and how many cells they are of. */
EXPORT void survey_blocks(const Blocks *b)
{
    int whites;
    clear_results(b);
    view_blocks(b);
    int count = put_in_order(b, &whites);
    Chroma chroma[count ? count : 1];
    read_chroma(b, count, 0, chroma);
    for (int at = 0; at < count; at++) {
        memcpy(b->mean_code + 3 * b->order[at], chroma[at].mean, sizeof chroma[at].mean);
        b->gathered[b->order[at]] = (int32_t)b->sums[at].cosine[0];
    }
}

EXPORT void measure_blocks(const Blocks *b)
{
    int whites;
    float level[CHANNELS];
    double uneven[b->blocks * CHANNELS];
    clear_results(b);
    view_blocks(b);
    int count = put_in_order(b, &whites);
    if (b->shift_x > 0 || b->shift_y > 0)
        infer_colour(b, count);
    sum_blocks(b, whites, count, level);
    fit_blocks(b, count);
    treat_lamps(b, count, level, uneven);
    finish(b, uneven);
}
