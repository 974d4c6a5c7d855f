/* Covers a region of a picture with a layer of light. Only the pixels that this changes, and those that share chroma
   with them, are read and written. */
#include "averaging.h"
#include "rows.h"

/* Linear light within this of what a pixel had is no change: a thirtieth of an 8-bit level in the dark. */
#define UNCHANGED 1e-5f
/* Pixels that are looked at together. */
#define BLOCK 16
/* Lines of new light: red, green, blue, and its luma. */
#define LIGHT_LINES 4

/* Lines of scratch memory. */
EXPORT const int32_t composing_lines = ROW_LINES + AVERAGING_LINES + LIGHT_LINES;

struct span { int32_t x0, x1; };

/* New light of a region of the picture. */
struct layer {
    const float *over;          /* (h, w, 4) light times coverage, and coverage */
    struct box box;
};

/* What a composition works with. */
struct composition {
    const struct layer *layer;
    const struct picture *to;
    struct rows rows;           /* of the region around: the pixels that share chroma with it included */
    struct averaging averaging;
    struct span *changed;       /* (rows of the region around) pixels that the layer may change */
    float *light[3], *luma;     /* (width of the region around) */
};

/* Whether anything is covered among `count` pixels. */
static HOT int covers(const float *over, int32_t count)
{
    float most = 0.0f;
    for (int32_t i = 0; i < count; i++)
        most = over[4 * i + 3] > most ? over[4 * i + 3] : most;
    return most > 0.0f;
}

static inline struct span joined(struct span a, struct span b)
{
    return (struct span){a.x0 < b.x0 ? a.x0 : b.x0, a.x1 > b.x1 ? a.x1 : b.x1};
}

/* The pixels of a row, in whole blocks, that the layer may change; empty where its end is not beyond its first. */
static struct span changed_span(const struct layer *layer, int32_t y)
{
    struct box box = layer->box;
    int32_t width = box.x1 - box.x0, first = 0, end = width;
    if (y < box.y0 || y >= box.y1)
        return (struct span){box.x1, box.x0};
    const float *line = layer->over + (ptrdiff_t)(y - box.y0) * 4 * width;
    while (first < end && !covers(line + 4 * first, end - first < BLOCK ? end - first : BLOCK))
        first += BLOCK;
    while (end > first && !covers(line + 4 * (end - first < BLOCK ? first : end - BLOCK),
                                  end - first < BLOCK ? end - first : BLOCK))
        end -= BLOCK;
    return first < end ? (struct span){box.x0 + first, box.x0 + end} : (struct span){box.x1, box.x0};
}

/* The changed pixels of the rows first <= y < end together, those that lie in the region around. */
static struct span changed_in_rows(const struct composition *work, int32_t first, int32_t end)
{
    struct box around = work->rows.box;
    struct span span = {around.x1, around.x0};
    first = first > around.y0 ? first : around.y0;
    for (int32_t y = first; y < end && y < around.y1; y++)
        span = joined(span, work->changed[y - around.y0]);
    return span;
}

/* Covers light with a layer. */
static HOT void cover(const float *restrict over, int32_t count, float *restrict red, float *restrict green,
                      float *restrict blue, float *restrict changed)
{
    for (int32_t i = 0; i < count; i++) {
        float coverage = over[4 * i + 3], left = 1.0f - coverage;
        float r = red[i] * left + over[4 * i], g = green[i] * left + over[4 * i + 1];
        float b = blue[i] * left + over[4 * i + 2];
        red[i] = coverage > 0.0f ? r : red[i];
        green[i] = coverage > 0.0f ? g : green[i];
        blue[i] = coverage > 0.0f ? b : blue[i];
        changed[i] = coverage > 0.0f ? 1.0f : changed[i];
    }
}

/* Takes back the mark of pixels whose light is the same as before, or no number. */
static HOT void confirm(float *const *old, float *const *light, int32_t count, float *restrict changed)
{
    const float *red = old[0], *green = old[1], *blue = old[2], *x = light[0], *y = light[1], *z = light[2];
    for (int32_t i = 0; i < count; i++) {
        float r = fabsf(x[i] - red[i]), g = fabsf(y[i] - green[i]), b = fabsf(z[i] - blue[i]);
        float most = r > g ? r : g;
        most = most > b ? most : b;
        /* with what is no number, the sum is none either */
        changed[i] *= (float)((most > UNCHANGED) & (r + g + b >= 0.0f));
    }
}

/* Where light lies in the curve over its square root; the root of what is negative is no number, and taken for 0. */
static HOT void locate_root(struct curve curve, const float *restrict light, int32_t count, int32_t *restrict step,
                            float *restrict share)
{
    for (int32_t i = 0; i < count; i++) {
        float x = sqrtf(light[i]) * curve.last;
        x = x > 0.0f ? x : 0.0f;
        x = x < curve.last ? x : curve.last;
        step[i] = (int32_t)x;
        share[i] = x - (float)step[i];
    }
}

/* R'G'B' as Y'CbCr, chroma only where it changed. */
static HOT void recode(const float *matrix, float *const *rgb, const float *restrict changed, int32_t count,
                       float *restrict luma, float *restrict cb, float *restrict cr)
{
    const float *red = rgb[0], *green = rgb[1], *blue = rgb[2];
    for (int32_t i = 0; i < count; i++) {
        float u = product(matrix, 1, red[i], green[i], blue[i]), v = product(matrix, 2, red[i], green[i], blue[i]);
        luma[i] = product(matrix, 0, red[i], green[i], blue[i]);
        cb[i] = changed[i] > 0.0f ? u : cb[i];
        cr[i] = changed[i] > 0.0f ? v : cr[i];
    }
}

