/* The samples of a picture: what is nearest at each, drawn eight side by side. */
#ifndef ARLIGHT_SAMPLES_H
#define ARLIGHT_SAMPLES_H

#include "eight.h"

enum { SIDE_BY_SIDE = 8 };

typedef struct {
    float *nearness; /* (height * width + SIDE_BY_SIDE) 1 / depth of what is drawn, 0 where nothing is */
    float *radiance; /* (3, plane) of it; means nothing where nothing is drawn */
    int64_t plane;   /* height * width + SIDE_BY_SIDE at least: what is drawn may be written beyond the last sample */
    int64_t width, height;
} Samples;

/* Where `seen` the value replaces what is there. */
INLINE void put_where(EightBits seen, Eight value, float *there)
{
    EightThere *eight = (EightThere *)there;
    *eight = (Eight)((seen & (EightBits)value) | (~seen & (EightBits)*eight));
}

/* Eight samples: where `outside` is not negative, no, is a bit pattern without sign, and the value is nearer than what
   is there, it replaces it. `value` is radiance / depth, and 1 / depth. */
INLINE void put(const Samples *s, int64_t at, EightBits outside, const Eight value[4])
{
    Eight before = *(const EightThere *)(s->nearness + at);
    EightBits seen = (~outside & (EightBits)(before - value[3])) >> 31;
    Eight depth = 1.0f / value[3];
    put_where(seen, value[3], s->nearness + at);
    for (int c = 0; c < 3; c++)
        put_where(seen, value[c] * depth, s->radiance + c * s->plane + at);
}

/* The mean of each pixel's `side` by `side` samples: radiance times coverage, and coverage, (rows, columns, 4). */
INLINE void mean_of_samples(const Samples *s, int64_t side, float *restrict drawn)
{
    int64_t columns = s->width / side;
    const float *nearness = s->nearness, *red = s->radiance, *green = red + s->plane, *blue = green + s->plane;
    float share = 1.0f / (float)(side * side);
    for (int64_t row = 0; row < s->height / side; row++, drawn += 4 * columns)
        for (int64_t column = 0; column < columns; column++) {
            float r = 0.0f, g = 0.0f, b = 0.0f, covered = 0.0f;
            for (int64_t i = 0; i < side; i++)
                for (int64_t j = 0; j < side; j++) {
                    int64_t at = (row * side + i) * s->width + column * side + j;
                    float ar = red[at], ag = green[at], ab = blue[at];
                    int drawn_there = nearness[at] > 0.0f;
                    r += drawn_there ? ar : 0.0f, g += drawn_there ? ag : 0.0f, b += drawn_there ? ab : 0.0f;
                    covered += drawn_there ? 1.0f : 0.0f;
                }
            float *pixel = drawn + 4 * column;
            pixel[0] = r * share, pixel[1] = g * share, pixel[2] = b * share, pixel[3] = covered * share;
        }
}

#endif
