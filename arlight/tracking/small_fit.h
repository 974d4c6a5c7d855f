/* Small least squares, several at a time. */
#ifndef ARLIGHT_SMALL_FIT_H
#define ARLIGHT_SMALL_FIT_H

#include "native.h"

#define FITS 8      /* fits that are solved together */
#define COLUMNS 16  /* at most */
#define RIGHTS 3    /* at most */
#define EACH_FIT for (int l = 0; l < FITS; l++)
#define SINGULAR 1e-6 /* of a column's square: what the columns before it may leave of it */

typedef double Fits[FITS];

typedef struct {
    int columns, rights;
    Fits normal[COLUMNS][COLUMNS]; /* lower triangle */
    Fits right[RIGHTS][COLUMNS];
    Fits inverse[COLUMNS][COLUMNS]; /* of the normal matrix; lower triangle */
    Fits solved[RIGHTS][COLUMNS];
    Fits explained[RIGHTS];        /* right' solved: the part of the squares that the fit takes */
    Fits regular;                  /* 1 where the columns can be told from each other, else 0 */
} SmallFits;

/* Replaces the normal matrices by the inverses of their Cholesky factors. */
static inline void invert_factors(SmallFits *f)
{
    EACH_FIT f->regular[l] = 1.0;
    for (int i = 0; i < f->columns; i++) {
        for (int j = 0; j <= i; j++) {
            Fits rest;
            EACH_FIT rest[l] = f->normal[i][j][l];
            for (int k = 0; k < j; k++)
                EACH_FIT rest[l] -= f->normal[i][k][l] * f->normal[j][k][l];
            if (j < i)
                EACH_FIT f->normal[i][j][l] = rest[l] * f->normal[j][j][l];
            else
                EACH_FIT
                {
                    int good = (rest[l] > SINGULAR * f->normal[i][i][l]) & (rest[l] > 0.0);
                    f->regular[l] = good ? f->regular[l] : 0.0;
                    f->normal[i][i][l] = 1.0 / sqrt(good ? rest[l] : 1.0);
                }
        }
    }
    /* the diagonal holds reciprocals; below it the factor becomes its own inverse */
    for (int j = 0; j < f->columns; j++)
        for (int i = j + 1; i < f->columns; i++) {
            Fits sum = {0.0};
            for (int k = j; k < i; k++)
                EACH_FIT sum[l] += f->normal[i][k][l] * f->normal[k][j][l];
            EACH_FIT f->normal[i][j][l] = -sum[l] * f->normal[i][i][l];
        }
}

/* Solves all fits. */
static HOT void solve_fits(SmallFits *f)
{
    invert_factors(f);
    for (int i = 0; i < f->columns; i++)
        for (int j = 0; j <= i; j++) {
            Fits sum = {0.0};
            for (int k = i; k < f->columns; k++)
                EACH_FIT sum[l] += f->normal[k][i][l] * f->normal[k][j][l];
            EACH_FIT f->inverse[i][j][l] = sum[l];
        }
    for (int c = 0; c < f->rights; c++) {
        EACH_FIT f->explained[c][l] = 0.0;
        for (int i = 0; i < f->columns; i++) {
            Fits sum = {0.0};
            for (int j = 0; j < f->columns; j++) {
                const double *of = i > j ? f->inverse[i][j] : f->inverse[j][i];
                EACH_FIT sum[l] += of[l] * f->right[c][j][l];
            }
            EACH_FIT
            {
                f->solved[c][i][l] = sum[l];
                f->explained[c][l] += sum[l] * f->right[c][i][l];
            }
        }
    }
}

#endif
