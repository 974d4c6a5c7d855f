/* Draws lit triangles: the nearest one at every sample, its corners' radiance interpolated in perspective. */
#include "native.h"
#include "texture.h"
#include "triangle.h"

enum { CORNER = 12 }; /* columns of a corner, as in raster.py */

typedef float Four __attribute__((vector_size(16), aligned(4), may_alias));

typedef struct {
    const float *pixels;   /* (n, 2) where the vertices are seen in the frame [px] */
    const float *depth_mm; /* (n,) along the optical axis */
    const float *body;     /* (3, n) radiance of each vertex's matte body */
    const float *mirrored; /* (3, n) and of its gloss */
    const int32_t *faces;  /* (face_count, 3), counter-clockwise from outside */
    const float *texture_place; /* (n, 3) u, v, layer; null without textures */
    float *corners;        /* (n, CORNER) x, y in samples; u, v, body, 1, gloss, each over the depth; layer */
    float *nearness;       /* (height, width) 1 / depth of what is drawn, 0 where nothing is */
    float *radiance;       /* (height, width, 4) red, green, blue, 1; means nothing where nothing is drawn */
    int64_t vertex_count, face_count;
    int64_t closed;        /* whether faces that are turned away cannot be seen */
    int64_t width, height; /* samples of the region */
    int64_t samples;       /* along a pixel's side */
    Texture texture;
    double left_px, top_px, near_mm;
} Raster;

/* Vertices in samples of the region; those before the near plane, and what is too far aside, get no nearness. */
static inline void place_corners(const Raster *r)
{
    float scale = (float)r->samples, nearest = (float)r->near_mm;
    float left = (float)r->left_px - 0.5f, top = (float)r->top_px - 0.5f;
    int64_t n = r->vertex_count;
    for (int64_t i = 0; i < n; i++) {
        float x = snapped((r->pixels[2 * i] - left) * scale - 0.5f);
        float y = snapped((r->pixels[2 * i + 1] - top) * scale - 0.5f);
        int drawn = (r->depth_mm[i] > nearest) & (fabsf(x) < MOST_SAMPLES) & (fabsf(y) < MOST_SAMPLES);
        float nearness = drawn ? 1.0f / r->depth_mm[i] : 0.0f;
        float *corner = r->corners + CORNER * i;
        corner[0] = x, corner[1] = y, corner[7] = nearness;
        for (int c = 0; c < 3; c++) {
            float body = r->body[c * n + i] * nearness, mirrored = r->mirrored[c * n + i] * nearness;
            /* without a texture between them they are one */
            corner[4 + c] = r->texture_place ? body : body + mirrored;
            corner[8 + c] = mirrored;
        }
        if (r->texture_place) {
            const float *place = r->texture_place + 3 * i;
            corner[2] = place[0] * nearness, corner[3] = place[1] * nearness, corner[11] = place[2];
        }
    }
}

/* One row of a triangle: what is nearer than before replaces it. `value` is radiance / depth and 1 / depth. */
static inline void fill(const Raster *r, int64_t place, int count, Four value, Four step)
{
    float *nearness = r->nearness + place;
    Four *radiance = (Four *)r->radiance + place;
    /* rows are a few samples long: several at once would wait for each other's stores */
    for (int i = 0; i < count; i++) {
        Four here = value + (float)i * step;
        if (here[3] > nearness[i]) {
            nearness[i] = here[3];
            radiance[i] = here / here[3];
        }
    }
}

/* The same with a texture on the body. `place` is u, v over the depth, `gloss` the mirrored radiance over it. */
static inline void fill_textured(
    const Raster *r, const Picture *picture, int64_t at, int count, const Four value[3], const Four step[3])
{
    float *nearness = r->nearness + at;
    Four *radiance = (Four *)r->radiance + at;
    for (int i = 0; i < count; i++) {
        Four body = value[1] + (float)i * step[1];
        if (body[3] > nearness[i]) {
            Four place = value[0] + (float)i * step[0], gloss = value[2] + (float)i * step[2];
            float depth = 1.0f / body[3];
            Four colour = {0.0f, 0.0f, 0.0f, 1.0f};
            look_up(&r->texture, picture, place[2] * depth, place[3] * depth, (float *)&colour);
            nearness[i] = body[3];
            gloss[3] = 0.0f;
            radiance[i] = (body * colour + gloss) * depth;
        }
    }
}

