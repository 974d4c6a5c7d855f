/* Faces in the order in which bands of rows need them, and within a band in their own: the samples of a band stay in
   the processor's cache, those of a picture do not. */
#ifndef ARLIGHT_BANDS_H
#define ARLIGHT_BANDS_H

#include "native.h"

#include <string.h>

typedef struct {
    int32_t *listed; /* (2, room) faces that are to be drawn, and the band that each begins in */
    int32_t *sorted; /* (room,) the same faces, band by band */
    int32_t *kept;   /* (2, room) those of the last band that go on in this one, and of this one in the next, in turns */
    int32_t *ends;   /* (count,) where in `sorted` the faces end that begin in each band */
    int64_t room, count, rows; /* faces, bands, rows of a band */
} Bands;

/* Where the work on one band is. */
typedef struct {
    const int32_t *own, *own_end;         /* faces that begin in it */
    const int32_t *going_on, *going_on_end;
    int32_t *kept;                        /* where the next one that goes on from it belongs */
} Band;

INLINE void begin_listing(const Bands *b) { memset(b->ends, 0, (size_t)b->count * sizeof *b->ends); }

/* Takes down a face, if it is `drawn`, by its first row within the picture or above it; how many there are then. */
INLINE int64_t list_face(const Bands *b, int64_t listed, int32_t face, int row, int drawn)
{
    /* the middle of a row is far enough from the next band for a float */
    int32_t band = drawn & (row > 0) ? (int32_t)(((float)row + 0.5f) / (float)b->rows) : 0;
    b->listed[listed] = face, b->listed[b->room + listed] = band;
    b->ends[band] += drawn;
    return listed + drawn;
}

INLINE void sort_listed(const Bands *b, int64_t listed)
{
    int32_t first = 0;
    for (int64_t i = 0; i < b->count; i++) {
        int32_t faces = b->ends[i];
        b->ends[i] = first;
        first += faces;
    }
    /* what was the first place becomes the end */
    for (int64_t i = 0; i < listed; i++)
        b->sorted[b->ends[b->listed[b->room + i]]++] = b->listed[i];
}

/* The band after `last`, or the first one. */
INLINE Band begin_band(const Bands *b, int64_t number, const Band *last)
{
    int32_t *kept = b->kept + (number % 2) * b->room;
    Band band = {.own = b->sorted + (number ? b->ends[number - 1] : 0), .own_end = b->sorted + b->ends[number]};
    band.going_on = band.going_on_end = b->kept + ((number + 1) % 2) * b->room;
    if (number)
        band.going_on_end = last->kept;
    band.kept = kept;
    return band;
}

INLINE int has_face(const Band *band) { return (band->own < band->own_end) | (band->going_on < band->going_on_end); }

/* The next face of a band that has one. */
INLINE int32_t next_face(Band *band)
{
    if (band->going_on == band->going_on_end || (band->own < band->own_end && *band->own < *band->going_on))
        return *band->own++;
    return *band->going_on++;
}

#endif
