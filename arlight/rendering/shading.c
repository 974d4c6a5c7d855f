/* The radiance of an object's vertices toward the camera: a matte body under a dielectric gloss, as object.vert and
   object.frag have it. */
#include "native.h"
#include "bounded.h"
#include <string.h>

typedef struct {
    const float *position_mm; /* (3, n) probe frame */
    const float *normal;      /* (3, n) */
    const float *base_colour; /* (3, n) */
    const float *openness;    /* (9, n) visibility, real spherical harmonics of the second order */
    const float *lit;         /* (3, stride) radiance of a white matte surface at the first `lit_count` vertices */
    const float *gloss;       /* (3, stride) octahedral map (side, side) of lobe-averaged radiance */
    const int32_t *ends;      /* (count - lit_count, 2) the two among those that each further vertex lies between */
    float *matte;             /* (3, n) of all of them */
    float *body;              /* (3, n) radiance of the body before its texture */
    float *mirrored;          /* (3, n) radiance of the gloss */
    float *scratch;           /* (4, n) place on the map, visibility there, gloss albedo */
    int64_t count, lit_count, stride, side;
    double eye_mm[3], roughness, normal_reflectance;
} Shading;

/* 2^x for x <= 0, to 2e-5: the fit below needs no more. */
static inline float two_to(float x)
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
static inline float gloss_albedo(float cosine, float roughness, float reflectance)
{
    float rx = 1.0f - roughness, ry = 0.0425f - 0.0275f * roughness;
    float rz = 1.04f - 0.572f * roughness, rw = -0.04f + 0.022f * roughness;
    float a = lesser(rx * rx, two_to(-9.28f * cosine)) * rx + ry;
    /* a matte surface has no grazing reflection either */
    float grazing = lesser(50.0f * reflectance, 1.0f);
    return lesser(greater(reflectance * (rz - 1.04f * a) + grazing * (rw + 1.04f * a), 0.0f), 1.0f);
}

/* Place of a direction on the octahedral map, in texels whose centres lie at integers, kept on the map. */
static inline void octahedral_place(float x, float y, float z, float side, float *u, float *v)
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
static inline void reflect(const Shading *s)
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

/* Light of one colour at the vertices that have none of their own. */
static inline void carry(const Shading *s, int channel)
{
    const float *lit = s->lit + channel * s->stride;
    const int32_t *ends = s->ends;
    float *restrict matte = s->matte + channel * s->count;
    memcpy(matte, lit, (size_t)s->lit_count * sizeof *matte);
    matte += s->lit_count;
    int64_t further = s->count - s->lit_count;
#pragma GCC ivdep
    for (int64_t i = 0; i < further; i++)
        matte[i] = 0.5f * (lit[ends[2 * i]] + lit[ends[2 * i + 1]]);
}

/* The gloss's share (n,) of what is seen at cosines (n,) to the view. */
EXPORT HOT void gloss_albedos(
    const float *cosine, int64_t count, double roughness, double normal_reflectance, float *albedo)
{
    for (int64_t i = 0; i < count; i++)
        albedo[i] = gloss_albedo(greater(cosine[i], 0.02f), (float)roughness, (float)normal_reflectance);
}

/* Mix one colour of the body's light with what the gloss mirrors, bilinear on its map. */
static inline void mix(const Shading *s, int channel)
{
    int64_t n = s->count;
    const float *u = s->scratch, *v = s->scratch + n, *open = s->scratch + 2 * n, *albedo = s->scratch + 3 * n;
    const float *map = s->gloss + channel * s->stride, *matte = s->matte + channel * n;
    const float *base = s->base_colour + channel * n;
    float *restrict body = s->body + channel * n, *restrict mirrored = s->mirrored + channel * n;
    int32_t side = (int32_t)s->side;
#pragma GCC ivdep
    for (int64_t i = 0; i < n; i++) {
        int32_t column = (int32_t)u[i], row = (int32_t)v[i], at = row * side + column;
        float fu = u[i] - (float)column, fv = v[i] - (float)row;
        float upper = map[at] * (1.0f - fu) + map[at + 1] * fu;
        float lower = map[at + side] * (1.0f - fu) + map[at + side + 1] * fu;
        mirrored[i] = greater(upper * (1.0f - fv) + lower * fv, 0.0f) * open[i] * albedo[i];
        body[i] = base[i] * greater(matte[i], 0.0f) * (1.0f - albedo[i]);
    }
}

/* Radiance of the body and of the gloss. */
EXPORT HOT void shade(const Shading *s)
{
    reflect(s);
    for (int channel = 0; channel < 3; channel++)
        carry(s, channel), mix(s, channel);
}
