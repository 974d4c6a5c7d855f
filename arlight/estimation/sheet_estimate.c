/* One frame's light in one call: from what was measured on its blocks and what the last frame told. */
#include <string.h>

#include "channel_passes.h"
#include "gathering.h"
#include "guide.h"
#include "handing_on.h"
#include "response.h"

#define FIRST_PASSES 4 /* in a frame without predecessor */

typedef struct {
    MeasuredBlocks *measured;
    Response *response;
    ChannelFit *fit;
    int64_t all;        /* blocks of the sheet, of which the first of the sequence are used */
    int64_t passes;     /* how often weights and solution of green are refined */
    double chi2;        /* result: robust chi-square a row, mean over the channels */
    double unexplained; /* result: share of the stripes that no light explains */
} SheetEstimate;

/* Coefficients (frequencies + 1, 3), complex. */
static void unpack(const ChannelFit *f, double *to)
{
    for (int c = 0; c < CHANNELS; c++) {
        const double *packed = f->packed + c * coefficients(f);
        for (int64_t k = 0; k <= f->frequencies; k++) {
            to[2 * (k * CHANNELS + c)] = packed[k ? 2 * k - 1 : 0];
            to[2 * (k * CHANNELS + c) + 1] = k ? packed[2 * k] : 0.0;
        }
    }
}

/* Fits all channels; green of a frame that has no predecessor settles, the light's shape among the rest. */
static void fit_sheet(SheetEstimate *e, const double *shape, int64_t known, double *found)
{
    ChannelFit *f = e->fit;
    e->response->blocks = e->measured->blocks;
    e->response->folded = 1;
    respond(e->response, shape, known);
    fit_channel(f, GREEN, shape ? e->passes : FIRST_PASSES, !shape);
    if (!shape) {
        shape_of_green(f, found);
        respond(e->response, found, coefficients(f));
        fit_channel(f, GREEN, FIRST_PASSES, 1);
    }
    e->chi2 = f->chi2;
    e->unexplained = f->unexplained;
    for (int c = 0; c < CHANNELS; c++)
        if (c != GREEN) {
            fit_channel(f, c, 1, 0);
            e->chi2 += f->chi2;
        }
    e->chi2 /= CHANNELS;
}

/* Estimates a frame's light.

   Of the last frame: what it told, `blocks` (2, stride) and `shape` (known), both NULL where nothing is known. Of this
   one, for the next: the same, `shape` of all coefficients. Also written: coefficients (frequencies + 1, 3), complex,
   and in the sheet's own order stripes (all, 7, 3) and reflection (all, 3). Returns 0 where the frame made no sense. */
EXPORT int estimate_sheet(SheetEstimate *e, const Told *last, const double *last_blocks, const double *last_shape,
                          int64_t known, Told *next, double *blocks, double *shape, double *light, double *stripes,
                          double *reflection)
{
    ChannelFit *f = e->fit;
    gather(e->measured);
    recall(f, last, last_blocks);
    fit_sheet(e, last_shape, known, shape);
    if (e->measured->blocks < e->all) {
        memset(stripes, 0, sizeof(double) * (size_t)(e->all * ROWS * CHANNELS));
        memset(reflection, 0, sizeof(double) * (size_t)(e->all * CHANNELS));
    }
    guide(e->measured, f->predicted, f->reflection, stripes, reflection);
    unpack(f, light);
    return tell(f, next, blocks, shape);
}
