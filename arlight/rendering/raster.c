/* Draws lit triangles: the nearest one at every sample, its corners' radiance interpolated in perspective. */
#include "native.h"
#include "bands.h"
#include "samples.h"
#include "texture.h"
#include "triangle.h"

#include <string.h>

typedef struct {
    int32_t x, y;      /* place in 1 / SNAP of a sample */
    float u, v;        /* texture coordinates over the depth */
    float radiance[3]; /* over the depth; of the body alone where it has a texture */
    float nearness;    /* 1 / depth, 0 where the corner is not to be drawn */
} Corner;

typedef struct {
    const float *pixels;   /* (n, 2) where the vertices are seen in the frame [px] */
    const float *depth_mm; /* (n,) along the optical axis */
    const float *body;     /* (n, 4) radiance of each vertex's matte body */
    const float *mirrored; /* (n, 4) and of its gloss */
    const int32_t *faces;  /* (face_count, 3), counter-clockwise from outside */
    const float *texture_place; /* (n, 3) u, v, layer; null without textures */
    Corner *corners;       /* (n,) */
    Bands bands;           /* which faces to draw in which rows */
    Samples samples;       /* of the region */
    int64_t vertex_count, face_count;
    int64_t closed;        /* whether faces that are turned away cannot be seen */
    int64_t side;          /* samples along a pixel's side */
    Texture texture;
    double left_px, top_px, near_mm;
} Raster;

/* Vertices in samples of the region; those before the near plane, and what is too far aside, get no nearness. */
INLINE void place_corners(const Raster *r)
{
    float scale = (float)r->side * SNAP, nearest = (float)r->near_mm, middle = 0.5f * SNAP;
    float left = (float)r->left_px - 0.5f, top = (float)r->top_px - 0.5f;
    /* without a texture between them body and gloss are one */
    float share = r->texture_place ? 0.0f : 1.0f;
    for (int64_t i = 0; i < r->vertex_count; i++) {
        float x = rintf((r->pixels[2 * i] - left) * scale - middle);
        float y = rintf((r->pixels[2 * i + 1] - top) * scale - middle);
        int drawn = (r->depth_mm[i] > nearest) & (fabsf(x) < FARTHEST) & (fabsf(y) < FARTHEST);
        float nearness = drawn ? 1.0f / r->depth_mm[i] : 0.0f;
        Four light = *(const Four *)(r->body + 4 * i) + share * *(const Four *)(r->mirrored + 4 * i);
        light[3] = 1.0f;
        Corner *corner = r->corners + i;
        corner->x = drawn ? (int32_t)x : 0, corner->y = drawn ? (int32_t)y : 0, corner->u = corner->v = 0.0f;
        *(Four *)corner->radiance = light * nearness;
    }
    if (r->texture_place)
        for (int64_t i = 0; i < r->vertex_count; i++) {
            Corner *corner = r->corners + i;
            corner->u = r->texture_place[3 * i] * corner->nearness;
            corner->v = r->texture_place[3 * i + 1] * corner->nearness;
        }
}

/* Values over the depth at a triangle's first sample, and their change to the next column and row. */
typedef struct {
    Four first, across, down;
} Gradient;

/* From the values at the corners; the first sample is the box's. */
INLINE Gradient gradient_of(const Triangle *t, float sample_over_area, Four a, Four b, Four c)
{
    Four to_b = (b - a) * sample_over_area, to_c = (c - a) * sample_over_area;
    Four across = to_b * (float)(t->y[2] - t->y[0]) - to_c * (float)(t->y[1] - t->y[0]);
    Four down = to_c * (float)(t->x[1] - t->x[0]) - to_b * (float)(t->x[2] - t->x[0]);
    float right = (float)(SNAP * t->left - t->x[0]) / SNAP, below = (float)(SNAP * t->top - t->y[0]) / SNAP;
    return (Gradient){a + across * right + down * below, across, down};
}

INLINE Four value_at(const Gradient *g, int right, int below)
{
    return g->first + g->across * (float)right + g->down * (float)below;
}

