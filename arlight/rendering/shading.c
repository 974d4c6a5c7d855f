/* The radiance of an object's vertices toward the camera: a matte body under a dielectric gloss, as object.vert and
   object.frag have it. */
#include "native.h"
#include "bounded.h"
#include "eight.h"
#include <string.h>

typedef struct {
    const float *position_mm; /* (3, n) probe frame */
    const float *normal;      /* (3, n) */
    const float *base_colour; /* (n, 4) */
    const float *openness;    /* (9, n) visibility, real spherical harmonics of the second order */
    const float *lit;         /* (lit_count, 4) radiance of a white matte surface at the first vertices */
    const float *gloss;       /* (side * side, 4) octahedral map of lobe-averaged radiance */
    const int32_t *ends;      /* (count - lit_count, 2) the two among those that each further vertex lies between */
    float *body;              /* (n, 4) radiance of the body before its texture */
    float *mirrored;          /* (n, 4) radiance of the gloss */
    float *scratch;           /* (4, n) place on the map, visibility there, gloss albedo */
    int64_t count, lit_count, side;
    double eye_mm[3], roughness, normal_reflectance;
} Shading;

/* 2^x for x <= 0, to 2e-5: the fit below needs no more. */
INLINE float two_to(float x)
{
    float whole = floorf(x), f = x - whole;
    float part = 1.0f + f * (0.6931472f + f * (0.2402265f + f * (0.0555041f + f * (0.0096181f + f * 0.0013333f))));
    int32_t bits = (int32_t)(greater(whole, -126.0f) + 127.0f) << 23;
    float scale;
    memcpy(&scale, &bits, sizeof scale);
    return part * scale;
}

/* Directional albedo of the gloss: the split-sum integral as B. Karis, "Physically Based Shading on Mobile" (2014),
   fits it. */
INLINE float gloss_albedo(float cosine, float roughness, float reflectance)
{
    float rx = 1.0f - roughness, ry = 0.0425f - 0.0275f * roughness;
    float rz = 1.04f - 0.572f * roughness, rw = -0.04f + 0.022f * roughness;
    float a = lesser(rx * rx, two_to(-9.28f * cosine)) * rx + ry;
    /* a matte surface has no grazing reflection either */
    float grazing = lesser(50.0f * reflectance, 1.0f);
    return lesser(greater(reflectance * (rz - 1.04f * a) + grazing * (rw + 1.04f * a), 0.0f), 1.0f);
}

/* Place of a direction on the octahedral map, in texels whose centres lie at integers, kept on the map. */
INLINE void octahedral_place(float x, float y, float z, float side, float *u, float *v)
{
    float scale = 1.0f / (fabsf(x) + fabsf(y) + fabsf(z));
    x *= scale, y *= scale;
    float folded_x = (x >= 0.0f ? 1.0f - fabsf(y) : fabsf(y) - 1.0f);
    float folded_y = (y >= 0.0f ? 1.0f - fabsf(x) : fabsf(x) - 1.0f);
    *u = ((z >= 0.0f ? x : folded_x) + 1.0f) * 0.5f * side - 0.5f;
    *v = ((z >= 0.0f ? y : folded_y) + 1.0f) * 0.5f * side - 0.5f;
    *u = lesser(greater(*u, 0.0f), side - 1.001f);
    *v = lesser(greater(*v, 0.0f), side - 1.001f);
}

/* Where on the map vertices find what they mirror, how freely they see there, and the share that is mirrored. */
INLINE void reflect(const Shading *s)
{
    int64_t n = s->count;
    const float *p = s->position_mm, *v = s->normal, *o = s->openness;
    float side = (float)s->side, roughness = (float)s->roughness, reflectance = (float)s->normal_reflectance;
    float ex = (float)s->eye_mm[0], ey = (float)s->eye_mm[1], ez = (float)s->eye_mm[2];
    float *restrict out = s->scratch;
    /* what is written is no part of what is read */
#pragma GCC ivdep
    for (int64_t i = 0; i < n; i++) {
        float x = ex - p[i], y = ey - p[n + i], z = ez - p[2 * n + i];
        float scale = 1.0f / sqrtf(x * x + y * y + z * z);
        x *= scale, y *= scale, z *= scale;
        float cosine = x * v[i] + y * v[n + i] + z * v[2 * n + i];
        float rx = 2.0f * cosine * v[i] - x, ry = 2.0f * cosine * v[n + i] - y, rz = 2.0f * cosine * v[2 * n + i] - z;
        float seen = 0.282095f * o[i] + 0.488603f * (ry * o[n + i] + rz * o[2 * n + i] + rx * o[3 * n + i]);
        seen += 1.092548f * (rx * ry * o[4 * n + i] + ry * rz * o[5 * n + i] + rx * rz * o[7 * n + i]);
        seen += 0.315392f * (3.0f * rz * rz - 1.0f) * o[6 * n + i] + 0.546274f * (rx * rx - ry * ry) * o[8 * n + i];
        octahedral_place(rx, ry, rz, side, out + i, out + n + i);
        out[2 * n + i] = lesser(greater(seen, 0.0f), 1.0f);
        out[3 * n + i] = gloss_albedo(greater(cosine, 0.02f), roughness, reflectance);
    }
}

/* The gloss's share (n,) of what is seen at cosines (n,) to the view. */
EXPORT HOT void gloss_albedos(
    const float *cosine, int64_t count, double roughness, double normal_reflectance, float *albedo)
{
    for (int64_t i = 0; i < count; i++)
        albedo[i] = gloss_albedo(greater(cosine[i], 0.02f), (float)roughness, (float)normal_reflectance);
}

/* Where on the map a vertex finds what it mirrors: bilinear. */
INLINE Four mirrored_at(const Shading *s, float u, float v)
{
    int32_t column = (int32_t)u, row = (int32_t)v;
    const Four *upper = (const Four *)s->gloss + row * s->side + column, *lower = upper + s->side;
    float right = u - (float)column;
    Four above = upper[0] + right * (upper[1] - upper[0]), below = lower[0] + right * (lower[1] - lower[0]);
    return above + (v - (float)row) * (below - above);
}

/* Mix the body's light with what the gloss mirrors. */
INLINE void mix(const Shading *s, int64_t i, Four matte)
{
    const float *scratch = s->scratch + i;
    float open = scratch[2 * s->count], albedo = scratch[3 * s->count];
    Four mirrored = mirrored_at(s, scratch[0], scratch[s->count]);
    ((Four *)s->mirrored)[i] = positive(mirrored) * (open * albedo);
    ((Four *)s->body)[i] = ((const Four *)s->base_colour)[i] * positive(matte) * (1.0f - albedo);
}

/* Radiance of the body and of the gloss. */
EXPORT HOT void shade(const Shading *s)
{
    const Four *lit = (const Four *)s->lit;
    const int32_t *ends = s->ends;
    reflect(s);
    for (int64_t i = 0; i < s->lit_count; i++)
        mix(s, i, lit[i]);
    for (int64_t i = s->lit_count; i < s->count; i++, ends += 2)
        mix(s, i, 0.5f * (lit[ends[0]] + lit[ends[1]]));
}
