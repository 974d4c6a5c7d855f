/* How the blocks of a sheet appear from a pose. */
#ifndef ARLIGHT_BLOCK_VIEW_H
#define ARLIGHT_BLOCK_VIEW_H

#include "block_surfaces.h"
#include "block_windows.h"

static void view_blocks(const Blocks *b)
{
    Eye eye = eye_of(b);
    for (int first = 0; first < b->blocks; first += LANES) {
        place_blocks(b, &eye, first);
        cut_windows(b, &eye, first);
        expand_surfaces(b, &eye, first);
        expand_look(b, &eye, first);
    }
    count_harmonics(b);
    for (int64_t i = 0; i < b->blocks; i++)
        b->seen[i] &= eye.centre[2] > 0.0f;
}

#endif
