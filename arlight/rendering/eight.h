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

INLINE Eight all(float value) { return (Eight){value, value, value, value, value, value, value, value}; }

/* What is not negative stays; the rest, and what is not a number, is nothing. */
INLINE Four positive(Four value) { return (Four)((value > 0.0f) & (FourBits)value); }

#endif
