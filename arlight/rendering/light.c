/* What light does to an object's parts: rows of a matrix times the light's coefficients, three colours at once. */
#include "eight.h"

enum { PARTS = 2, BLOCK = 16 * PARTS }; /* rows of a block, whose sums stay in registers; as in light_rows.py */

/* Eight rows' three colours, side by side, into every second row. */
INLINE void store_rows(Eight red, Eight green, Eight blue, Four *lit)
{
    const EightBits lows = {0, 8, 1, 9, 4, 12, 5, 13}, highs = {2, 10, 3, 11, 6, 14, 7, 15};
    const EightBits first = {0, 1, 8, 9, 4, 5, 12, 13}, second = {2, 3, 10, 11, 6, 7, 14, 15};
    const Eight nothing = all(0.0f);
    for (int half = 0; half < 2; half++) {
        Eight two = __builtin_shuffle(red, green, half ? highs : lows);
        Eight one = __builtin_shuffle(blue, nothing, half ? highs : lows);
        Eight rows[2] = {__builtin_shuffle(two, one, first), __builtin_shuffle(two, one, second)};
        for (int i = 0; i < 2; i++) {
            lit[2 * (2 * half + i)] = (Four){rows[i][0], rows[i][1], rows[i][2], rows[i][3]};
            lit[2 * (2 * half + i + 4)] = (Four){rows[i][4], rows[i][5], rows[i][6], rows[i][7]};
        }
    }
}

/* lit (blocks * BLOCK, 4) = each row's scale times the sum over `count` coefficients (count, 3) times codes (blocks, all,
   BLOCK) of 16 bits, of which the first `count` are taken; the fourth number is 0. A block's scales stand as its sums
   do: eight even rows, eight odd ones, and so on; those of even rows are for codes in the upper half of 32 bits. */
EXPORT HOT void light_rows(
    const EightBitsThere *codes, const EightThere *scale, int64_t blocks, int64_t all, const float *coefficients, int64_t count,
    Four *lit)
{
    for (; blocks > 0; blocks--, codes += PARTS * all, scale += 2 * PARTS, lit += BLOCK) {
        Eight sum[2 * PARTS][3] = {{{0.0f}}};
        for (int64_t k = 0; k < count; k++)
            for (int part = 0; part < PARTS; part++) {
                EightBits pairs = codes[PARTS * k + part];
                Eight even = __builtin_convertvector(pairs << 16, Eight);
                Eight odd = __builtin_convertvector(pairs >> 16, Eight);
                for (int c = 0; c < 3; c++) {
                    sum[2 * part][c] += coefficients[3 * k + c] * even;
                    sum[2 * part + 1][c] += coefficients[3 * k + c] * odd;
                }
            }
        for (int i = 0; i < 2 * PARTS; i++)
            store_rows(sum[i][0] * scale[i], sum[i][1] * scale[i], sum[i][2] * scale[i], lit + 16 * (i / 2) + i % 2);
    }
}
