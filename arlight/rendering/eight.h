/* Eight numbers side by side, and pixels of four: red, green, blue and one more. */
#ifndef ARLIGHT_EIGHT_H
#define ARLIGHT_EIGHT_H

#include "native.h"

typedef float Eight __attribute__((vector_size(32)));
typedef int32_t EightBits __attribute__((vector_size(32)));
typedef float EightThere __attribute__((vector_size(32), aligned(4), may_alias)); /* wherever in memory it begins */
typedef int32_t EightBitsThere __attribute__((vector_size(32), aligned(4), may_alias));
typedef float Four __attribute__((vector_size(16), aligned(4), may_alias));
typedef int32_t FourBits __attribute__((vector_size(16)));

static const EightBits COLUMN = {0, 1, 2, 3, 4, 5, 6, 7};

INLINE Eight all(float value) { return value + (Eight){0.0f}; }

INLINE int any(EightBits bits)
{
    typedef int64_t Four64 __attribute__((vector_size(32)));
    Four64 four = (Four64)bits;
    return (four[0] | four[1] | four[2] | four[3]) != 0;
}

/* Eight pixels, each colour side by side, into every `apart`-th place. */
INLINE void store_pixels(Eight red, Eight green, Eight blue, Eight other, Four *pixels, int apart)
{
    const EightBits lows = {0, 8, 1, 9, 4, 12, 5, 13}, highs = {2, 10, 3, 11, 6, 14, 7, 15};
    const EightBits first = {0, 1, 8, 9, 4, 5, 12, 13}, second = {2, 3, 10, 11, 6, 7, 14, 15};
    for (int half = 0; half < 2; half++) {
        Eight two = __builtin_shuffle(red, green, half ? highs : lows);
        Eight last = __builtin_shuffle(blue, other, half ? highs : lows);
        Eight found[2] = {__builtin_shuffle(two, last, first), __builtin_shuffle(two, last, second)};
        for (int i = 0; i < 2; i++) {
            Four *at = pixels + apart * (2 * half + i);
            at[0] = (Four){found[i][0], found[i][1], found[i][2], found[i][3]};
            at[4 * apart] = (Four){found[i][4], found[i][5], found[i][6], found[i][7]};
        }
    }
}

/* What is not negative stays; the rest, and what is not a number, is nothing. */
INLINE Four positive(Four value) { return (Four)((value > 0.0f) & (FourBits)value); }

#endif
