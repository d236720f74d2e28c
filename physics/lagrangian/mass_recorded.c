/* M a = f as recorded, for the series of motions: with a constant inverse of the mass matrix, or,
   of few coordinates, with the elimination M = L D L^T. */
#include "autodiff/free.h"
#include "internal.h"

#include <stdlib.h>

static ad_var element(ad_var x, size_t i, size_t j)
{
    return ad_slice_cols(ad_slice_rows(x, i, 1), j, 1);
}

/* M^-1 f, with the constant diagonal M^-1. */
static ad_var times_diagonal(phys_motion *motion, size_t n, ad_var force)
{
    double *inverse = malloc(n * sizeof *inverse);
    if (!inverse)
        return ad_refuse(force.tape, AD_E_MEMORY, "out of memory");
    for (size_t k = 0; k < n; k++)
        inverse[k] = 1;
    phys_motion_solve_constant(motion, inverse);
    ad_var a = ad_mul(ad_const(force.tape, n, 1, inverse), force);
    free(inverse);
    return a;
}

/* M^-1 f, with the constant M^-1. */
static ad_var times_inverse(phys_motion *motion, size_t n, ad_var force)
{
    if (phys_motion_is_diagonal(motion))
        return times_diagonal(motion, n, force);
    double *rows = calloc(n * n, sizeof *rows), *inverse = calloc(n * n, sizeof *inverse);
    ad_var a;
    for (size_t j = 0; rows && inverse && j < n; j++) {
        rows[j * n + j] = 1;
        phys_motion_solve_constant(motion, rows + j * n);
    }
    for (size_t k = 0; rows && inverse && k < n * n; k++)
        inverse[k] = rows[k % n * n + k / n];
    if (rows && inverse)
        a = ad_matmul(ad_const(force.tape, n, n, inverse), false, force, false);
    else
        a = ad_refuse(force.tape, AD_E_MEMORY, "out of memory");
    AD_FREE(rows, inverse);
    return a;
}

/* The solution of M a = f by M = L D L^T, and D. */
static ad_var eliminate(size_t n, ad_var mass, ad_var force, ad_var *D)
{
    ad_var M[PHYS_ELIMINATED_MOST][PHYS_ELIMINATED_MOST], a[PHYS_ELIMINATED_MOST],
        d[PHYS_ELIMINATED_MOST];
    for (size_t i = 0; i < n; i++) {
        a[i] = element(force, i, 0);
        for (size_t j = 0; j <= i; j++)
            M[i][j] = element(mass, i, j);
    }
    for (size_t k = 0; k < n; k++) {
        d[k] = M[k][k];
        for (size_t i = k + 1; i < n; i++) {
            ad_var l = ad_div(M[i][k], d[k]);
            a[i] = ad_sub(a[i], ad_mul(l, a[k]));
            for (size_t j = k + 1; j <= i; j++)
                M[i][j] = ad_sub(M[i][j], ad_mul(l, M[j][k]));
            M[k][i] = l; /* above the diagonal */
        }
        a[k] = ad_div(a[k], d[k]);
    }
    for (size_t k = n; k-- > 0;)
        for (size_t i = k + 1; i < n; i++)
            a[k] = ad_sub(a[k], ad_mul(M[k][i], a[i]));
    *D = ad_concat_rows(n, d);
    return ad_concat_rows(n, a);
}

/* The same with a diagonal M, of any size. */
static ad_var divide(const phys_motion *motion, size_t n, ad_var mass, ad_var force, ad_var *D)
{
    uint32_t *places = malloc(n * sizeof *places);
    if (!places)
        return ad_refuse(force.tape, AD_E_MEMORY, "out of memory");
    for (size_t k = 0; k < n; k++)
        places[k] = (uint32_t)phys_motion_mass_place(motion, k, k);
    *D = ad_gather_rows(ad_reshape(mass, n * ad_cols(mass), 1), n, places);
    free(places);
    return ad_div(force, *D);
}

ad_var phys_record_solution(phys_motion *motion, size_t n, bool constant, ad_var mass, ad_var force,
                            ad_var *D)
{
    *D = mass;
    return constant                    ? times_inverse(motion, n, force)
           : n <= PHYS_ELIMINATED_MOST ? eliminate(n, mass, force, D)
                                       : divide(motion, n, mass, force, D);
}
