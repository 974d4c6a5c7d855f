/* What all compiled parts share. */
#ifndef ARLIGHT_NATIVE_H
#define ARLIGHT_NATIVE_H

#include <math.h>
#include <stdint.h>

#define EXPORT __attribute__((visibility("default")))

/* Hot loops are compiled for several processors; the best one is chosen when the library is loaded. Levels of the
   instruction set, not names of processors: a name is chosen on that very model only. */
#if defined(__x86_64__) && defined(__linux__) && defined(__GNUC__) && __GNUC__ >= 12 && !defined(__clang__)
#define HOT __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define HOT
#endif

/* For what hot loops call: left to itself the compiler may compile it once, for the plainest processor. */
#define INLINE static inline __attribute__((always_inline))

#define PI 3.14159265358979323846

#endif
