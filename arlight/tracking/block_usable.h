/* A block's pixels that show its stripes and not the image of a lamp in the film. */
#ifndef ARLIGHT_BLOCK_USABLE_H
#define ARLIGHT_BLOCK_USABLE_H

#include "block_light.h"
#include "block_results.h"

#define BRIGHTEST_STRIPE 1.1  /* light that no stripe reaches, relative to white: brighter is a lamp in the film */
#define LAMP_OVER_AVERAGE 1.5 /* light over its block's mean from which a pixel beyond white shows a lamp */
#define MOST_WHITES 256       /* white blocks that are asked how bright white is */

/* How bright white is: means of white blocks, and what follows from them; a level of 0 is not known. */
typedef struct {
    int known;
    float mean[MOST_WHITES][CHANNELS], level[CHANNELS];
} White;

static void sort(float *values, int count)
{
    for (int i = 1; i < count; i++)
        for (int j = i; j > 0 && values[j] < values[j - 1]; j--) {
            float value = values[j];
            values[j] = values[j - 1];
            values[j - 1] = value;
        }
}

/* Finds the level: the lower quartile of the blocks' means, some of which may mirror a lamp themselves. */
static void find_level(White *white)
{
    float values[MOST_WHITES], at = 0.25f * (float)(white->known - 1);
    int below = (int)at, above = below + 1 < white->known ? below + 1 : below;
    for (int c = 0; c < CHANNELS && white->known; c++) {
        for (int i = 0; i < white->known; i++)
            values[i] = white->mean[i][c];
        sort(values, white->known);
        white->level[c] = values[below] + (at - (float)below) * (values[above] - values[below]);
    }
}

/* Notes how bright a white block is. */
static void note_white(White *white, const Pixels *p, int64_t room)
{
    if (p->total < LEAST_SAMPLES || white->known == MOST_WHITES)
        return;
    for (int c = 0; c < CHANNELS; c++)
        white->mean[white->known][c] = mean_light(p, room, c);
    white->known++;
}

/* Leaves out the pixels that are brighter than the ceiling in any channel. */
static void leave_out(Pixels *p, int64_t room, const float ceiling[CHANNELS])
{
    int kept = 0;
    for (int i = 0; i < p->total; i++) {
        int used = 1;
        for (int c = 0; c < CHANNELS; c++)
            used &= p->light[c * room + i] <= ceiling[c];
        p->cosine[kept] = p->cosine[i], p->sine[kept] = p->sine[i];
        p->x[kept] = p->x[i], p->y[kept] = p->y[i];
        for (int c = 0; c < CHANNELS; c++)
            p->light[c * room + kept] = p->light[c * room + i];
        kept += used;
    }
    p->total = kept;
    float *lists[4] = {p->cosine, p->sine, p->x, p->y};
    for (int k = 0; k < 4; k++)
        clear_rest(lists[k], kept);
    for (int c = 0; c < CHANNELS; c++)
        clear_rest(p->light + c * room, kept);
}

/* The light from which a block's pixels show a lamp in each channel. Returns whether any pixel is brighter. */
static int find_ceiling(const Blocks *b, int block, const White *white, const Pixels *p, float ceiling[CHANNELS])
{
    int over = 0;
    for (int c = 0; c < CHANNELS; c++) {
        int known = white->level[c] > 0.0f && !(b->flags[block] & WHITE);
        float largest = b->light[p->largest[c]], lifted = (float)BRIGHTEST_STRIPE * white->level[c];
        /* an evenly bright mirror image, the sky's at grazing view, lifts its block's stripes and hides none */
        if (known && largest > lifted)
            lifted = fmaxf(lifted, (float)LAMP_OVER_AVERAGE * mean_light(p, b->room, c));
        ceiling[c] = known && lifted < (float)b->clip ? lifted : (float)b->clip;
        over |= largest > ceiling[c];
    }
    return over;
}

/* Lists a block's pixels without those that show a lamp, and sums over them. at: in the order; place: as for
 * `list_of`. */
static Pixels usable_pixels(const Blocks *b, int at, int place, const Grid *grid, White *white)
{
    int block = b->order[at];
    Pixels p = light_pixels(b, block, place, grid);
    Sums *sums = b->sums + at;
    float ceiling[CHANNELS];
    b->gathered[block] = p.total;
    if (b->flags[block] & WHITE)
        note_white(white, &p, b->room);
    if (find_ceiling(b, block, white, &p, ceiling)) {
        sum_block(0, p.total, p.cosine, p.sine, p.x, p.y, p.light, b->room, sums);
        average_look(b, block, sums);
        leave_out(&p, b->room, ceiling);
        sum_block(b->harmonics[block], p.total, p.cosine, p.sine, p.x, p.y, p.light, b->room, sums);
        return p;
    }
    sum_block(b->harmonics[block], p.total, p.cosine, p.sine, p.x, p.y, p.light, b->room, sums);
    if (p.total > 0)
        average_look(b, block, sums);
    return p;
}

#endif
