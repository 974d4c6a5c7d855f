/* Minimum and maximum that compilers can do side by side; where the first value is not a number, the second. */
#ifndef ARLIGHT_BOUNDED_H
#define ARLIGHT_BOUNDED_H

#include "native.h"

INLINE float lesser(float value, float other)
{
    return value < other ? value : other;
}

INLINE float greater(float value, float other)
{
    return value > other ? value : other;
}

#endif
