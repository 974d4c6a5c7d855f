/* Level of the white paper in a picture, from encoded values at points of paper and wedge. */
#include "paper_samples.h"
#include "surface.h"

enum { FEWEST = 40, FEWEST_SECTORS = 8 };

typedef struct {
    PaperPoints *points; /* of the sheet, and those that are found in a picture */
    float *ink;          /* (points) reflectance: 1 on paper, 0 on a step without one */
    uint8_t *wedge;      /* (points) whether it lies on the wedge */
    uint8_t *sector;     /* (points) */
    double *scale;       /* (2) of x and y to within [-1, 1] [1/mm] */
    double *mean;        /* (6) means of the surface's terms over all paper */
    double *vignetting;  /* (6) centre [px], 1 / (half a diagonal)^2 [px^-2], k1, k2, k3 */
    float *light;        /* (steps + 1) light of encoded values from 0 to 1 */
    float *encoded;      /* (3, most) scratch */
    double *gain;        /* (most) scratch, as all that follows */
    double *values;
    double *used_x;
    double *used_y;
    double *used_ink;
    double *used_light;
    int32_t *used_sector;
    double *residual;
    double *weight;
    int32_t *bits;
    int64_t steps;
    double clip;         /* light from which a pixel counts as clipped */
    double code;         /* a code's step in encoded values */
} Meter;

/* Recorded over incident light at the pixels that are found. */
static HOT void find_gains(const Meter *meter, int found)
{
    const double *k = meter->vignetting;
    const int32_t *restrict pixel = meter->points->pixel;
    for (int i = 0; i < found; i++) {
        double x = pixel[2 * i] - k[0], y = pixel[2 * i + 1] - k[1], r2 = k[2] * (x * x + y * y);
        meter->gain[i] = 1.0 + r2 * (k[3] + r2 * (k[4] + r2 * k[5]));
    }
}

/* Light of one channel, freed of vignetting. */
static HOT void decode(const Meter *meter, int found, const float *restrict encoded)
{
    int last = (int)meter->steps - 1;
    for (int i = 0; i < found; i++) {
        float position = encoded[i] * (float)meter->steps;
        int at = (int)position;
        at = at < last ? at : last;
        float low = meter->light[at], high = meter->light[at + 1];
        meter->values[i] = (low + (high - low) * (position - (float)at)) / meter->gain[i];
    }
}

static inline int clipped(const Meter *meter, int i)
{
    double gain = meter->gain[i];
    return meter->values[i] * (gain < 1.0 ? gain : 1.0) >= meter->clip;
}

/* Collects the samples of one channel that serve: paper, and the wedge too where most of the paper is clipped. */
static Samples collect(const Meter *meter, int found)
{
    int paper = 0, lost = 0, count = 0;
    for (int i = 0; i < found; i++) {
        int blank = !meter->wedge[meter->points->place[i]];
        paper += blank;
        lost += blank & clipped(meter, i);
    }
    int crowded = 2 * lost > paper;
    for (int i = 0; i < found; i++) {
        int at = meter->points->place[i];
        if (clipped(meter, i) || (meter->wedge[at] && !(crowded && meter->ink[at] > 0.0)))
            continue;
        meter->used_x[count] = meter->scale[0] * meter->points->x[at];
        meter->used_y[count] = meter->scale[1] * meter->points->y[at];
        meter->used_ink[count] = meter->ink[at];
        meter->used_light[count] = meter->values[i];
        meter->used_sector[count] = meter->sector[at];
        count++;
    }
    return (Samples){count, meter->used_x, meter->used_y, meter->used_ink, meter->used_light, meter->used_sector,
                     meter->residual, meter->weight, meter->bits};
}

/* Variance of a level that all pixels show by the same code, as a codec leaves them: noise does not dither it. */
static double quantisation(const Meter *meter, double level)
{
    int low = 0, high = (int)meter->steps, reach = (int)meter->steps / 256;
    while (high - low > 1) {
        int middle = (low + high) / 2;
        if (meter->light[middle] <= level)
            low = middle;
        else
            high = middle;
    }
    low = low > reach ? low - reach : 0;
    high = low + 2 * reach < meter->steps ? low + 2 * reach : (int)meter->steps;
    double slope = (meter->light[high] - meter->light[low]) * (double)meter->steps / (high - low);
    return slope * meter->code * slope * meter->code / 12.0;
}

/* Measures the level of the white paper in a picture of width x height pixels under camera_from_probe
   (rotation and translation).

   Gives the levels of the three channels in out[0..2], nan where they cannot be told, their variances in out[3..5], the
   number of samples that had a say in out[6..8], and how many points of the sheet were looked at in out[9]. */
EXPORT void measure(const Meter *meter, const struct layout *layout, const struct picture *picture, int width,
                    int height, const double *pose, double *out)
{
    int32_t looked;
    int found = locate(meter->points, width, height, pose, &looked);
    read_pixels(layout, picture, found, meter->points->pixel, meter->encoded);
    find_gains(meter, found);
    for (int c = 0; c < 3; c++) {
        decode(meter, found, meter->encoded + (int64_t)c * found);
        Samples samples = collect(meter, found);
        out[c] = NAN, out[3 + c] = INFINITY, out[6 + c] = 0.0;
        if (samples.count < FEWEST || sectors_of(&samples) < FEWEST_SECTORS)
            continue;
        Level level = level_of(&samples, meter->mean);
        out[c] = level.level;
        out[3 + c] = level.variance + quantisation(meter, level.level);
        out[6 + c] = level.kept * samples.count;
    }
    out[9] = looked;
}
