/* What a mesh hides along one direction: a depth map by parallel projection, looked up at points. */
#include "native.h"
#include "bounded.h"

enum { LANES = 4 }; /* texels of a row that are drawn at once; a map has as many to spare */

typedef float Four __attribute__((vector_size(16), aligned(4), may_alias));
typedef int32_t Mask __attribute__((vector_size(16), aligned(4), may_alias));

typedef struct {
    const float *vertices;   /* (3, n) about the object's centre, in units of the radius of its sphere */
    const int32_t *faces;    /* (face_count, 3) */
    const float *points;     /* (3, point_count) in the same units */
    float *placed;           /* (n, 4) column, row and depth of the vertices, unused */
    float *nearest;          /* (side, side) and LANES: depth nearest to the light; EMPTY where nothing is */
    int64_t vertex_count, face_count, closed, point_count, side;
    double bias;             /* how far behind the nearest depth a point must lie to be hidden */
} Scene;

static const float EMPTY = 1e30f;
/* Twice the area, in texels, of triangles seen too nearly edge-on to tell where they are. */
static const float THINNEST = 1e-3f;
/* Triangles are drawn wider by this share of their size, so that rounding opens no crack between them. */
static const float WIDER = 1e-4f;

/* Columns and rows of texels and depths, 0 nearest to the light; `basis`: two axes across the light, and toward it. */
static inline void place(const float *p, int64_t stride, const float *basis, float side, float *x, float *y, float *z)
{
    float px = p[0], py = p[stride], pz = p[2 * stride];
    *x = (basis[0] * px + basis[1] * py + basis[2] * pz + 1.0f) * 0.5f * side - 0.5f;
    *y = (basis[3] * px + basis[4] * py + basis[5] * pz + 1.0f) * 0.5f * side - 0.5f;
    *z = 0.5f - 0.5f * (basis[6] * px + basis[7] * py + basis[8] * pz);
}

/* Smallest integer from a value on, within [0, limit]. */
static inline int from_value(float value, int limit)
{
    int whole = (int)lesser(greater(value, 0.0f), (float)limit);
    return whole + (whole < limit && (float)whole < value);
}

/* The nearest depth of the texels whose centres a triangle covers, edges included. */
static inline void draw_triangle(const Scene *s, const float *a, const float *b, const float *c)
{
    float ux = b[0] - a[0], uy = b[1] - a[1], vx = c[0] - a[0], vy = c[1] - a[1], area = ux * vy - vx * uy;
    /* the nearest face of a closed mesh is turned toward the light */
    if (fabsf(area) < THINNEST || (s->closed && area < 0.0f))
        return;
    int side = (int)s->side;
    int left = from_value(lesser(a[0], lesser(b[0], c[0])), side);
    int right = (int)lesser(greater(a[0], greater(b[0], c[0])), (float)(side - 1));
    int top = from_value(lesser(a[1], lesser(b[1], c[1])), side);
    int bottom = (int)lesser(greater(a[1], greater(b[1], c[1])), (float)(side - 1));
    if (left > right || top > bottom)
        return;
    /* shares of corners b and c; that of a is what is left */
    float inverse = 1.0f / area, b_x = vy * inverse, b_y = -vx * inverse, c_x = -uy * inverse, c_y = ux * inverse;
    float db = b[2] - a[2], dc = c[2] - a[2];
    const Four lanes = {0.0f, 1.0f, 2.0f, 3.0f};
    for (int row = top; row <= bottom; row++)
        for (int column = left; column <= right; column += LANES) {
            Four x = lanes + ((float)column - a[0]);
            float y = (float)row - a[1];
            Four of_b = x * b_x + y * b_y, of_c = x * c_x + y * c_y, depth = a[2] + of_b * db + of_c * dc;
            Four *held = (Four *)(s->nearest + (int64_t)row * side + column);
            Mask wins = (of_b >= -WIDER) & (of_c >= -WIDER) & (of_b + of_c <= 1.0f + WIDER) & (depth < *held);
            *held = (Four)((wins & (Mask)depth) | (~wins & (Mask)*held));
        }
}

static inline void draw_map(const Scene *s, const float *basis)
{
    float side = (float)s->side;
    for (int64_t i = 0; i < s->vertex_count; i++) {
        float *placed = s->placed + 4 * i;
        place(s->vertices + i, s->vertex_count, basis, side, placed, placed + 1, placed + 2);
    }
    for (int64_t i = 0; i < s->side * s->side + LANES; i++)
        s->nearest[i] = EMPTY;
    for (int64_t f = 0; f < s->face_count; f++) {
        const int32_t *face = s->faces + 3 * f;
        draw_triangle(s, s->placed + 4 * face[0], s->placed + 4 * face[1], s->placed + 4 * face[2]);
    }
}

/* How free each point is, (point_count,), 0 to 255: the map's four texels around it, weighed bilinearly. */
static inline void look_up(const Scene *s, const float *basis, uint8_t *seen)
{
    float side = (float)s->side, bias = (float)s->bias;
    const float *nearest = s->nearest, *points = s->points;
    int32_t width = (int32_t)s->side;
    int64_t count = s->point_count;
#pragma GCC ivdep
    for (int64_t i = 0; i < count; i++) {
        float x, y, z;
        place(points + i, count, basis, side, &x, &y, &z);
        z -= bias;
        int inside = (x >= 0.0f) & (x < side - 1.0f) & (y >= 0.0f) & (y < side - 1.0f);
        float kept_x = inside ? x : 0.0f, kept_y = inside ? y : 0.0f;
        int32_t column = (int32_t)kept_x, row = (int32_t)kept_y, at = row * width + column;
        float fx = kept_x - (float)column, fy = kept_y - (float)row;
        float a = (float)(nearest[at] >= z), b = (float)(nearest[at + 1] >= z);
        float c = (float)(nearest[at + width] >= z), d = (float)(nearest[at + width + 1] >= z);
        float upper = a + fx * (b - a), lower = c + fx * (d - c), free = upper + fy * (lower - upper);
        seen[i] = (uint8_t)(int32_t)(inside ? 255.0f * free + 0.5f : 255.0f);
    }
}

/* What hides the points along each of `count` directions: bases (count, 9), seen (count, point_count). */
EXPORT HOT void look_along(const Scene *s, const float *bases, int64_t count, uint8_t *seen)
{
    for (int64_t i = 0; i < count; i++) {
        draw_map(s, bases + 9 * i);
        look_up(s, bases + 9 * i, seen + i * s->point_count);
    }
}
