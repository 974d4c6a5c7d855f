/* Small least squares, FITS at a time: one in each lane of a vector. */
#ifndef ARLIGHT_SMALL_FIT_H
#define ARLIGHT_SMALL_FIT_H

#include "native.h"

#define FITS 8
#define COLUMNS 16 /* at most */
#define RIGHTS 3   /* at most */
#define SINGULAR 1e-6 /* of a column's square: least that the columns before it must leave of it */

typedef double Fits __attribute__((vector_size(FITS * sizeof(double))));

typedef struct {
    int columns, rights;
    Fits normal[COLUMNS][COLUMNS];  /* lower triangle; overwritten */
    Fits right[RIGHTS][COLUMNS];
    Fits inverse[COLUMNS][COLUMNS]; /* of the normal matrix, lower triangle */
    Fits solved[RIGHTS][COLUMNS];
    Fits explained[RIGHTS];         /* right' solved: the part of the squares that the fit takes */
    double regular[FITS];           /* 1 where the columns can be told from each other, else 0 */
} SmallFits;

/* Replaces the normal matrices by their Cholesky factors, the diagonal by its reciprocal. */
INLINE void factorise_fits(SmallFits *f)
{
    for (int l = 0; l < FITS; l++)
        f->regular[l] = 1.0;
    for (int i = 0; i < f->columns; i++)
        for (int j = 0; j <= i; j++) {
            Fits rest = f->normal[i][j];
            for (int k = 0; k < j; k++)
                rest -= f->normal[i][k] * f->normal[j][k];
            if (j < i) {
                f->normal[i][j] = rest * f->normal[j][j];
                continue;
            }
            Fits own = f->normal[i][i];
            for (int l = 0; l < FITS; l++) {
                int good = rest[l] > SINGULAR * own[l] && rest[l] > 0.0;
                f->regular[l] = good ? f->regular[l] : 0.0;
                own[l] = good ? rest[l] : 1.0;
            }
            for (int l = 0; l < FITS; l++)
                own[l] = 1.0 / sqrt(own[l]);
            f->normal[i][i] = own;
        }
}

/* Replaces the factors by their inverses. */
INLINE void invert_factors(SmallFits *f)
{
    for (int j = 0; j < f->columns; j++)
        for (int i = j + 1; i < f->columns; i++) {
            Fits sum = f->normal[i][j] * f->normal[j][j];
            for (int k = j + 1; k < i; k++)
                sum += f->normal[i][k] * f->normal[k][j];
            f->normal[i][j] = -sum * f->normal[i][i];
        }
}

/* Solves all fits. */
static HOT void solve_fits(SmallFits *f)
{
    factorise_fits(f);
    invert_factors(f);
    for (int i = 0; i < f->columns; i++)
        for (int j = 0; j <= i; j++) {
            Fits sum = f->normal[i][i] * f->normal[i][j];
            for (int k = i + 1; k < f->columns; k++)
                sum += f->normal[k][i] * f->normal[k][j];
            f->inverse[i][j] = sum;
        }
    for (int c = 0; c < f->rights; c++) {
        f->explained[c] = 0.0 * f->right[c][0];
        for (int i = 0; i < f->columns; i++) {
            Fits sum = f->inverse[i][0] * f->right[c][0];
            for (int j = 1; j < f->columns; j++)
                sum += (i > j ? f->inverse[i][j] : f->inverse[j][i]) * f->right[c][j];
            f->solved[c][i] = sum;
            f->explained[c] += sum * f->right[c][i];
        }
    }
}

#endif
