/* Where a camera sees points. */
#include "native.h"
#include "bounded.h"
#include "../tracking/lens.h"

enum { LANES = 16 }; /* numbers whose bounds are found side by side: x and y in turn */

typedef struct {
    double rotation[9], translation[3]; /* camera from probe, row by row [mm] */
    double lens[25];                    /* as `camera_parameters` has them */
    double near_mm;                     /* nearer points are not seen */
    double trusted_radius;              /* beyond this distance from the axis, at depth 1, the lens is not followed */
} View;

/* How many points lie beyond the near plane. */
INLINE int64_t count_seen(const float *depth_mm, int64_t count, float near)
{
    int32_t seen = 0;
    for (int64_t i = 0; i < count; i++)
        seen += depth_mm[i] > near;
    return seen;
}

/* Box (x0, y0, x1, y1) of pixels. */
INLINE void find_box(const float *pixels, int64_t count, float *box)
{
    float low[LANES], high[LANES];
    for (int k = 0; k < LANES; k++)
        low[k] = INFINITY, high[k] = -INFINITY;
    int64_t i = 0;
    for (; i + LANES <= 2 * count; i += LANES)
        for (int k = 0; k < LANES; k++)
            low[k] = lesser(pixels[i + k], low[k]), high[k] = greater(pixels[i + k], high[k]);
    for (; i < 2 * count; i++)
        low[i % 2] = lesser(pixels[i], low[i % 2]), high[i % 2] = greater(pixels[i], high[i % 2]);
    for (int k = 2; k < LANES; k++)
        low[k % 2] = lesser(low[k], low[k % 2]), high[k % 2] = greater(high[k], high[k % 2]);
    box[0] = low[0], box[1] = low[1], box[2] = high[0], box[3] = high[1];
}

/* Pixels (n, 2) and depths (n,) of points (n, 3) [mm], and the pixels' box; how many of them are seen. */
EXPORT HOT int64_t project_points(
    const View *view, int64_t count, const float *points, float *pixels, float *depth_mm, float *box)
{
    const Lens lens = lens_of(view->lens);
    float m[9], t[3], near = (float)view->near_mm;
    float reach = (float)(view->trusted_radius * view->trusted_radius);
    for (int i = 0; i < 9; i++)
        m[i] = (float)view->rotation[i];
    for (int i = 0; i < 3; i++)
        t[i] = (float)view->translation[i];
    for (int64_t i = 0; i < count; i++) {
        const float *p = points + 3 * i;
        float depth = m[6] * p[0] + m[7] * p[1] + m[8] * p[2] + t[2];
        float divisor = fabsf(depth) < near ? near : depth;
        float x = (m[0] * p[0] + m[1] * p[1] + m[2] * p[2] + t[0]) / divisor;
        float y = (m[3] * p[0] + m[4] * p[1] + m[5] * p[2] + t[1]) / divisor;
        float straight_x = lens.focal_x * x + lens.centre_x, straight_y = lens.focal_y * y + lens.centre_y;
        float bent_x, bent_y;
        project(&lens, x, y, &bent_x, &bent_y);
        int seen = depth > near, bent = seen & (x * x + y * y < reach);
        float px = bent ? bent_x : straight_x, py = bent ? bent_y : straight_y;
        pixels[2 * i] = px, pixels[2 * i + 1] = py, depth_mm[i] = depth;
    }
    find_box(pixels, count, box);
    return count_seen(depth_mm, count, near);
}
