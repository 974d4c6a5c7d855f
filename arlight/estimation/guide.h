/* What a fit hands on, block by block: the stripes to expect in the next frame, and what the film mirrors. */
#ifndef ARLIGHT_GUIDE_H
#define ARLIGHT_GUIDE_H

#include "measured_blocks.h"

#define FAINT_STRIPES 0.01 /* of white; fainter ones are taken to have its colour */

/* One block's rows (7, 3), with its stripes of one colour: those of red and blue are green's, scaled. What differs in
   shape comes from chroma, and expecting it again would let its errors feed themselves. */
INLINE void guide_block(const double *predicted, int64_t stride, const double *white, double *to)
{
    const double *green = predicted + GREEN * ROWS * stride;
    const double floor = FAINT_STRIPES * FAINT_STRIPES * white[GREEN] * white[GREEN];
    for (int c = 0; c < CHANNELS; c++) {
        const double *rows = predicted + c * ROWS * stride;
        double above = floor * white[c] / white[GREEN], below = floor;
        for (int r = 1; r < ROWS; r++) {
            above += rows[r * stride] * green[r * stride];
            below += green[r * stride] * green[r * stride];
        }
        to[c] = rows[0];
        for (int r = 1; r < ROWS; r++)
            to[r * CHANNELS + c] = green[r * stride] * above / below;
    }
}

/* Writes stripes (blocks, 7, 3) and reflection (blocks, 3) in the sheet's own order; blocks that were not used stay. */
static HOT void guide(const MeasuredBlocks *m, const double *predicted, const double *mirrored, double *stripes,
                      double *reflection)
{
    for (int64_t j = 0; j < m->blocks; j++) {
        int64_t i = m->sequence[j];
        guide_block(predicted + j, m->stride, m->white, stripes + i * ROWS * CHANNELS);
        for (int c = 0; c < CHANNELS; c++)
            reflection[i * CHANNELS + c] = mirrored[c * m->stride + j];
    }
}

#endif
