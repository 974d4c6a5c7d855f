/* The rows of a region of a picture as Y', Cb, Cr at every pixel, one after the other from its top. */
#ifndef ARLIGHT_VIDEO_ROWS_H
#define ARLIGHT_VIDEO_ROWS_H

#include "lines.h"

/* Below this luma, relative to white, chroma is no longer scaled by it: there the ratio is noise. */
#define MIN_LUMA 0.02f
/* Chroma follows luma at most by this factor upward: grey stripes seldom reach it, coloured edges would pass it. */
#define MAX_GAIN 2.0f

/* Lines that `rows_begin` takes from its scratch memory. */
#define ROW_LINES 17

/* Chroma at its own resolution, of the two chroma rows that the row in work lies between. */
struct rows {
    const struct layout *layout;
    const struct picture *picture;
    struct box box;
    int32_t guided;         /* 1: chroma follows luma, see `conversion.Upsampling` */
    int32_t first, count;   /* chroma columns that the region reads */
    int32_t start, length;  /* pixel columns that these average */
    int32_t held[2];        /* chroma row in each slot, -1 for none; a row's slot is its number's lowest bit */
    float *chroma[2][3];    /* (count) Cb, Cr and luma as chroma sees it */
    float *between;         /* (count) one of these between the two rows */
    float *pixels;          /* (length) */
    float *ycc[3];          /* (width of the region) the result */
    float *rgb[3];          /* (width) the same as colour, from `rows_colour` */
    float *share;           /* (width) places in a curve */
    int32_t *step;
};

/* Begins at the region's top; `scratch` holds ROW_LINES lines of the region's width + LINE_MARGIN floats. */
static inline void rows_begin(struct rows *rows, const struct layout *layout, const struct picture *picture,
                              struct box box, int32_t guided, float *scratch)
{
    const struct axis *columns = &layout->columns;
    int32_t line = box.x1 - box.x0 + LINE_MARGIN;
    rows->layout = layout, rows->picture = picture, rows->box = box;
    rows->guided = guided && layout->subsampled;
    rows->first = columns->lower[box.x0];
    rows->count = columns->upper[box.x1 - 1] - rows->first + 1;
    rows->start = columns->tapped[rows->first];
    int32_t last = columns->tapped[(columns->taps - 1) * columns->samples + rows->first + rows->count - 1];
    rows->length = last - rows->start + 1;
    rows->held[0] = rows->held[1] = -1;
    for (int k = 0; k < 3; k++) {
        rows->chroma[0][k] = scratch + line * k;
        rows->chroma[1][k] = scratch + line * (k + 3);
        rows->ycc[k] = scratch + line * (k + 6);
        rows->rgb[k] = scratch + line * (k + 9);
    }
    rows->between = scratch + line * 12;
    rows->pixels = scratch + line * 13;
    rows->share = scratch + line * 15;
    rows->step = (int32_t *)(scratch + line * 16);
}

/* Luma averaged at the samples of a chroma row as chroma was. */
static inline void luma_as_chroma(struct rows *rows, int32_t r, float *out)
{
    const struct layout *layout = rows->layout;
    const struct axis *axis = &layout->rows;
    float *sum = rows->pixels, *line = rows->pixels + rows->box.x1 - rows->box.x0 + LINE_MARGIN;
    memset(sum, 0, (size_t)rows->length * sizeof(float));
    for (int32_t t = 0; t < axis->taps; t++) {
        const uint8_t *codes = row_of(rows->picture, 0, axis->tapped[t * axis->samples + r]);
        read_codes(codes, layout->wide, rows->start, rows->length, layout->black, 1.0f / layout->luma_span, line);
        add_line(sum, line, axis->tap_weights[t], rows->length);
    }
    average_columns(&layout->columns, sum, rows->start, rows->first, rows->first + rows->count, out);
}

/* Puts a chroma row into its slot. */
static inline float **hold_chroma(struct rows *rows, int32_t r)
{
    const struct layout *layout = rows->layout;
    float **lines = rows->chroma[r & 1];
    if (rows->held[r & 1] != r) {
        for (int k = 0; k < 2; k++)
            read_codes(row_of(rows->picture, k + 1, r), layout->wide, rows->first, rows->count, layout->neutral,
                       1.0f / layout->chroma_span, lines[k]);
        if (rows->guided)
            luma_as_chroma(rows, r, lines[2]);
        rows->held[r & 1] = r;
    }
    return lines;
}