/* How many pixels of the finest texture lie in a sample. */
static inline float texture_pixels(const Texture *texture, const float *a, const float *b, const float *c, float area)
{
    float u[3] = {a[2] / a[7], b[2] / b[7], c[2] / c[7]}, v[3] = {a[3] / a[7], b[3] / b[7], c[3] / c[7]};
    return fabsf(twice_area(u, v) / area) * (float)(texture->width * texture->height);
}

static inline void draw_triangle(const Raster *r, const float *a, const float *b, const float *c)
{
    float x[3] = {a[0], b[0], c[0]}, y[3] = {a[1], b[1], c[1]}, area = twice_area(x, y);
    Rows rows;
    if (!begin_rows(&rows, x, y, (int)r->height))
        return;
    /* the body alone, or texture coordinates and gloss around it */
    int first = r->texture_place ? 0 : 1, last = r->texture_place ? 2 : 1;
    Four across[3], down[3];
    float inverse = 1.0f / area, b_across = (y[2] - y[0]) * inverse, c_across = (y[1] - y[0]) * inverse;
    float b_down = (x[2] - x[0]) * inverse, c_down = (x[1] - x[0]) * inverse;
    for (int k = first; k <= last; k++) {
        Four origin = *(const Four *)(a + 4 * k);
        Four to_b = *(const Four *)(b + 4 * k) - origin, to_c = *(const Four *)(c + 4 * k) - origin;
        across[k] = to_b * b_across - to_c * c_across;
        down[k] = to_c * c_down - to_b * b_down;
    }
    Picture picture = {0, 0, 0};
    if (r->texture_place)
        picture = picture_for(&r->texture, (int)(a[11] + 0.5f), texture_pixels(&r->texture, a, b, c, area));
    for (; rows.row < rows.end; next_row(&rows)) {
        int from, to;
        samples_of_row(&rows, (int)r->width, &from, &to);
        if (from >= to)
            continue;
        Four value[3];
        for (int k = first; k <= last; k++)
            value[k] = *(const Four *)(a + 4 * k) + across[k] * (from - x[0]) + down[k] * (rows.row - y[0]);
        int64_t at = rows.row * r->width + from;
        if (r->texture_place)
            fill_textured(r, &picture, at, to - from, value, across);
        else
            fill(r, at, to - from, value[1], across[1]);
    }
}

/* Draw into the samples. */
EXPORT HOT void draw(const Raster *r)
{
    place_corners(r);
    for (int64_t i = 0; i < r->width * r->height; i++)
        r->nearness[i] = 0.0f;
    for (int64_t f = 0; f < r->face_count; f++) {
        const float *a = r->corners + CORNER * r->faces[3 * f], *b = r->corners + CORNER * r->faces[3 * f + 1];
        const float *c = r->corners + CORNER * r->faces[3 * f + 2];
        float x[3] = {a[0], b[0], c[0]}, y[3] = {a[1], b[1], c[1]}, area = twice_area(x, y);
        int hidden = a[7] == 0.0f || b[7] == 0.0f || c[7] == 0.0f;
        /* what is counter-clockwise seen from the camera has a negative area where rows run downward */
        if (hidden || area == 0.0f || (r->closed && area > 0.0f))
            continue;
        if (area > 0.0f)
            draw_triangle(r, a, b, c);
        else
            draw_triangle(r, a, c, b);
    }
}

/* The mean of each pixel's samples: radiance times coverage, and coverage, (height, width, 4) in pixels. */
EXPORT HOT void resolve(const Raster *r, float *drawn)
{
    int64_t s = r->samples, columns = r->width / s;
    float share = 1.0f / (float)(s * s);
    for (int64_t row = 0; row < r->height / s; row++)
        for (int64_t column = 0; column < columns; column++) {
            Four sum = {0.0f, 0.0f, 0.0f, 0.0f};
            for (int64_t i = 0; i < s; i++)
                for (int64_t j = 0; j < s; j++) {
                    int64_t at = (row * s + i) * r->width + column * s + j;
                    if (r->nearness[at] > 0.0f)
                        sum += ((const Four *)r->radiance)[at];
                }
            ((Four *)drawn)[row * columns + column] = sum * share;
        }
}
