/* What one frame tells the next: where to start from. */
#ifndef ARLIGHT_HANDING_ON_H
#define ARLIGHT_HANDING_ON_H

#include <string.h>

#include "channel_passes.h"

#define DARKEST_LEVEL 1e-6

/* What a frame tells the next, numbers in the order of nuisance.py. */
typedef struct {
    double nuisance[NUISANCES], spreads[CHANNELS], scales[2 * CHANNELS];
} Told;

/* Green starts from what the last frame told; without its `blocks` (2, stride), lamps and weights, from none. */
EXPORT void recall(ChannelFit *f, const Told *told, const double *blocks)
{
    const int64_t n = f->m->stride;
    const double square = f->m->white[GREEN] * f->m->white[GREEN];
    memcpy(f->nuisances + GREEN * NUISANCES, told->nuisance, sizeof told->nuisance);
    memcpy(f->spreads, told->spreads, sizeof told->spreads);
    memcpy(f->scales, told->scales, sizeof told->scales);
    if (!blocks) {
        forget(f);
        return;
    }
    for (int64_t i = 0; i < n; i++) {
        f->lamps[GREEN * n + i] = square * blocks[i];
        f->weights[GREEN * n + i] = blocks[n + i];
    }
}

/* Green's coefficients relative to L_0; light is not negative, so none can be larger. */
static void shape_of_green(const ChannelFit *f, double *shape)
{
    const double *green = f->packed + GREEN * coefficients(f), scale = 1.0 / fmax(green[0], DARKEST_LEVEL);
    for (int64_t i = 0; i < coefficients(f); i++)
        shape[i] = fmin(fmax(scale * green[i], -1.0), 1.0);
}

/* Tells the next frame; 0 where this one made no sense. */
static int tell(const ChannelFit *f, Told *told, double *blocks, double *shape)
{
    const int64_t n = f->m->stride;
    const double square = 1.0 / (f->m->white[GREEN] * f->m->white[GREEN]);
    memcpy(told->nuisance, f->nuisances + GREEN * NUISANCES, sizeof told->nuisance);
    memcpy(told->spreads, f->spreads, sizeof told->spreads);
    memcpy(told->scales, f->scales, sizeof told->scales);
    for (int64_t i = 0; i < n; i++) {
        blocks[i] = square * f->lamps[GREEN * n + i];
        blocks[n + i] = f->weights[GREEN * n + i];
    }
    shape_of_green(f, shape);
    int sensible = 1;
    for (int64_t i = 0; i < CHANNELS * coefficients(f); i++)
        sensible &= isfinite(f->packed[i]) != 0;
    return sensible;
}

#endif
