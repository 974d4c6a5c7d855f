/* Takes a share of the light from a picture's pixels, in its own codes: no pixel is brought to linear light and back.

   A transfer curve is a power of light, scaled and lowered, above a straight toe that ends at E = e,

       E = (1 + b) L^p - b,

   so that light times g encodes to t - b, t = k (E + b), k = g^p, while that is above the toe. What ends in the toe is
   proportional to light: to t^(1/p), or to g E where it began there. In u, which runs up to 1 where it ends at e or
   began there, both are u^(1/p), for which u^2 (1 - q + q u), q = 1/p - 2, is good to a fifth of an 8-bit code.
   Nothing is lost to rounding: k = 1 gives back the very code. */
#include <string.h>

#include "codes.h"
#include "picture.h"

/* Pixels between two nodes at which the share is known. */
#define NODE 4

/* Lines of pixels. */
enum { FACTORS = 3, OFFSETS = 3, SUMS = 2, LINES = FACTORS + OFFSETS + SUMS };
/* Numbers of scratch memory to a column of nodes: k at two rows of them and between, and the lines of pixels. */
EXPORT const int32_t dimming_scratch = 9 + LINES * NODE;

struct dimming {
    const float *left;      /* (3, rows, columns) share of red, green, blue light at every NODE-th pixel of the box */
    int32_t rows, columns;
    struct box box;         /* begins with a chroma sample */
    int32_t across, down;   /* pixels that share a chroma sample, 1 or 2 */
    float toe, lowered, bend;   /* e, b and q */
    float *scratch;         /* (columns * dimming_scratch) */
};

/* Consecutive nodes or pixels. */
struct run { int32_t first, end; };

/* What works on one row of chroma samples. */
struct band {
    const struct layout *layout;
    const struct dimming *d;
    float *factor[3];       /* (pixels) k of each colour */
    float *offset[3];       /* (pixels) what chroma adds to luma in each colour */
    float *sum[2];          /* (pixels) Cb and Cr, summed over the band's rows */
};

/* k of a colour at a row of nodes, to a fortieth of an 8-bit code. */
static HOT void encode_shares(const struct layout *layout, const struct dimming *d, const float *restrict left,
                              float *restrict factor)
{
    const float *restrict curve = layout->encode.values;
    float b = d->lowered, scale = 1.0f / (1.0f + b), last = layout->encode.last;
#pragma GCC ivdep
    for (int32_t i = 0; i < d->columns; i++) {
        /* what is no number takes nothing away */
        float share = left[i] < 1.0f ? left[i] : 1.0f;
        int32_t at = (int32_t)(sqrtf(share > 0.0f ? share : 0.0f) * last + 0.5f);
        factor[i] = share < 1.0f ? (curve[at] + b) * scale : 1.0f;
    }
}

static void encode_node_row(const struct layout *layout, const struct dimming *d, int32_t row, float *factors)
{
    row = row < d->rows ? row : d->rows - 1;
    for (int k = 0; k < 3; k++)
        encode_shares(layout, d, d->left + ((ptrdiff_t)k * d->rows + row) * d->columns, factors + k * d->columns);
}

/* The nodes of two rows beside which none takes anything away; least: scratch. */
static HOT struct run dimmed_nodes(const struct dimming *d, const float *restrict above, const float *restrict below,
                                   float *restrict least)
{
    int32_t n = d->columns;
    struct run run = {0, n};
    for (int32_t i = 0; i < n; i++) {
        float a = above[i] < below[i] ? above[i] : below[i];
        float b = above[n + i] < below[n + i] ? above[n + i] : below[n + i];
        float c = above[2 * n + i] < below[2 * n + i] ? above[2 * n + i] : below[2 * n + i];
        a = a < b ? a : b;
        least[i] = a < c ? a : c;
    }
    while (run.first < n && least[run.first] == 1.0f)
        run.first++;
    while (run.end > run.first && least[run.end - 1] == 1.0f)
        run.end--;
    return run;
}

static HOT void mix_nodes(const float *restrict above, const float *restrict below, float share, int32_t count,
                          float *restrict out)
{
    for (int32_t i = 0; i < count; i++)
        out[i] = above[i] + share * (below[i] - above[i]);
}

/* k at the pixels from node `first` to before node `end`. */
static HOT void spread_nodes(const float *restrict nodes, int32_t first, int32_t end, float *restrict factor)
{
    for (int32_t i = first; i < end; i++)
        for (int32_t j = 0; j < NODE; j++)
            factor[NODE * i + j] = nodes[i] + (float)j / NODE * (nodes[i + 1] - nodes[i]);
}

