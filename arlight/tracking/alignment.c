/* Direct alignment in one call: Gauss-Newton from coarse to fine on the pose of a sheet's markers, and what it left. */
#include <string.h>

#include "alignment.h"
#include "equations.h"
#include "levels.h"
#include "statistics.h"
#include "template.h"

#define SHORTEST_REACH_PX 0.9 /* the points of a sharp picture are not drawn closer to the edges than for this blur */
#define DRAWN_ANEW 0.02       /* relative change of a marker's blur that its template is drawn again for */
#define WIDENING 1.2          /* blur on a shrunk picture, in its pixels: wider than the picture's, it reaches farther */

/* How hard one level of resolution is worked on. */
typedef struct {
    int fewest, most;       /* Gauss-Newton steps; the first is without weights */
    double tolerance_px;    /* the level ends with a step that moves the sheet by less */
    double floors[2];       /* correlation that a marker needs to take part, in the first step and after */
    int shares[2];          /* of so many points one is used, in the first step and after */
} Level;

static const Level FINEST = {2, 8, 0.02, {0.5, OCCLUDED_BELOW}, {2, 1}};
static const Level COARSER = {1, 6, 0.2, {-1.0, 0.2}, {2, 2}};

static int differs(double wanted, double drawn)
{
    return !(fabs(wanted - drawn) <= DRAWN_ANEW * drawn);
}

/* Draws the templates as they look at the pose, blurred on each marker's axes as isotropic blur does there. */
EXPORT void draw(Alignment *a, double blur_px)
{
    double reach_px = blur_px > SHORTEST_REACH_PX ? blur_px : SHORTEST_REACH_PX;
    Lens lens = lens_of(a->camera);
    for (int m = 0; m < a->markers; m++) {
        Placed q = placed_at(a->pose, a->places + 6 * m, a->size);
        float x[3], y[3];
        for (int k = 0; k < 3; k++) {
            const float u = k == 1 ? 1.0f : 0.0f, v = k == 2 ? 1.0f : 0.0f, z = q.middle[2] + u * q.u[2] + v * q.v[2];
            project(&lens, (q.middle[0] + u * q.u[0] + v * q.v[0]) / z, (q.middle[1] + u * q.u[1] + v * q.v[1]) / z,
                    &x[k], &y[k]);
        }
        double area = fabs((x[1] - x[0]) * (y[2] - y[0]) - (y[1] - y[0]) * (x[2] - x[0]));
        area = area > 1e-9 ? area : 1e-9;
        double per_px[2] = {hypot(x[2] - x[0], y[2] - y[0]) / area, hypot(x[1] - x[0], y[1] - y[0]) / area};
        double *drawn = a->drawn + 4 * m;
        if (differs(blur_px * per_px[0], drawn[0]) || differs(blur_px * per_px[1], drawn[1])
            || differs(reach_px * per_px[0], drawn[3])) {
            float sigma[2] = {blur_px * per_px[0], blur_px * per_px[1]};
            float reach[2] = {reach_px * per_px[0], reach_px * per_px[1]};
            float growth[2] = {per_px[0] * per_px[0], per_px[1] * per_px[1]};
            draw_marker(a, m, sigma, reach, growth);
            drawn[0] = sigma[0];
            drawn[1] = sigma[1];
            drawn[3] = reach[0];
        }
        double across = drawn[0] / per_px[0], down = drawn[1] / per_px[1];
        drawn[2] = 0.5 * (across * across + down * down);
    }
}

/* Turns and moves the pose by a step. */
static void take(double *pose, const double *step)
{
    double angle2 = step[0] * step[0] + step[1] * step[1] + step[2] * step[2], angle = sqrt(angle2);
    double s = angle > 1e-8 ? sin(angle) / angle : 1.0, c = angle > 1e-4 ? (1.0 - cos(angle)) / angle2 : 0.5;
    for (int column = 0; column < 3; column++) {
        double v[3] = {pose[column], pose[3 + column], pose[6 + column]}, once[3];
        for (int k = 0; k < 3; k++)
            once[k] = step[(k + 1) % 3] * v[(k + 2) % 3] - step[(k + 2) % 3] * v[(k + 1) % 3];
        for (int k = 0; k < 3; k++) {
            double twice = step[(k + 1) % 3] * once[(k + 2) % 3] - step[(k + 2) % 3] * once[(k + 1) % 3];
            pose[3 * k + column] = v[k] + s * once[k] + c * twice;
        }
    }
    for (int k = 0; k < 3; k++)
        pose[9 + k] += step[3 + k];
}

