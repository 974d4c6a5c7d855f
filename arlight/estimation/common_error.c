/* How much of three frames' errors is independent: their second difference, which steady light does not have. */
#include "native.h"

typedef struct {
    int64_t channels;
    int64_t size;     /* numbers a channel; the first is the level, which is not judged */
    double *values;   /* (3, channels, size) of the last three frames, in a ring */
    double *variance; /* (3, channels, size) */
} LastFrames;

/* Takes in a frame's values and variances (channels, size) as number `slot` of the ring. */
EXPORT void push(const LastFrames *last, int slot, const double *values, const double *variance)
{
    int64_t count = last->channels * last->size;
    for (int64_t j = 0; j < count; j++) {
        last->values[slot * count + j] = values[j];
        last->variance[slot * count + j] = variance[j];
    }
}

/* Mean square of the second difference over what it is if all of the errors is independent; `slot` is the latest. */
EXPORT HOT double bend(const LastFrames *last, int slot)
{
    int size = (int)last->size, first = size > 1;
    int64_t count = last->channels * last->size;
    int64_t places[3] = {(slot + 1) % 3 * count, (slot + 2) % 3 * count, slot * count};
    const double *a = last->values + places[0], *b = last->values + places[1], *c = last->values + places[2];
    const double *u = last->variance + places[0], *v = last->variance + places[1], *w = last->variance + places[2];
    double sum = 0.0;
    for (int k = 0; k < last->channels; k++)
        for (int j = k * size + first; j < (k + 1) * size; j++) {
            double bent = c[j] - 2.0 * b[j] + a[j];
            sum += bent * bent / (u[j] + 4.0 * v[j] + w[j]);
        }
    return sum / (double)(last->channels * (size - first));
}
