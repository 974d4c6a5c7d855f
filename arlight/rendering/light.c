/* What light does to an object's parts: rows of a matrix times the light's coefficients, three colours at once. */
#include "native.h"

enum { BLOCK = 512 };

/* lit (3, n) = sum over the first `count` coefficients of coefficients (count, 3) times rows (count, n). */
EXPORT HOT void light_rows(const float *rows, int64_t n, const float *coefficients, int64_t count, float *lit)
{
    for (int64_t first = 0; first < n; first += BLOCK) {
        int64_t width = n - first < BLOCK ? n - first : BLOCK;
        float red[BLOCK] = {0}, green[BLOCK] = {0}, blue[BLOCK] = {0};
        for (int64_t k = 0; k < count; k++) {
            const float *row = rows + k * n + first, *c = coefficients + 3 * k;
            for (int64_t i = 0; i < width; i++) {
                red[i] += c[0] * row[i];
                green[i] += c[1] * row[i];
                blue[i] += c[2] * row[i];
            }
        }
        for (int64_t i = 0; i < width; i++) {
            lit[first + i] = red[i];
            lit[n + first + i] = green[i];
            lit[2 * n + first + i] = blue[i];
        }
    }
}