/* Draw eight columns of a triangle, from row to row while `outside` of its edges changes by `step`. */
INLINE void draw_columns(
    const Samples *s, int64_t at, int from, int to, const Gradient *g, int right, EightBits outside[3],
    const int32_t step[3])
{
    Eight first[4], down[4];
    for (int c = 0; c < 4; c++) {
        first[c] = g->first[c] + g->across[c] * __builtin_convertvector(right + COLUMN, Eight);
        down[c] = all(g->down[c]);
    }
    float *samples = s->planes + at;
    for (int below = from; below < to; below++, samples += s->width) {
        Eight value[4];
        for (int c = 0; c < 4; c++)
            value[c] = first[c] + down[c] * (float)below;
        put(samples, s->plane, outside[0] | outside[1] | outside[2], value);
        for (int i = 0; i < 3; i++)
            outside[i] += step[i];
    }
}

/* A small triangle between the picture's sides. */
INLINE void draw_small(const Samples *s, const Triangle *t, const Gradient *g)
{
    Edges edges = edges_of(t);
    int top = t->top > s->top ? t->top : (int)s->top, bottom = t->bottom < s->bottom ? t->bottom : (int)s->bottom;
    int64_t at = place_of(s, top, t->left);
    for (int right = 0; right < t->right - t->left; right += SIDE_BY_SIDE) {
        EightBits outside[3];
        for (int i = 0; i < 3; i++)
            outside[i] = edges.first[i] + edges.across[i] * (right + COLUMN) + edges.down[i] * (top - t->top);
        draw_columns(s, at + right, top - t->top, bottom - t->top, g, right, outside, edges.down);
    }
}

/* Any triangle. */
INLINE void draw_rows(const Samples *s, const Triangle *t, const Gradient *g)
{
    const int32_t still[3] = {0, 0, 0};
    int from, to;
    for (Rows rows = rows_of(t, (int)s->top, (int)s->bottom, (int)s->height); rows.row < rows.end; next_row(&rows)) {
        samples_of_row(&rows, (int)s->width, &from, &to);
        for (int column = from; column < to; column += SIDE_BY_SIDE) {
            /* the sign of what is left of the row */
            EightBits left = to - column - 1 - COLUMN, outside[3] = {left, left, left};
            int below = rows.row - t->top;
            draw_columns(s, place_of(s, rows.row, column), below, below + 1, g, column - t->left, outside, still);
        }
    }
}

/* The picture to look up: how many pixels of the finest texture lie in a sample is told by the corners' u and v. */
INLINE Picture picture_of(const Raster *r, const int32_t face[3], float sample_over_area)
{
    const Corner *a = r->corners + face[0], *b = r->corners + face[1], *c = r->corners + face[2];
    float u = a->u / a->nearness, v = a->v / a->nearness;
    float bu = b->u / b->nearness - u, bv = b->v / b->nearness - v;
    float cu = c->u / c->nearness - u, cv = c->v / c->nearness - v;
    float pixels = fabsf((bu * cv - cu * bv) * sample_over_area * SNAP) * (float)(r->texture.width * r->texture.height);
    return picture_for(&r->texture, (int)(r->texture_place[3 * face[0] + 2] + 0.5f), pixels);
}

/* Any triangle, with a texture on the body under its gloss. */
INLINE void draw_textured(const Raster *r, const Triangle *t, const int32_t face[3], float over_area, const Gradient *g)
{
    const Samples *s = &r->samples;
    Four place[3], gloss[3];
    for (int i = 0; i < 3; i++) {
        const Corner *corner = r->corners + face[i];
        place[i] = (Four){corner->u, corner->v, 0.0f, 0.0f};
        gloss[i] = *(const Four *)(r->mirrored + 4 * face[i]) * corner->nearness;
    }
    Gradient places = gradient_of(t, over_area, place[0], place[1], place[2]);
    Gradient glosses = gradient_of(t, over_area, gloss[0], gloss[1], gloss[2]);
    Picture picture = picture_of(r, face, over_area);
    int from, to;
    for (Rows rows = rows_of(t, (int)s->top, (int)s->bottom, (int)s->height); rows.row < rows.end; next_row(&rows)) {
        samples_of_row(&rows, (int)s->width, &from, &to);
        for (int column = from; column < to; column++) {
            int64_t at = place_of(s, rows.row, column);
            int right = column - t->left, below = rows.row - t->top;
            Four body = value_at(g, right, below);
            if (!(body[3] > s->planes[at]))
                continue;
            Four uv = value_at(&places, right, below), mirrored = value_at(&glosses, right, below);
            float depth = 1.0f / body[3], colour[3];
            look_up(&r->texture, &picture, uv[0] * depth, uv[1] * depth, colour);
            s->planes[at] = body[3];
            for (int c = 0; c < 3; c++)
                s->planes[(c + 1) * s->plane + at] = (body[c] * colour[c] + mirrored[c]) * depth;
        }
    }
}