/* The pose after a share of the motion from `before` to `last`, counted from `last`; half a turn counts as none. */
EXPORT void extrapolate(const double *before, const double *last, double share, double *pose)
{
    double motion[3][3], step[6];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            motion[i][j] = last[3 * i] * before[3 * j] + last[3 * i + 1] * before[3 * j + 1] +
                           last[3 * i + 2] * before[3 * j + 2];
    for (int k = 0; k < 3; k++) {
        int next = (k + 1) % 3, after = (k + 2) % 3;
        step[k] = 0.5 * (motion[after][next] - motion[next][after]);
        step[3 + k] = share * (last[9 + k] - before[9 + k]);
    }
    double sine = sqrt(step[0] * step[0] + step[1] * step[1] + step[2] * step[2]);
    double angle = atan2(sine, 0.5 * (motion[0][0] + motion[1][1] + motion[2][2] - 1.0));
    for (int k = 0; k < 3; k++)
        step[k] *= sine > 1e-12 ? share * angle / sine : share;
    memcpy(pose, last, 12 * sizeof *pose);
    take(pose, step);
}

/* Gauss-Newton at one resolution; 0 where no marker takes part. */
static int fit(Alignment *a, double blur_px, int shrink, Equations *equations)
{
    const Level level = shrink == 1 ? FINEST : COARSER;
    double least_px = WIDENING * shrink, drawn_px = shrink == 1 || blur_px > least_px ? blur_px : least_px;
    Plane planes[a->markers];
    look_at(a, shrink, planes);
    draw(a, drawn_px);
    memset(a->coefficients, 0, sizeof(double) * (size_t)(a->markers * LIGHTING));
    for (int k = 1; k <= level.most; k++) {
        double scale[POSE], factor[POSE][POSE], step[POSE];
        *equations = linearise(a, (int)a->points / level.shares[k > 1], planes, level.floors[k > 1], blur_px);
        if (equations->used == 0 || !factorise(equations, 1e-9, scale, factor))
            return 0;
        for (int i = 0; i < POSE; i++)
            step[i] = -scale[i] * equations->right[i];
        substitute(factor, step, 1, step);
        for (int i = 0; i < POSE; i++)
            step[i] *= scale[i];
        take(a->pose, step);
        double turned = sqrt(step[0] * step[0] + step[1] * step[1] + step[2] * step[2]);
        double moved = sqrt(step[3] * step[3] + step[4] * step[4] + step[5] * step[5]);
        if (k >= level.fewest && a->camera[0] * (moved + a->radius_mm * turned) < level.tolerance_px * a->pose[11])
            break;
    }
    return 1;
}

/* Whether the camera looks at the printed side, all markers before it. */
static int is_seen_from_above(const Alignment *a)
{
    const double *t = a->pose + 9, *r = a->pose;
    if (!(r[2] * t[0] + r[5] * t[1] + r[8] * t[2] < 0.0))
        return 0;
    for (int m = 0; m < a->markers; m++) {
        Placed q = placed_at(a->pose, a->places + 6 * m, a->size);
        if (!(q.middle[2] - q.half * (fabsf(q.u[2]) + fabsf(q.v[2])) > 0.0f))
            return 0;
    }
    return 1;
}

/* Aligns the markers to the picture from the pose in `pose`, from 1/coarsest of the resolution on; 0 without success. */
EXPORT int align(Alignment *a, double blur_px, int coarsest)
{
    Equations equations = {.used = 0};
    if (!is_seen_from_above(a))
        return 0;
    for (int shrink = coarsest; shrink >= 1; shrink /= 2)
        if (!fit(a, blur_px, shrink, &equations))
            return 0;
    if (!is_seen_from_above(a))
        return 0;
    a->result[0] = residual_rms_px(a);
    a->result[1] = corner_stddev_px(a, &equations);
    a->result[2] = next_blur_px(&equations, blur_px);
    return 1;
}

/* The markers' own equations and lighting at the pose, at full resolution; how many take part. */
EXPORT int observe_markers(Alignment *a, double floor)
{
    Plane planes[a->markers];
    look_at(a, 1, planes);
    return linearise(a, (int)a->points, planes, floor, 1.0).used;
}
