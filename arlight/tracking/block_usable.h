/* A block's pixels that show its stripes and not the image of a lamp in the film. */
#ifndef ARLIGHT_BLOCK_USABLE_H
#define ARLIGHT_BLOCK_USABLE_H

#include "block_light.h"
#include "block_results.h"

#define BRIGHTEST_STRIPE 1.1  /* light that no stripe reaches, relative to white: brighter is a lamp in the film */
#define LAMP_OVER_AVERAGE 1.5 /* light over its block's mean from which a pixel beyond white shows a lamp */
#define MOST_WHITES 256       /* white blocks that are asked how bright white is */

static void sort(float *values, int count)
{
    for (int i = 1; i < count; i++)
        for (int j = i; j > 0 && values[j] < values[j - 1]; j--) {
            float value = values[j];
            values[j] = values[j - 1];
            values[j - 1] = value;
        }
}

/* Lower quartile of the white blocks' means: some may mirror a lamp themselves. 0 without white blocks. */
static float white_level(const float (*mean)[CHANNELS], int whites, int channel)
{
    float values[MOST_WHITES];
    int count = whites < MOST_WHITES ? whites : MOST_WHITES;
    for (int i = 0; i < count; i++)
        values[i] = mean[i][channel];
    sort(values, count);
    float at = 0.25f * (float)(count - 1);
    int below = (int)at;
    int above = below + 1 < count ? below + 1 : below;
    return count == 0 ? 0.0f : values[below] + (at - (float)below) * (values[above] - values[below]);
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

/* Lists a block's pixels without those that show a lamp. level: of white, 0 where it is not known; mean: of all the
 * pixels, where it is asked for. */
static Pixels usable_pixels(const Blocks *b, int at, const Grid *grid, const float level[CHANNELS], float *mean)
{
    int block = b->order[at], over = 0;
    Pixels p = light_pixels(b, block, grid);
    float ceiling[CHANNELS];
    b->gathered[block] = p.total;
    for (int c = 0; c < CHANNELS; c++) {
        if (mean)
            mean[c] = mean_light(&p, b->room, c);
        int known = level[c] > 0.0f && !(b->flags[block] & WHITE);
        float largest = b->light[p.largest[c]], lifted = (float)BRIGHTEST_STRIPE * level[c];
        /* an evenly bright mirror image, the sky's at grazing view, lifts its block's stripes and hides none */
        if (known && largest > lifted)
            lifted = fmaxf(lifted, (float)LAMP_OVER_AVERAGE * mean_light(&p, b->room, c));
        ceiling[c] = known && lifted < (float)b->clip ? lifted : (float)b->clip;
        over |= largest > ceiling[c];
    }
    if (over) {
        Sums all;
        sum_block(0, p.total, p.cosine, p.sine, p.x, p.y, p.light, b->room, &all);
        average_look(b, block, &all);
        leave_out(&p, b->room, ceiling);
    }
    return p;
}

#endif
