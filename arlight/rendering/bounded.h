/* Minimum and maximum that compilers can do side by side; where the first value is not a number, the second. */
#ifndef ARLIGHT_BOUNDED_H
#define ARLIGHT_BOUNDED_H

static inline float lesser(float value, float other)
{
    return value < other ? value : other;
}

static inline float greater(float value, float other)
{
    return value > other ? value : other;
}

#endif
