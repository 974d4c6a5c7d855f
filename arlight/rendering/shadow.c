/* The share of its irradiance that an object leaves to each texel of the plane. */
#include "native.h"
#include "bounded.h"

static inline float left_over(float hidden, float open)
{
    /* the reconstructed radiance may dip below 0 somewhere, which would brighten the plane */
    return open > 0.0f ? lesser(greater(1.0f - hidden / open, 0.0f), 1.0f) : 1.0f;
}

/* ratio (count, 4) of three colours, the fourth the least of them; from what is hidden, (3, stride), of `open`. */
EXPORT HOT void irradiance_ratio(
    const float *hidden, int64_t stride, const float *open, int64_t count, float *ratio)
{
    float red = open[0], green = open[1], blue = open[2];
    for (int64_t i = 0; i < count; i++) {
        float r = left_over(hidden[i], red), g = left_over(hidden[stride + i], green);
        float b = left_over(hidden[2 * stride + i], blue);
        ratio[4 * i] = r, ratio[4 * i + 1] = g, ratio[4 * i + 2] = b;
        ratio[4 * i + 3] = lesser(lesser(r, g), b);
    }
}

/* Lets darkening, of the colour that is darkened most, fade from twice `faint` down to nothing at `faint`. */
EXPORT HOT void drop_faint(float *ratio, int64_t count, float faint)
{
    for (int64_t i = 0; i < 4 * count; i += 4) {
        float darkening = 1.0f - ratio[i + 3], kept = lesser(greater(darkening / faint - 1.0f, 0.0f), 1.0f);
        for (int64_t k = 0; k < 4; k++)
            ratio[i + k] = 1.0f - kept * (1.0f - ratio[i + k]);
    }
}

/* First and last column and row, (4,), of the texels whose ratio is below a limit; if none is, last before first. */
EXPORT void dark_box(const float *ratio, int64_t side, double limit, int64_t *box)
{
    box[0] = box[2] = side, box[1] = box[3] = -1;
    for (int64_t row = 0; row < side; row++)
        for (int64_t column = 0; column < side; column++)
            if (ratio[4 * (row * side + column) + 3] < limit) {
                box[0] = column < box[0] ? column : box[0], box[1] = column > box[1] ? column : box[1];
                box[2] = row < box[2] ? row : box[2], box[3] = row;
            }
}
