/* Numbers as codes. */
#ifndef ARLIGHT_VIDEO_CODES_H
#define ARLIGHT_VIDEO_CODES_H

#include "native.h"

/* The nearest code to a number; what is no number becomes 0. */
INLINE int32_t nearest_code(float value, float zero, float span, float top)
{
    float code = value * span + (zero + 0.5f);
    code = code > 0.0f ? code : 0.0f;
    return (int32_t)(code < top ? code : top);
}

#endif