/* What lies a share of the way from a line to another. */
static HOT void mix(const float *before, const float *after, float share, int32_t count, float *restrict out)
{
    for (int32_t i = 0; i < count; i++)
        out[i] = before[i] + share * (after[i] - before[i]);
}

/* Pairs of pixels, each between two entries of a line; their places and weights repeat by two. */
static HOT void spread_pairs(const float *restrict line, const float *restrict later, const float *weight,
                             int32_t pairs, float *restrict out)
{
    float even = weight[0], odd = weight[1];
    for (int32_t i = 0; i < pairs; i++) {
        out[2 * i] = line[i] + even * (line[i + 1] - line[i]);
        out[2 * i + 1] = later[i] + odd * (later[i + 1] - later[i]);
    }
}

/* Chroma at the pixels x0 <= x < x1 of a row, from a line that begins at chroma sample `first`. */
static inline void spread(const struct axis *columns, const float *line, int32_t first, int32_t x0, int32_t x1,
                          float *restrict out)
{
    const int32_t *lower = columns->lower, *upper = columns->upper;
    int32_t from = x1, to = x1;
    if (columns->share == 1) {
        memcpy(out, line + (x0 - first), (size_t)(x1 - x0) * sizeof(float));
        return;
    }
    if (columns->share == 2) {
        from = clamped(columns->inner_pixels[0], x0, x1);
        to = from + 2 * ((clamped(columns->inner_pixels[1], from, x1) - from) / 2);
    }
    for (int32_t x = x0; x < x1; x++) {
        if (x == from && from < to) {
            spread_pairs(line + (lower[x] - first), line + (lower[x + 1] - first), columns->weight + x,
                         (to - from) / 2, out + (x - x0));
            x = to;
        }
        if (x < x1) {
            float before = line[lower[x] - first];
            out[x - x0] = before + columns->weight[x] * (line[upper[x] - first] - before);
        }
    }
}

/* Chroma follows luma: times Y' over Y' as chroma sees it. */
static HOT void guide(const float *restrict luma, const float *restrict low, int32_t count, float *restrict cb,
                      float *restrict cr)
{
    for (int32_t i = 0; i < count; i++) {
        float own = luma[i] > MIN_LUMA ? luma[i] : MIN_LUMA;
        float gain = own / (low[i] > MIN_LUMA ? low[i] : MIN_LUMA);
        gain = gain < MAX_GAIN ? gain : MAX_GAIN;
        cb[i] *= gain;
        cr[i] *= gain;
    }
}

/* Fills `ycc` with the pixels x0 <= x < x1 of row y of the region; rows are to be asked for from top to bottom. */
static inline void rows_read(struct rows *rows, int32_t y, int32_t x0, int32_t x1)
{
    const struct layout *layout = rows->layout;
    int32_t at = x0 - rows->box.x0, width = x1 - x0;
    float share = layout->rows.weight[y], *low = rows->pixels;
    read_codes(row_of(rows->picture, 0, y), layout->wide, x0, width, layout->black, 1.0f / layout->luma_span,
               rows->ycc[0] + at);
    float **above = hold_chroma(rows, layout->rows.lower[y]), **below = hold_chroma(rows, layout->rows.upper[y]);
    for (int k = 0; k < 2 + rows->guided; k++) {
        mix(above[k], below[k], share, rows->count, rows->between);
        spread(&layout->columns, rows->between, rows->first, x0, x1, k < 2 ? rows->ycc[k + 1] + at : low);
    }
    if (rows->guided)
        guide(rows->ycc[0] + at, low, width, rows->ycc[1] + at, rows->ycc[2] + at);
}

/* Fills `rgb` with the colour of the same pixels through a curve. */
static inline void rows_colour(struct rows *rows, struct curve curve, int32_t x0, int32_t x1)
{
    int32_t at = x0 - rows->box.x0, width = x1 - x0;
    float *ycc[3] = {rows->ycc[0] + at, rows->ycc[1] + at, rows->ycc[2] + at};
    for (int k = 0; k < 3; k++) {
        locate_component(curve, rows->layout->rgb_from_ycc + 3 * k, ycc, width, rows->step, rows->share);
        look_up(curve, rows->step, rows->share, width, rows->rgb[k] + at);
    }
}

#endif