INLINE void offset_pixels(const struct band *band, const void *restrict cb, const void *restrict cr, int wide,
                          int across, int32_t first, int32_t samples)
{
    const struct layout *l = band->layout;
    const float *m = l->rgb_from_ycc;
    float scale = 1.0f / l->chroma_span, neutral = l->neutral;
    float m1 = m[1], m2 = m[2], m4 = m[4], m5 = m[5], m7 = m[7], m8 = m[8];
    float *restrict red = band->offset[0] + first, *restrict green = band->offset[1] + first;
    float *restrict blue = band->offset[2] + first;
    for (int32_t i = 0; i < samples; i++) {
        float u = wide ? ((const uint16_t *)cb)[i] : ((const uint8_t *)cb)[i];
        float v = wide ? ((const uint16_t *)cr)[i] : ((const uint8_t *)cr)[i];
        u = (u - neutral) * scale, v = (v - neutral) * scale;
        float r = m1 * u + m2 * v, g = m4 * u + m5 * v, b = m7 * u + m8 * v;
        for (int j = 0; j < across; j++)
            red[across * i + j] = r, green[across * i + j] = g, blue[across * i + j] = b;
    }
}

/* What chroma adds to luma at the pixels of some samples. */
static HOT void read_chroma(const struct band *band, const uint8_t *cb, const uint8_t *cr, int32_t sample,
                            int32_t first, int32_t samples)
{
    size_t at = (size_t)sample * (band->layout->wide ? 2 : 1);
    if (band->layout->wide)
        offset_pixels(band, cb + at, cr + at, 1, band->d->across, first, samples);
    else if (band->d->across == 2)
        offset_pixels(band, cb + at, cr + at, 0, 2, first, samples);
    else
        offset_pixels(band, cb + at, cr + at, 0, 1, first, samples);
}

/* A transfer curve, as above. */
struct power { float toe, lowered, bend, limit, per_limit; };

INLINE struct power power_of(const struct dimming *d)
{
    float limit = d->toe + d->lowered;
    return (struct power){d->toe, d->lowered, d->bend, limit, 1.0f / limit};
}

/* A colour's encoded value with a share of its light. */
INLINE float dimmed(float encoded, float k, struct power c)
{
    float raised = encoded + c.lowered, bright = k * raised;
    float u = k * (raised > c.limit ? raised : c.limit) * c.per_limit;
    float dark = (encoded < c.toe ? encoded : c.toe) * u * u * (1.0f - c.bend + c.bend * u);
    return bright >= c.limit ? bright - c.lowered : dark;
}

/* A row of luma, or of red where planes are red, green and blue; what its pixels make of the other two is added up. */
INLINE void dim_codes(const struct band *band, void *restrict row, int wide, int32_t first, int32_t count)
{
    const struct layout *l = band->layout;
    const float *m = l->rgb_from_ycc, *w = l->ycc_from_rgb;
    const float *restrict kr = band->factor[0] + first, *restrict kg = band->factor[1] + first;
    const float *restrict kb = band->factor[2] + first, *restrict red = band->offset[0] + first;
    const float *restrict green = band->offset[1] + first, *restrict blue = band->offset[2] + first;
    float *restrict cb = band->sum[0] + first, *restrict cr = band->sum[1] + first;
    struct power c = power_of(band->d);
    float zero = l->black, span = l->luma_span, top = l->top, scale = 1.0f / span, m0 = m[0], m3 = m[3], m6 = m[6];
    float w0 = w[0], w1 = w[1], w2 = w[2], w3 = w[3], w4 = w[4], w5 = w[5], w6 = w[6], w7 = w[7], w8 = w[8];
#pragma GCC ivdep
    for (int32_t i = 0; i < count; i++) {
        float code = wide ? ((uint16_t *)row)[i] : ((uint8_t *)row)[i], y = (code - zero) * scale;
        float r = dimmed(m0 * y + red[i], kr[i], c), g = dimmed(m3 * y + green[i], kg[i], c);
        float b = dimmed(m6 * y + blue[i], kb[i], c);
        int32_t found = nearest_code(w0 * r + w1 * g + w2 * b, zero, span, top);
        cb[i] += w3 * r + w4 * g + w5 * b;
        cr[i] += w6 * r + w7 * g + w8 * b;
        if (wide)
            ((uint16_t *)row)[i] = (uint16_t)found;
        else
            ((uint8_t *)row)[i] = (uint8_t)found;
    }
}

