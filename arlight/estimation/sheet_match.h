/* Whether the stripes in a frame can be those of the probe's sheet, whatever the light. */
#ifndef ARLIGHT_SHEET_MATCH_H
#define ARLIGHT_SHEET_MATCH_H

#include "channel_fit.h"
#include "quantile.h"

#define CLEAR_TRANSFER 0.3  /* stripes that blur has left above this share can tell one sheet from another */
#define FAINT 0.01          /* stripes of this amplitude are as good as none, relative to white */
#define FEWEST 4            /* how many patterned blocks, and which share of them, must show clear stripes */
#define SMALLEST_SHARE 0.08

/* Share of the first harmonic that the best fit misses in a typical block.

   On the probe's own sheet noise is left, a few per cent. On a sheet with patterns in other places, of other phases or
   over other glass it is most of the stripes, whatever the light: blocks of one frequency contradict each other. The
   median of |missed| / (|measured| + what is as good as none); nan where too few blocks show clear stripes, as on a
   sheet that is small in the picture. */
static double unexplained_share(const ChannelFit *f)
{
    const MeasuredBlocks *m = f->m;
    const int64_t n = m->stride, c = f->channel;
    int64_t patterned = 0, clear = 0;
    for (int64_t i = 0; i < m->blocks; i++) {
        if (m->kind[i] != PATTERN)
            continue;
        patterned++;
        if (m->resolved[i] < 1.0 || !(plane(f, TRANSFER)[i] > CLEAR_TRANSFER))
            continue;
        const double *x = m->measured + (c * ROWS + 1) * n + i, *p = f->predicted + (c * ROWS + 1) * n + i;
        double across = x[0] - p[0], along = x[n] - p[n], seen = sqrt(x[0] * x[0] + x[n] * x[n]);
        m->scratch[clear++] = sqrt(across * across + along * along) / (seen + FAINT * white_of(f));
    }
    if (clear < FEWEST || (double)clear < SMALLEST_SHARE * (double)patterned)
        return NAN;
    return quantile(m->scratch, clear, 0.5);
}

#endif
