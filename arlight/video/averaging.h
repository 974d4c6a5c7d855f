/* Rows of pixels written as codes from top to bottom, chroma averaged: a few rows are kept, never the whole region. */
#ifndef ARLIGHT_VIDEO_AVERAGING_H
#define ARLIGHT_VIDEO_AVERAGING_H

#include "lines.h"

/* Rows kept for chroma that averages them: more than a chroma sample's reach. */
#define KEPT 8

/* Lines that averaging works on, of each kept row. */
enum { CHANGED, OLD_CB, OLD_CR, NEW_CB, NEW_CR, KINDS };

/* Chroma rows that are averaged as soon as the last of their pixels' rows is there. */
struct averaging {
    const struct axis *columns, *rows;
    int32_t x0, y0, x1, y1;             /* pixels that are there; samples that average others are left alone */
    int32_t first, end;                 /* chroma columns */
    int32_t next;                       /* chroma row */
    float *kept[KEPT][KINDS];           /* (x1 - x0) pixels' row y in place y % KEPT */
    float *sums[KINDS];                 /* (x1 - x0) weighted sums of rows */
    float *means[KINDS];                /* (end - first) */
};

/* Lines that `averaging_begin` takes from its scratch memory. */
#define AVERAGING_LINES ((KEPT + 2) * KINDS)

/* Begins at the top of the pixels that are there; `scratch` holds AVERAGING_LINES lines of their width + LINE_MARGIN
   floats. */
static inline void averaging_begin(struct averaging *work, const struct layout *layout, struct box there,
                                   float *scratch)
{
    const struct axis *columns = &layout->columns, *rows = &layout->rows;
    int32_t line = there.x1 - there.x0 + LINE_MARGIN;
    work->columns = columns, work->rows = rows;
    work->x0 = there.x0, work->y0 = there.y0, work->x1 = there.x1, work->y1 = there.y1;
    for (int i = 0; i < KEPT; i++)
        for (int k = 0; k < KINDS; k++)
            work->kept[i][k] = scratch + line * (i * KINDS + k);
    for (int k = 0; k < KINDS; k++) {
        work->sums[k] = scratch + line * (KEPT * KINDS + k);
        work->means[k] = scratch + line * ((KEPT + 1) * KINDS + k);
    }
    work->first = columns->lower[there.x0];
    work->next = rows->lower[there.y0];
    work->end = columns->upper[there.x1 - 1] + 1;
    const int32_t *last = columns->tapped + (columns->taps - 1) * columns->samples;
    while (work->first < work->end && columns->tapped[work->first] < there.x0)
        work->first++;
    while (work->end > work->first && last[work->end - 1] >= there.x1)
        work->end--;
    while (work->next < rows->samples && rows->tapped[work->next] < there.y0)
        work->next++;
}

/* Averages the kept rows, from a kind on, at the samples first <= c < end of chroma row r. */
static inline void average_rows(struct averaging *work, int32_t r, int kind, int32_t first, int32_t end)
{
    const struct axis *rows = work->rows, *columns = work->columns;
    int32_t start = columns->tapped[first], last = columns->tapped[(columns->taps - 1) * columns->samples + end - 1];
    for (int k = kind; k < KINDS; k++) {
        float *sum = work->sums[k];
        memset(sum, 0, (size_t)(last + 1 - start) * sizeof(float));
        for (int32_t t = 0; t < rows->taps; t++) {
            const float *line = work->kept[rows->tapped[t * rows->samples + r] % KEPT][k] + (start - work->x0);
            add_line(sum, line, rows->tap_weights[t], last + 1 - start);
        }
        average_columns(columns, sum, start, first, end, work->means[k]);
    }
}

/* The next chroma row whose pixels' rows are all there up to y, -1 for none. */
static inline int32_t averaging_next(struct averaging *work, int32_t y)
{
    const struct axis *rows = work->rows;
    if (work->next >= rows->samples || rows->tapped[(rows->taps - 1) * rows->samples + work->next] > y)
        return -1;
    return work->next++;
}

/* Rounds values into a row of codes where they changed. */
static HOT void write_changed(uint8_t *row, int32_t wide, int32_t first, const float *restrict values,
                              const float *restrict changed, int32_t count, float zero, float span, float top)
{
    if (wide) {
        uint16_t *codes = (uint16_t *)row + first;
        for (int32_t i = 0; i < count; i++) {
            int32_t code = nearest_code(values[i], zero, span, top), old = codes[i];
            codes[i] = (uint16_t)(changed[i] > 0.0f ? code : old);
        }
    } else {
        uint8_t *codes = row + first;
        for (int32_t i = 0; i < count; i++) {
            int32_t code = nearest_code(values[i], zero, span, top), old = codes[i];
            codes[i] = (uint8_t)(changed[i] > 0.0f ? code : old);
        }
    }
}

#endif
