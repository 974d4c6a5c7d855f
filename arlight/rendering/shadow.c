/* The share of its irradiance that an object leaves to each texel of the plane. */
#include "bounded.h"
#include "eight.h"

/* ratio (side, side, 4) of three colours, the fourth the least of them, where hidden (side, side, 4) is taken from open
   (3,). Darkening, of the colour that is darkened most, fades from twice `faint` down to nothing at `faint`. `box` (4,)
   is first and last column and row of what is darkened at all; if nothing is, last before first. */
EXPORT HOT void darken(
    const Four *hidden, const float *open, int64_t side, double faint, Four *ratio, int64_t *box)
{
    Four inverse = {0.0f, 0.0f, 0.0f, 0.0f};
    for (int c = 0; c < 3; c++)
        inverse[c] = open[c] > 0.0f ? 1.0f / open[c] : 0.0f;
    float steep = (float)(1.0 / faint);
    box[0] = box[2] = side, box[1] = box[3] = -1;
    for (int64_t row = 0; row < side; row++)
        for (int64_t column = 0; column < side; column++, hidden++, ratio++) {
            /* the reconstructed radiance may dip below 0 somewhere, which would brighten the plane */
            Four taken = positive(*hidden * inverse);
            for (int c = 0; c < 3; c++)
                taken[c] = lesser(taken[c], 1.0f);
            taken[3] = greater(greater(taken[0], taken[1]), taken[2]);
            /* without a limit this is infinity, or where nothing is taken not a number, and then 0 */
            float kept = lesser(greater(taken[3] * steep - 1.0f, 0.0f), 1.0f);
            *ratio = 1.0f - taken * kept;
            if (kept > 0.0f) {
                box[0] = column < box[0] ? column : box[0], box[1] = column > box[1] ? column : box[1];
                box[2] = row < box[2] ? row : box[2], box[3] = row;
            }
        }
}
