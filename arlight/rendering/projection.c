/* Where a camera sees points. */
#include "native.h"
#include "bounded.h"
#include "../tracking/lens.h"

typedef struct {
    double rotation[9], translation[3]; /* camera from probe, row by row [mm] */
    double lens[25];                    /* as `camera_parameters` has them */
    double near_mm;                     /* nearer points are not seen */
    double trusted_radius;              /* beyond this distance from the axis, at depth 1, the lens is not followed */
} View;

/* Box (x0, y0, x1, y1) of the pixels of those points that are seen; how many they are. */
static inline int64_t box_of(const float *pixels, const float *depth_mm, int64_t count, float near, float *box)
{
    int64_t seen = 0;
    box[0] = box[1] = INFINITY, box[2] = box[3] = -INFINITY;
    for (int64_t i = 0; i < count; i++)
        if (depth_mm[i] > near) {
            float x = pixels[2 * i], y = pixels[2 * i + 1];
            box[0] = lesser(x, box[0]), box[1] = lesser(y, box[1]);
            box[2] = greater(x, box[2]), box[3] = greater(y, box[3]);
            seen++;
        }
    return seen;
}

/* Pixels (n, 2) and depths (n,) of points (n, 3) [mm], and the `box_of` them. */
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
    return box_of(pixels, depth_mm, count, near, box);
}
