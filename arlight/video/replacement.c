/* Writes new light into a region of a picture, and pictures in another format; chroma is averaged as it was read. */
#include "averaging.h"
#include "rows.h"

/* Linear light within this of what a pixel had is no change: a thirtieth of an 8-bit level in the dark. */
#define UNCHANGED 1e-5f

/* Lines of scratch memory for writing colour. */
EXPORT const int32_t writing_lines = ROW_LINES + AVERAGING_LINES;

/* Which pixels of a row get light that differs from what they had. */
static HOT void compare(const float *restrict linear, const float *restrict red, const float *restrict green,
                        const float *restrict blue, int32_t count, float *restrict changed)
{
    for (int32_t i = 0; i < count; i++) {
        float r = fabsf(linear[3 * i] - red[i]), g = fabsf(linear[3 * i + 1] - green[i]);
        float b = fabsf(linear[3 * i + 2] - blue[i]), most = r > g ? r : g;
        most = most > b ? most : b;
        /* a pixel with what is no number stays as it is: its sum is none either */
        changed[i] = (float)((most > UNCHANGED) & (r + g + b >= 0.0f));
    }
}

/* Where one channel of linear light lies in the curve over its square root; the root of what is negative is no number,
   and taken for 0. */
static HOT void locate_root(struct curve curve, const float *restrict linear, int32_t count, int32_t *restrict step,
                            float *restrict share)
{
    for (int32_t i = 0; i < count; i++) {
        float x = sqrtf(linear[3 * i]) * curve.last;
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

/* Adds to new chroma what upsampling left unexplained of a sample, its code against the mean of its own pixels, in the
   share of pixels that did not change. */
static HOT void keep_unexplained(float *restrict value, const float *restrict stored, const float *restrict old,
                                 const float *restrict share, int32_t count)
{
    for (int32_t i = 0; i < count; i++)
        value[i] += (1.0f - share[i]) * (stored[i] - old[i]);
}

/* Writes the chroma rows that are complete once row y is there. */
static void write_chroma(struct averaging *work, const struct layout *layout, const struct picture *to, int32_t y)
{
    for (int32_t r; (r = averaging_next(work, y)) >= 0;) {
        average_rows(work, r, CHANGED);
        for (int k = 0; k < 2; k++) {
            uint8_t *row = row_of(to, k + 1, r);
            float *stored = work->sums[0], *value = work->means[NEW_CB + k];
            read_codes(row, layout->wide, work->first, work->count, layout->neutral, 1.0f / layout->chroma_span,
                       stored);
            keep_unexplained(value, stored, work->means[OLD_CB + k], work->means[CHANGED], work->count);
            write_changed(row, layout->wide, work->first, value, work->means[CHANGED], work->count, layout->neutral,
                          layout->chroma_span, layout->top);
        }
    }
}

/* Finds where a row gets new light, writes its luma there and keeps its chroma. */
static void replace_row(struct rows *rows, const struct picture *to, int32_t y, struct box box, const float *linear,
                        float *const *kept, float *luma)
{
    const struct layout *layout = rows->layout;
    int32_t left = box.x0 - rows->box.x0, end = box.x1 - box.x0, first = 0;
    float *changed = kept[CHANGED] + left;
    rows_colour(rows, layout->decode, left, end);
    compare(linear, rows->rgb[0], rows->rgb[1], rows->rgb[2], end, changed);
    while (first < end && changed[first] == 0.0f)
        first++;
    while (end > first && changed[end - 1] == 0.0f)
        end--;
    for (int k = 0; k < 3; k++) {
        locate_root(layout->encode, linear + 3 * first + k, end - first, rows->step, rows->share);
        look_up(layout->encode, rows->step, rows->share, end - first, rows->rgb[k]);
    }
    recode(layout->ycc_from_rgb, rows->rgb, changed + first, end - first, luma, kept[NEW_CB] + left + first,
           kept[NEW_CR] + left + first);
    write_changed(row_of(to, 0, y), layout->wide, box.x0 + first, luma, changed + first, end - first, layout->black,
                  layout->luma_span, layout->top);
}

/* Puts new linear light (h, w, 3) into a region of `to`, a copy of `from`, where it differs from what is there.
   `around` is the region with the pixels that share a chroma sample with it. */
EXPORT void replace_colour(const struct layout *layout, const struct picture *from, const struct picture *to,
                           const struct box *box, const struct box *around, const float *linear, float *scratch)
{
    struct rows rows;
    struct averaging work;
    int32_t width = around->x1 - around->x0;
    rows_begin(&rows, layout, from, *around, 1, scratch);
    averaging_begin(&work, layout, *around, scratch + ROW_LINES * (width + LINE_MARGIN));
    for (int32_t y = around->y0; y < around->y1; y++) {
        float **kept = work.kept[y % KEPT];
        rows_read(&rows, y);
        memset(kept[CHANGED], 0, (size_t)width * sizeof(float));
        for (int k = 0; k < 2; k++) {
            memcpy(kept[OLD_CB + k], rows.ycc[k + 1], (size_t)width * sizeof(float));
            memcpy(kept[NEW_CB + k], rows.ycc[k + 1], (size_t)width * sizeof(float));
        }
        if (y >= box->y0 && y < box->y1)
            replace_row(&rows, to, y, *box, linear + (ptrdiff_t)(y - box->y0) * 3 * (box->x1 - box->x0), kept,
                        work.sums[0]);
        write_chroma(&work, layout, to, y);
    }
}

/* Multiplies every pixel of a row by a matrix. */
static HOT void recombine(const float *matrix, float *const *ycc, int32_t count, float *restrict luma,
                          float *restrict cb, float *restrict cr)
{
    const float *y = ycc[0], *u = ycc[1], *v = ycc[2];
    for (int32_t i = 0; i < count; i++) {
        luma[i] = product(matrix, 0, y[i], u[i], v[i]);
        cb[i] = product(matrix, 1, y[i], u[i], v[i]);
        cr[i] = product(matrix, 2, y[i], u[i], v[i]);
    }
}

/* A whole picture in another layout. `matrix` (3, 3) leads from one Y'CbCr to the other; `all` is 1 for every pixel of
   a line. */
EXPORT void convert_colour(const struct layout *layout, const struct picture *from, const struct layout *target,
                           const struct picture *to, const struct box *whole, int32_t guided, const float *matrix,
                           const float *all, float *scratch)
{
    struct rows rows;
    struct averaging work;
    int32_t width = whole->x1;
    rows_begin(&rows, layout, from, *whole, guided, scratch);
    averaging_begin(&work, target, *whole, scratch + ROW_LINES * (width + LINE_MARGIN));
    for (int32_t y = 0; y < whole->y1; y++) {
        float **kept = work.kept[y % KEPT], *luma = work.sums[0];
        rows_read(&rows, y);
        recombine(matrix, rows.ycc, width, luma, kept[NEW_CB], kept[NEW_CR]);
        write_changed(row_of(to, 0, y), target->wide, 0, luma, all, width, target->black, target->luma_span,
                      target->top);
        for (int32_t r; (r = averaging_next(&work, y)) >= 0;) {
            average_rows(&work, r, NEW_CB);
            for (int k = 0; k < 2; k++)
                write_changed(row_of(to, k + 1, r), target->wide, 0, work.means[NEW_CB + k], all, work.count,
                              target->neutral, target->chroma_span, target->top);
        }
    }
}