/* The corners on the grid. */
INLINE Triangle triangle_of(const Raster *r, const int32_t face[3])
{
    Triangle t;
    for (int i = 0; i < 3; i++)
        t.x[i] = r->corners[face[i]].x, t.y[i] = r->corners[face[i]].y;
    return t;
}

/* Whether a face can be seen: its corners are in front of the camera, and it is not turned away. */
INLINE int is_seen(const Raster *r, const int32_t face[3])
{
    const Corner *a = r->corners + face[0], *b = r->corners + face[1], *c = r->corners + face[2];
    Triangle t = triangle_of(r, face);
    int64_t area = twice_area(&t);
    /* what is counter-clockwise seen from the camera has a negative area where rows run downward */
    return (a->nearness > 0.0f) & (b->nearness > 0.0f) & (c->nearness > 0.0f) & ((area < 0) | (!r->closed & (area > 0)));
}

/* Finds the faces that are to be drawn, and the band that each begins in. */
INLINE void sort_faces(const Raster *r)
{
    const Samples *s = &r->samples;
    int64_t listed = 0;
    begin_listing(&r->bands);
    for (int64_t i = 0; i < r->face_count; i++) {
        const int32_t *face = r->faces + 3 * i;
        Triangle t = triangle_of(r, face);
        find_box(&t);
        int drawn = is_seen(r, face) & (t.left < t.right) & (t.top < t.bottom) & (t.right > 0) & (t.bottom > 0);
        drawn &= (t.left < s->width) & (t.top < s->height);
        listed = list_face(&r->bands, listed, (int32_t)i, t.top, drawn);
    }
    sort_listed(&r->bands, listed);
}

/* Draws a face's samples in the band; the row after its last. */
INLINE int draw_face(const Raster *r, const int32_t given[3])
{
    int32_t face[3] = {given[0], given[1], given[2]};
    Triangle t = triangle_of(r, face);
    int64_t area = twice_area(&t);
    if (area < 0) {
        area = -area;
        int32_t x = t.x[1], y = t.y[1];
        face[1] = given[2], t.x[1] = t.x[2], t.y[1] = t.y[2];
        face[2] = given[1], t.x[2] = x, t.y[2] = y;
    }
    find_box(&t);
    Four corner[3];
    for (int i = 0; i < 3; i++)
        corner[i] = *(const Four *)r->corners[face[i]].radiance;
    float over_area = (float)SNAP / (float)area;
    Gradient g = gradient_of(&t, over_area, corner[0], corner[1], corner[2]);
    if (r->texture_place)
        draw_textured(r, &t, face, over_area, &g);
    else if ((t.left >= 0) & (t.right <= r->samples.width) & is_small(&t))
        draw_small(&r->samples, &t, &g);
    else
        draw_rows(&r->samples, &t, &g);
    return t.bottom;
}

/* Draws a band's faces. */
INLINE void draw_band(const Raster *r, Band *band)
{
    while (has_face(band)) {
        int32_t face = next_face(band);
        *band->kept = face;
        band->kept += draw_face(r, r->faces + 3 * face) > r->samples.bottom;
    }
}

/* The picture (height / side, width / side, 4): radiance times coverage, and coverage. */
EXPORT HOT void draw(Raster *r, Four *drawn)
{
    Samples *s = &r->samples;
    Band band = {0};
    place_corners(r);
    sort_faces(r);
    for (int64_t number = 0; number < r->bands.count; number++) {
        s->top = number * r->bands.rows;
        s->bottom = s->top + r->bands.rows < s->height ? s->top + r->bands.rows : s->height;
        memset(s->planes, 0, (size_t)(s->width * (s->bottom - s->top)) * sizeof *s->planes);
        band = begin_band(&r->bands, number, &band);
        draw_band(r, &band);
        mean_of_samples(s, r->side, drawn);
    }
}
