/* How far a block's rows may stray from the model: noise of the pixels, and what the model leaves out.

   Noise differs from pixel to pixel and is told by the pixels. What model and codec leave out is alike in neighbouring
   pixels, in blocks of one frequency, and in neighbouring frames; how much it is, the rows' residuals tell. The same
   formulas as in row_noise.py, where the usual errors are explained. */
#ifndef ARLIGHT_ROW_NOISE_H
#define ARLIGHT_ROW_NOISE_H

#include "channel_fit.h"

/* Logarithm of what a Gaussian blur with a sharpness leaves of a harmonic. */
INLINE lanes blur_log(const MeasuredBlocks *m, int64_t block, int harmonic, const double *nuisance)
{
    lanes x = load(m->cycles + block), y = load(m->cycles + m->stride + block);
    lanes square = (x * x + y * y) * (4.0 * PI * PI * harmonic * harmonic);
    return nuisance[1] * load(m->fineness + (harmonic - 1) * m->stride + block) - 0.5 * nuisance[0] * square;
}

/* Fills MODEL, INFERRED, TRUST and NOISE. */
static HOT void row_noise(const ChannelFit *f)
{
    const MeasuredBlocks *m = f->m;
    const UsualErrors *usual = &m->usual;
    const int64_t n = m->stride, c = f->channel;
    const double white = m->white[c], stray = usual->stray * usual->stray * white * white;
    const double bound = fmax(stray, usual->noisy * m->quiet[c]);
    for (int64_t b = 0; b < m->blocks; b += LANES) {
        lanes noise = load(m->noise + c * n + b), lamps = larger(noise - bound, splat(0.0));
        put(f, NOISE, b, noise + (usual->lamp_pixels - 1.0) * lamps);
        lanes trust = c == GREEN ? splat(1.0) : load(m->trust + b);
        lanes coarse = indicator(trust < 1.0) * (white * white);
        lanes mean = load(f->mean_model + b) * white;
        put(f, MODEL, b, mean * mean + usual->chroma_mean * usual->chroma_mean * coarse);
        put(f, TRUST, b, larger(trust, splat(usual->least_trust)));
        lanes x = load(m->cycles + b), y = load(m->cycles + n + b), square = x * x + y * y;
        for (int h = 1; h <= HARMONICS; h++) {
            lanes cosine = load(m->measured + (c * ROWS + 2 * h - 1) * n + b);
            lanes sine = load(m->measured + (c * ROWS + 2 * h) * n + b), swing = cosine * cosine + sine * sine;
            lanes model = white * (usual->swing_model + usual->codec * 4.0 * h * h * square);
            lanes left = load(m->left_log + (h - 1) * n + b) + blur_log(m, b, h, f->nuisance);
            lanes doubt = usual->transfer * larger(left, splat(usual->faintest));
            lanes chroma = usual->chroma_swing * usual->chroma_swing * coarse;
            put(f, MODEL + h, b, model * model + doubt * doubt * swing + chroma);
            lanes unseen = usual->color_spread * (1.0 - trust);
            put(f, INFERRED + h - 1, b, unseen * unseen * swing);
        }
    }
}

#endif
