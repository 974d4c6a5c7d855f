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

/* Fits some blocks together, after their sums. */
static void fit_blocks(const Blocks *b, int at, int some)
{
    SmallFits fits;
    fits.rights = CHANNELS;
    fill_fits(&fits, b->sums + at, some, b->harmonics[b->order[at]], SLOPED);
    solve_fits(&fits);
    keep_fits(b, &fits, b->order + at, some, b->sums + at);
    keep_slopes(b, &fits, b->order + at, some);
}

/* Reads and fits all blocks, those of one number of harmonics together. */
static void fit_all(const Blocks *b, int whites, int count)
{
    Grid grid = grid_of(b, 0);
    White white = {0};
    Lamps lamps = {.fits.rights = CHANNELS, .brightest = 1e-6};
    Pixels pixels[FITS];
    int planes = b->shift_x > 0 || b->shift_y > 0 ? 1 : CHANNELS;
    for (int at = 0, some; at < count; at += some) {
        if (at == whites)
            find_level(&white);
        some = alike(b, at, at < whites ? whites : count);
        for (int l = 0; l < some; l++) {
            fetch_block(b, b->order[at + l + AHEAD < count ? at + l + AHEAD : count - 1], planes);
            pixels[l] = usable_pixels(b, at + l, l, &grid, &white);
        }
        fit_blocks(b, at, some);
        find_lamps(b, at, some, pixels, &lamps);
    }
    fit_lamps(b, &lamps);
}

/* Bytes of what is shared with Python, and lists of pixels. */
EXPORT const int64_t block_memory[] = {sizeof(Blocks), sizeof(Sums), sizeof(Tint), LISTS};

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
    clear_results(b);
    view_blocks(b);
    int count = put_in_order(b, &whites);
    if (b->shift_x > 0 || b->shift_y > 0)
        infer_colour(b, count);
    fit_all(b, whites, count);
    finish(b);
}