/* New light of a span of a row, and which pixels change. */
static void light_span(struct composition *work, int32_t y, struct span span, float *changed)
{
    struct box box = work->layer->box;
    int32_t at = span.x0 - work->rows.box.x0, width = span.x1 - span.x0;
    float *old[3], *light[3];
    for (int k = 0; k < 3; k++) {
        old[k] = work->rows.rgb[k] + at;
        light[k] = work->light[k] + at;
        memcpy(light[k], old[k], (size_t)width * sizeof(float));
    }
    const float *over = work->layer->over + 4 * ((ptrdiff_t)(y - box.y0) * (box.x1 - box.x0) + span.x0 - box.x0);
    cover(over, width, light[0], light[1], light[2], changed);
    confirm(old, light, width, changed);
}

/* Reads the pixels x0 <= x < x1 of a row, changes those of its span and keeps the chroma of all. */
static void compose_row(struct composition *work, int32_t y, int32_t x0, int32_t x1)
{
    struct rows *rows = &work->rows;
    const struct layout *layout = rows->layout;
    struct span span = work->changed[y - rows->box.y0];
    float **kept = work->averaging.kept[y % KEPT];
    int32_t at = x0 - rows->box.x0, from = span.x0 - rows->box.x0, width = span.x1 - span.x0;
    size_t size = (size_t)(x1 - x0) * sizeof(float);
    rows->ycc[1] = kept[OLD_CB], rows->ycc[2] = kept[OLD_CR];
    rows_read(rows, y, x0, x1);
    memset(kept[CHANGED] + at, 0, size);
    memcpy(kept[NEW_CB] + at, kept[OLD_CB] + at, size);
    memcpy(kept[NEW_CR] + at, kept[OLD_CR] + at, size);
    if (width <= 0)
        return;
    rows_colour(rows, layout->decode, span.x0, span.x1);
    light_span(work, y, span, kept[CHANGED] + from);
    float *encoded[3];
    for (int k = 0; k < 3; k++) {
        encoded[k] = rows->rgb[k] + from;
        locate_root(layout->encode, work->light[k] + from, width, rows->step, rows->share);
        look_up(layout->encode, rows->step, rows->share, width, encoded[k]);
    }
    recode(layout->ycc_from_rgb, encoded, kept[CHANGED] + from, width, work->luma, kept[NEW_CB] + from,
           kept[NEW_CR] + from);
    write_changed(row_of(work->to, 0, y), layout->wide, span.x0, work->luma, kept[CHANGED] + from, width,
                  layout->black, layout->luma_span, layout->top);
}

/* Adds to new chroma what upsampling left unexplained of a sample, its code against the mean of its own pixels, in the
   share of pixels that did not change. */
static HOT void keep_unexplained(float *restrict value, const float *restrict stored, const float *restrict old,
                                 const float *restrict share, int32_t count)
{
    for (int32_t i = 0; i < count; i++)
        value[i] += (1.0f - share[i]) * (stored[i] - old[i]);
}

/* Writes a chroma row where pixels that it averages changed. */
static void write_chroma(struct composition *work, int32_t r)
{
    const struct layout *layout = work->rows.layout;
    const struct axis *columns = &layout->columns, *rows = &layout->rows;
    struct averaging *averaging = &work->averaging;
    struct span span = changed_in_rows(work, rows->tapped[r], rows->tapped[(rows->taps - 1) * rows->samples + r] + 1);
    if (span.x0 >= span.x1)
        return;
    int32_t first = clamped(columns->lower[span.x0], averaging->first, averaging->end);
    int32_t end = clamped(columns->upper[span.x1 - 1] + 1, first, averaging->end);
    if (first == end)
        return;
    average_rows(averaging, r, CHANGED, first, end);
    for (int k = 0; k < 2; k++) {
        uint8_t *row = row_of(work->to, k + 1, r);
        float *stored = averaging->sums[0], *value = averaging->means[NEW_CB + k];
        read_codes(row, layout->wide, first, end - first, layout->neutral, 1.0f / layout->chroma_span, stored);
        keep_unexplained(value, stored, averaging->means[OLD_CB + k], averaging->means[CHANGED], end - first);
        write_changed(row, layout->wide, first, value, averaging->means[CHANGED], end - first, layout->neutral,
                      layout->chroma_span, layout->top);
    }
}

/* Sets a layer into `to`, a copy of `from`. `around` is its box with the pixels that share a chroma sample with it,
   `changed` has room for a span a row of it. */
EXPORT void cover_picture(const struct layout *layout, const struct picture *from, const struct picture *to,
                          const struct layer *layer, const struct box *around, struct span *changed, float *scratch)
{
    struct composition work = {.layer = layer, .to = to, .changed = changed};
    int32_t line = around->x1 - around->x0 + LINE_MARGIN;
    int32_t wide = 2 * layout->columns.share, high = 2 * layout->rows.share;
    rows_begin(&work.rows, layout, from, *around, 1, scratch);
    averaging_begin(&work.averaging, layout, *around, scratch + ROW_LINES * line);
    work.luma = scratch + (ROW_LINES + AVERAGING_LINES) * line;
    for (int k = 0; k < 3; k++)
        work.light[k] = work.luma + (k + 1) * line;
    for (int32_t y = around->y0; y < around->y1; y++)
        changed[y - around->y0] = changed_span(layer, y);
    for (int32_t y = around->y0; y < around->y1; y++) {
        struct span span = changed_in_rows(&work, y - high, y + high + 1);
        if (span.x0 < span.x1)
            compose_row(&work, y, clamped(span.x0 - wide, around->x0, around->x1),
                        clamped(span.x1 + wide, around->x0, around->x1));
        for (int32_t r; (r = averaging_next(&work.averaging, y)) >= 0;)
            write_chroma(&work, r);
    }
}
