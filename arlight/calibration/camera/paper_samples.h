/* Pixels of a sheet's paper: which of its points a picture shows well, and their colour. */
#ifndef ARLIGHT_PAPER_SAMPLES_H
#define ARLIGHT_PAPER_SAMPLES_H

#include "../../tracking/lens.h"
#include "../../video/picture.h"

/* Points are looked at so many at a time, until enough are found. */
enum { CHUNK = 64 };

typedef struct {
    int64_t count;      /* points of the sheet */
    float *x;           /* (count, rounded up to whole chunks) [mm] */
    float *y;
    float *clearance;   /* how far each point is from ink and edges [mm]; -1 beyond count */
    double edge_px;     /* distance to keep from all that [px] */
    double *lens;       /* (25) `camera_parameters` */
    int64_t most;       /* points that suffice */
    int32_t *place;     /* (most) number of each point that is found */
    int32_t *pixel;     /* (most, 2) its column and row [px] */
} PaperPoints;

typedef struct {
    float right[3], up[3], origin[3]; /* the sheet's axes and origin as the camera has them */
} Axes;

/* Of rotation and translation [mm] of camera_from_probe, one after the other. */
static Axes axes_of(const double *pose)
{
    Axes axes;
    for (int k = 0; k < 3; k++) {
        axes.right[k] = (float)pose[3 * k];
        axes.up[k] = (float)pose[3 * k + 1];
        axes.origin[k] = (float)pose[9 + k];
    }
    return axes;
}

/* Pixels of a chunk of points, moved to (-1, -1) where they are too close to what is not paper. */
static HOT void project_chunk(const PaperPoints *points, const Lens *lens, const Axes *axes, int first,
                              float *restrict column, float *restrict row)
{
    const float *restrict xs = points->x + first, *restrict ys = points->y + first;
    const float *restrict clearance = points->clearance + first;
    float edge = (float)points->edge_px;
    Axes a = *axes;
    Lens l = *lens;
    for (int i = 0; i < CHUNK; i++) {
        float depth = a.origin[2] + a.right[2] * xs[i] + a.up[2] * ys[i], near = 1.0f / depth;
        float x = (a.origin[0] + a.right[0] * xs[i] + a.up[0] * ys[i]) * near;
        float y = (a.origin[1] + a.right[1] * xs[i] + a.up[1] * ys[i]) * near;
        /* pixels that a millimetre takes up along both axes, without distortion, and across the narrow way */
        float u = l.focal_x * near, v = l.focal_y * near;
        float rx = u * (a.right[0] - x * a.right[2]), ry = v * (a.right[1] - y * a.right[2]);
        float ux = u * (a.up[0] - x * a.up[2]), uy = v * (a.up[1] - y * a.up[2]);
        float area = fabsf(rx * uy - ry * ux), squares = rx * rx + ry * ry + ux * ux + uy * uy;
        float px, py;
        project(&l, x, y, &px, &py);
        int shown = (depth > 0.0f) & (clearance[i] * area > edge * sqrtf(squares));
        column[i] = shown ? px : -1.0f;
        row[i] = shown ? py : -1.0f;
    }
}

/* Finds points that a picture of width x height pixels shows clear of everything, under camera_from_probe; returns how
   many, and in `looked` how many points it has looked at. */
EXPORT int locate(const PaperPoints *points, int width, int height, const double *pose, int32_t *looked)
{
    float column[CHUNK], row[CHUNK], right = (float)width - 1.5f, bottom = (float)height - 1.5f;
    Lens lens = lens_of(points->lens);
    Axes axes = axes_of(pose);
    int found = 0, most = (int)points->most;
    *looked = 0;
    for (int first = 0; first < points->count && found < most; first += CHUNK) {
        project_chunk(points, &lens, &axes, first, column, row);
        for (int i = 0; i < CHUNK && first + i < points->count && found < most; i++) {
            *looked = first + i + 1;
            /* not on the picture's border; nan is nowhere */
            if (!(column[i] >= 0.5f && row[i] >= 0.5f && column[i] < right && row[i] < bottom))
                continue;
            points->place[found] = first + i;
            points->pixel[2 * found] = (int32_t)(column[i] + 0.5f);
            points->pixel[2 * found + 1] = (int32_t)(row[i] + 0.5f);
            found++;
        }
    }
    return found;
}

static inline float code_at(const struct picture *picture, int plane, int wide, int x, int y)
{
    const uint8_t *row = row_of(picture, plane, y);
    return wide ? (float)((const uint16_t *)row)[x] : (float)row[x];
}

/* Encoded R'G'B' of `count` pixels (count, 2) into three rows, chroma as its nearest sample has it. */
EXPORT void read_pixels(const struct layout *layout, const struct picture *picture, int count, const int32_t *pixel,
                        float *restrict encoded)
{
    int wide = layout->wide, across = layout->columns.share, down = layout->rows.share;
    int grey = picture->planes[1] == NULL;
    float luma_scale = 1.0f / layout->luma_span, chroma_scale = 1.0f / layout->chroma_span;
    for (int i = 0; i < count; i++) {
        int x = pixel[2 * i], y = pixel[2 * i + 1];
        float luma = (code_at(picture, 0, wide, x, y) - layout->black) * luma_scale, cb = luma, cr = luma;
        if (!grey) {
            x = across == 2 ? x >> 1 : x / across;
            y = down == 2 ? y >> 1 : y / down;
            cb = (code_at(picture, 1, wide, x, y) - layout->neutral) * chroma_scale;
            cr = (code_at(picture, 2, wide, x, y) - layout->neutral) * chroma_scale;
        }
        for (int c = 0; c < 3; c++) {
            float value = grey ? luma : product(layout->rgb_from_ycc, c, luma, cb, cr);
            value = value > 0.0f ? value : 0.0f;
            encoded[c * count + i] = value < 1.0f ? value : 1.0f;
        }
    }
}

#endif