static HOT void dim_row(const struct band *band, uint8_t *row, int32_t column, struct run pixels)
{
    int32_t count = pixels.end - pixels.first;
    if (band->layout->wide)
        dim_codes(band, (uint16_t *)row + column, 1, pixels.first, count);
    else
        dim_codes(band, row + column, 0, pixels.first, count);
}

/* A row of chroma from its pixels' sum, `share` of it. */
INLINE void write_codes(const struct layout *l, const float *restrict sum, void *restrict row, int wide, int across,
                        float share, int32_t samples)
{
    for (int32_t i = 0; i < samples; i++) {
        float value = across == 2 ? sum[2 * i] + sum[2 * i + 1] : sum[i];
        int32_t found = nearest_code(share * value, l->neutral, l->chroma_span, l->top);
        if (wide)
            ((uint16_t *)row)[i] = (uint16_t)found;
        else
            ((uint8_t *)row)[i] = (uint8_t)found;
    }
}

static HOT void write_chroma(const struct band *band, int which, uint8_t *row, int32_t sample, float share,
                             int32_t first, int32_t samples)
{
    const struct layout *l = band->layout;
    const float *sum = band->sum[which] + first;
    if (l->wide)
        write_codes(l, sum, (uint16_t *)row + sample, 1, band->d->across, share, samples);
    else if (band->d->across == 2)
        write_codes(l, sum, row + sample, 0, 2, share, samples);
    else
        write_codes(l, sum, row + sample, 0, 1, share, samples);
}

/* The rows from y on that share a row of chroma samples, `pixels` of the region. */
static void dim_band(struct band *band, const struct picture *to, int32_t y, struct run nodes, struct run pixels,
                     const float *above, const float *below, float *between)
{
    const struct dimming *d = band->d;
    int32_t column = d->box.x0 + pixels.first, sample = column / d->across, r = y / d->down;
    int32_t rows = d->box.y1 - y < d->down ? d->box.y1 - y : d->down, width = pixels.end - pixels.first;
    int32_t samples = (width + d->across - 1) / d->across;
    uint8_t *cb = row_of(to, 1, r), *cr = row_of(to, 2, r);
    read_chroma(band, cb, cr, sample, pixels.first, samples);
    for (int k = 0; k < 2; k++)
        memset(band->sum[k] + pixels.first, 0, (size_t)width * sizeof(float));
    for (int32_t i = 0; i < rows; i++) {
        float share = (float)((y + i - d->box.y0) % NODE) / NODE;
        for (int k = 0; k < 3; k++) {
            mix_nodes(above + k * d->columns, below + k * d->columns, share, d->columns, between + k * d->columns);
            spread_nodes(between + k * d->columns, nodes.first, nodes.end, band->factor[k]);
        }
        dim_row(band, row_of(to, 0, y + i), column, pixels);
    }
    for (int k = 0; k < 2; k++) {
        /* the last sample of a row may have no second pixel */
        band->sum[k][pixels.end] = band->sum[k][pixels.end - 1];
        write_chroma(band, k, k == 0 ? cb : cr, sample, 1.0f / (float)(rows * d->across), pixels.first, samples);
    }
}

/* Dims a picture in place. */
EXPORT void dim_picture(const struct layout *layout, const struct picture *to, const struct dimming *d)
{
    int32_t width = d->box.x1 - d->box.x0, line = NODE * d->columns;
    float *above = d->scratch, *below = above + 3 * d->columns, *between = below + 3 * d->columns;
    float *lines = between + 3 * d->columns;
    struct band band = {.layout = layout, .d = d};
    struct run nodes = {0, 0};
    for (int k = 0; k < 3; k++)
        band.factor[k] = lines + k * line, band.offset[k] = lines + (FACTORS + k) * line;
    for (int k = 0; k < 2; k++)
        band.sum[k] = lines + (FACTORS + OFFSETS + k) * line;
    encode_node_row(layout, d, 0, below);
    for (int32_t y = d->box.y0; y < d->box.y1; y += d->down) {
        if ((y - d->box.y0) % NODE == 0) {
            float *used = above;
            above = below, below = used;
            encode_node_row(layout, d, (y - d->box.y0) / NODE + 1, below);
            nodes = dimmed_nodes(d, above, below, between);
            /* from the last node that takes nothing to the first one that does not again */
            nodes.first = nodes.first > 0 ? nodes.first - 1 : 0;
            nodes.end = nodes.end < d->columns ? nodes.end : d->columns - 1;
        }
        struct run pixels = {NODE * nodes.first, NODE * nodes.end < width ? NODE * nodes.end : width};
        if (pixels.first < pixels.end)
            dim_band(&band, to, y, nodes, pixels, above, below, between);
    }
}
