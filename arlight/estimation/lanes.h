/* Four blocks at a time: vectors of doubles and the few functions of them that the fit needs. */
#ifndef ARLIGHT_LANES_H
#define ARLIGHT_LANES_H

#include "native.h"

#define LANES 4
#define INLINE static inline __attribute__((always_inline))
/* For loops that contain others, or are long: which of an array of vectors is meant has to be known. */
#define UNROLLED _Pragma("GCC unroll 28")

typedef double lanes __attribute__((vector_size(32)));
typedef int64_t lane_bits __attribute__((vector_size(32)));
typedef double loose_lanes __attribute__((vector_size(32), aligned(8), may_alias));

INLINE lanes load(const double *from) { return *(const loose_lanes *)from; }

INLINE void store(double *to, lanes value) { *(loose_lanes *)to = value; }

INLINE lanes splat(double value) { return (lanes){value, value, value, value}; }

INLINE double total(lanes a) { return (a[0] + a[1]) + (a[2] + a[3]); }

INLINE lanes select_lanes(lane_bits where, lanes yes, lanes no)
{
    return (lanes)((where & (lane_bits)yes) | (~where & (lane_bits)no));
}

/* 1 where a condition holds, 0 elsewhere. */
INLINE lanes indicator(lane_bits where) { return (lanes)(where & (lane_bits)splat(1.0)); }

INLINE lanes larger(lanes a, lanes b) { return select_lanes(a > b, a, b); }

INLINE lanes smaller(lanes a, lanes b) { return select_lanes(a < b, a, b); }

INLINE lanes magnitude(lanes a) { return larger(a, -a); }

INLINE lanes root(lanes a)
{
    return (lanes){__builtin_sqrt(a[0]), __builtin_sqrt(a[1]), __builtin_sqrt(a[2]), __builtin_sqrt(a[3])};
}

INLINE lanes nearest(lanes a)
{
    return (lanes){__builtin_rint(a[0]), __builtin_rint(a[1]), __builtin_rint(a[2]), __builtin_rint(a[3])};
}

/* Four rows become four columns. */
INLINE void transpose(lanes *rows)
{
    typedef int64_t places __attribute__((vector_size(32)));
    const lanes a = __builtin_shuffle(rows[0], rows[1], (places){0, 4, 2, 6});
    const lanes b = __builtin_shuffle(rows[0], rows[1], (places){1, 5, 3, 7});
    const lanes c = __builtin_shuffle(rows[2], rows[3], (places){0, 4, 2, 6});
    const lanes d = __builtin_shuffle(rows[2], rows[3], (places){1, 5, 3, 7});
    rows[0] = __builtin_shuffle(a, c, (places){0, 1, 4, 5});
    rows[1] = __builtin_shuffle(b, d, (places){0, 1, 4, 5});
    rows[2] = __builtin_shuffle(a, c, (places){2, 3, 6, 7});
    rows[3] = __builtin_shuffle(b, d, (places){2, 3, 6, 7});
}

/* exp to 1e-14, for -700 to 700. */
INLINE lanes exponential(lanes x)
{
    x = larger(smaller(x, splat(700.0)), splat(-700.0));
    const lanes power = nearest(x * 1.4426950408889634);
    const lanes r = x - power * 0.693147180369123816490 - power * 1.90821492927058770002e-10;
    lanes sum = splat(1.0 / 39916800.0);
    static const double factor[] = {1.0 / 3628800, 1.0 / 362880, 1.0 / 40320, 1.0 / 5040, 1.0 / 720, 1.0 / 120,
                                    1.0 / 24, 1.0 / 6, 0.5, 1.0, 1.0};
    for (int i = 0; i < 11; i++)
        sum = sum * r + factor[i];
    /* the sum's last bits are the power, as a whole number; shifted they are a double's exponent */
    const lane_bits bits = (lane_bits)(power + 6755399441055744.0);
    return sum * (lanes)((bits << 52) + ((int64_t)1023 << 52));
}

/* Natural logarithm to 1e-12, of normal positive numbers. */
INLINE lanes logarithm(lanes x)
{
    /* x is a power of two times a mantissa between sqrt(1/2) and sqrt(2) */
    const lane_bits bits = (lane_bits)x - (lane_bits)splat(0.70710678118654752440);
    const lane_bits whole = bits >> 52;
    const lanes mantissa = (lanes)((lane_bits)x - (whole << 52));
    const lanes power = (lanes)(whole + (lane_bits)splat(6755399441055744.0)) - 6755399441055744.0;
    const lanes z = (mantissa - 1.0) / (mantissa + 1.0), square = z * z;
    lanes sum = splat(2.0 / 15.0);
    for (int k = 13; k > 0; k -= 2)
        sum = sum * square + 2.0 / k;
    return power * 0.69314718055994530942 + z * sum;
}

/* sin(pi x) / x and cos(pi x) to 1e-13, for -0.5 to 0.5. */
INLINE void half_turn(lanes x, lanes *sine_over, lanes *cosine)
{
    static const double odd[] = {3.141592653589793,     -5.167712780049969,      2.550164039877345,
                                 -0.5992645293207919,   0.08214588661112819,     -0.007370430945714348,
                                 0.0004663028057676123, -2.1915353447830204e-05, 7.952054001475508e-07,
                                 -2.2948428997269856e-08};
    static const double even[] = {1.0, -4.934802200544679, 4.058712126416768, -1.3352627688545893,
                                  0.23533063035889312, -0.02580689139001405, 0.0019295743094039231,
                                  -0.00010463810492484565, 4.303069587032944e-06, -1.387895246221376e-07,
                                  3.6047307974624982e-09};
    const lanes square = x * x;
    lanes s = splat(odd[9]), c = splat(even[10]);
    for (int i = 8; i >= 0; i--)
        s = s * square + odd[i];
    for (int i = 9; i >= 0; i--)
        c = c * square + even[i];
    *sine_over = s;
    *cosine = c;
}

#endif
