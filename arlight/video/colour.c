/* Reads regions of a picture as R'G'B', as linear light, or as luma. */
#include "rows.h"

/* Lines of scratch memory for reading colour, and floats that each is longer than the region is wide. */
EXPORT const int32_t reading_lines = ROW_LINES, line_margin = LINE_MARGIN;

static HOT void interleave(const float *restrict red, const float *restrict green, const float *restrict blue,
                           int32_t count, float *restrict out)
{
    for (int32_t i = 0; i < count; i++) {
        out[3 * i] = red[i];
        out[3 * i + 1] = green[i];
        out[3 * i + 2] = blue[i];
    }
}

/* A region of colour (h, w, 3) through a curve; see `reading_lines` for the scratch memory. */
EXPORT void read_colour(const struct layout *layout, const struct picture *picture, const struct box *box,
                        int32_t guided, const struct curve *curve, float *scratch, float *out)
{
    struct rows rows;
    int32_t width = box->x1 - box->x0;
    rows_begin(&rows, layout, picture, *box, guided, scratch);
    for (int32_t y = box->y0; y < box->y1; y++, out += 3 * width) {
        rows_read(&rows, y, box->x0, box->x1);
        rows_colour(&rows, *curve, box->x0, box->x1);
        interleave(rows.rgb[0], rows.rgb[1], rows.rgb[2], width, out);
    }
}

static HOT void values_through(struct curve curve, int32_t count, float *restrict values)
{
    for (int32_t i = 0; i < count; i++)
        values[i] = through(curve, values[i]);
}

/* A region (h, w) of the first plane through a curve. */
EXPORT void read_luma(const struct layout *layout, const struct picture *picture, const struct box *box,
                      const struct curve *curve, float *out)
{
    int32_t width = box->x1 - box->x0;
    for (int32_t y = box->y0; y < box->y1; y++, out += width) {
        read_codes(row_of(picture, 0, y), layout->wide, box->x0, width, layout->black, 1.0f / layout->luma_span, out);
        values_through(*curve, width, out);
    }
}

static HOT void to_bytes(const float *restrict values, int32_t count, uint8_t *restrict out)
{
    for (int32_t i = 0; i < count; i++)
        out[i] = (uint8_t)nearest_code(values[i], 0.0f, 255.0f, 255.0f);
}

/* The weighted sum of `planes` planes as bytes (h, w), 0 black and 255 white; scratch: 2 lines of the width. */
EXPORT void read_bytes(const struct layout *layout, const struct picture *picture, int32_t planes,
                       const float *weights, int32_t width, int32_t height, float *scratch, uint8_t *out)
{
    float *sum = scratch, *line = scratch + width;
    for (int32_t y = 0; y < height; y++, out += width) {
        memset(sum, 0, (size_t)width * sizeof(float));
        for (int32_t k = 0; k < planes; k++) {
            read_codes(row_of(picture, k, y), layout->wide, 0, width, layout->black, 1.0f / layout->luma_span, line);
            add_line(sum, line, weights[k], width);
        }
        to_bytes(sum, width, out);
    }
}
