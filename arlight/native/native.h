/* What all compiled parts share. */
#ifndef ARLIGHT_NATIVE_H
#define ARLIGHT_NATIVE_H

#include <math.h>
#include <stdint.h>

#define EXPORT __attribute__((visibility("default")))

/* Hot loops are compiled for several processors; the best one is chosen when the library is loaded. */
#if defined(__x86_64__) && defined(__linux__) && defined(__GNUC__) && !defined(__clang__)
#define HOT __attribute__((target_clones("arch=skylake-avx512", "arch=haswell", "default")))
#else
#define HOT
#endif

#define PI 3.14159265358979323846

#endif
