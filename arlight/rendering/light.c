/* What light does to an object's parts: rows of a matrix times the light's coefficients, three colours at once. */
#include "eight.h"

enum { PARTS = 2, BLOCK = 16 * PARTS }; /* rows of a block, whose sums stay in registers; as in light_rows.py */

/* lit (blocks * BLOCK, 4) = each row's scale times the sum over `count` coefficients (count, 3) times codes (blocks,
   known, BLOCK) of 16 bits, of which the first `count` are taken; the fourth number is 0. A block's scales stand as
   its sums do: eight even rows, eight odd ones, and so on; those of even rows are for codes in the upper half of 32
   bits. */
EXPORT HOT void light_rows(
    const EightBitsThere *codes, const EightThere *scale, int64_t blocks, int64_t known, const float *coefficients,
    int64_t count, Four *lit)
{
    for (; blocks > 0; blocks--, codes += PARTS * known, scale += 2 * PARTS, lit += BLOCK) {
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
        for (int i = 0; i < 2 * PARTS; i++) {
            Eight red = sum[i][0] * scale[i], green = sum[i][1] * scale[i], blue = sum[i][2] * scale[i];
            store_pixels(red, green, blue, all(0.0f), lit + 16 * (i / 2) + i % 2, 2);
        }
    }
}
