/* Looks up a stack of pictures, each with its halves, quarters and so on. */
#ifndef ARLIGHT_TEXTURE_H
#define ARLIGHT_TEXTURE_H

#include "native.h"

typedef struct {
    const uint8_t *levels; /* each (layers, height >> level, width >> level, 3), at least 1 pixel; row 0 is v = 0 */
    const float *linear;   /* (256,) linear light of each code */
    int64_t layers, width, height, level_count;
} Texture;

/* One level of one layer. */
typedef struct {
    const uint8_t *pixels;
    int width, height;
} Picture;

/* The level whose pixels are about as large as a sample, of which `pixels` of the finest lie in one by area. */
INLINE Picture picture_for(const Texture *texture, int layer, float pixels)
{
    const uint8_t *start = texture->levels;
    int64_t width = texture->width, height = texture->height;
    for (int64_t level = 1; level < texture->level_count && pixels > 2.0f; level++) {
        start += texture->layers * width * height * 3;
        width = width > 1 ? width / 2 : 1, height = height > 1 ? height / 2 : 1;
        pixels *= 0.25f;
    }
    int64_t within = layer < 0 ? 0 : layer < texture->layers ? layer : texture->layers - 1;
    return (Picture){start + within * width * height * 3, (int)width, (int)height};
}

/* Pixel and share of the next one at a place along a side, the picture being repeated. */
INLINE void neighbours(float place, int size, int *first, int *second, float *share)
{
    float at = (place - floorf(place)) * (float)size - 0.5f, before = floorf(at);
    int index = before >= 0.0f && before < (float)size ? (int)before : size - 1;
    *first = index, *second = index + 1 < size ? index + 1 : 0;
    *share = at - before;
}

/* Linear colour at texture coordinates, bilinear. */
INLINE void look_up(const Texture *texture, const Picture *picture, float u, float v, float colour[3])
{
    int left, right, below, above;
    float across, up;
    neighbours(u, picture->width, &left, &right, &across);
    neighbours(v, picture->height, &below, &above, &up);
    const uint8_t *low = picture->pixels + 3 * (int64_t)below * picture->width;
    const uint8_t *high = picture->pixels + 3 * (int64_t)above * picture->width;
    for (int c = 0; c < 3; c++) {
        const float *linear = texture->linear;
        float lower = linear[low[3 * left + c]] * (1.0f - across) + linear[low[3 * right + c]] * across;
        float upper = linear[high[3 * left + c]] * (1.0f - across) + linear[high[3 * right + c]] * across;
        colour[c] = lower * (1.0f - up) + upper * up;
    }
}

#endif
