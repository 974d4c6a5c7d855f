/* A whole picture in another format. */
#include "averaging.h"
#include "rows.h"

/* Lines of scratch memory, see `averaging_begin`. */
EXPORT const int32_t resampling_lines = ROW_LINES + AVERAGING_LINES;

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
    int32_t width = whole->x1, samples = target->columns.samples;
    rows_begin(&rows, layout, from, *whole, guided, scratch);
    averaging_begin(&work, target, *whole, scratch + ROW_LINES * (width + LINE_MARGIN));
    for (int32_t y = 0; y < whole->y1; y++) {
        float **kept = work.kept[y % KEPT], *luma = work.sums[0];
        rows_read(&rows, y, 0, width);
        recombine(matrix, rows.ycc, width, luma, kept[NEW_CB], kept[NEW_CR]);
        write_changed(row_of(to, 0, y), target->wide, 0, luma, all, width, target->black, target->luma_span,
                      target->top);
        for (int32_t r; (r = averaging_next(&work, y)) >= 0;) {
            average_rows(&work, r, NEW_CB, 0, samples);
            for (int k = 0; k < 2; k++)
                write_changed(row_of(to, k + 1, r), target->wide, 0, work.means[NEW_CB + k], all, samples,
                              target->neutral, target->chroma_span, target->top);
        }
    }
}
