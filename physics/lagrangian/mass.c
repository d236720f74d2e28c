/* The mass matrix (mass.h). */
#include "mass.h"
#include "autodiff/free.h"
#include "physics/linear/linear.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void phys_mass_columns(size_t n, const double *M, double *column)
{
    for (size_t k = 0; k < n; k++) {
        column[k] = 0;
        for (size_t i = 0; i < n; i++)
            column[k] = fmax(column[k], fabs(M[k * n + i]));
    }
}

double phys_mass_condition(size_t n, const double *column, const double *factor, size_t stride,
                           size_t *worst)
{
    double most = 1;
    *worst = 0;
    for (size_t k = 0; k < n; k++) {
        double pivot = fabs(factor[k * stride]);
        double ratio = pivot > 0 ? column[k] / pivot : (double)INFINITY;
        if (ratio > most) {
            most = ratio;
            *worst = k;
        }
    }
    return most;
}

/* ---- of any number of coordinates ---- */

/* A band of less than half of the numbers of the whole. */
static bool is_band(const struct phys_mass *m)
{
    return 2 * PHYS_BAND_ROWS(m->pattern.width) < m->pattern.n;
}

/* How far apart columns of the factor are; without a beginning, where its diagonal is. */
static size_t stride(const struct phys_mass *m)
{
    return m->diagonal ? 1 : is_band(m) ? PHYS_BAND_ROWS(m->pattern.width) : m->pattern.n + 1;
}

static size_t first_pivot(const struct phys_mass *m)
{
    return !m->diagonal && is_band(m) ? 2 * m->pattern.width : 0;
}

bool phys_mass_new(struct phys_mass *mass, const struct phys_system *system, size_t few)
{
    const size_t n = system->dof;
    struct phys_mass *m = mass;
    *m = (struct phys_mass){0};
    if (!phys_coupling_new(&m->pattern, system, PHYS_COUPLING_MASSES, few))
        return false;
    const size_t lanes = m->pattern.colours;
    const size_t rows = m->pattern.width == 0 ? 1
                        : is_band(m)          ? PHYS_BAND_ROWS(m->pattern.width)
                                              : n;
    if (n > SIZE_MAX / sizeof(double) / (lanes + rows + 2))
        return false;
    m->values = malloc(n * (lanes + rows + 2) * sizeof *m->values);
    m->pivots = malloc(n * sizeof *m->pivots);
    if (!m->values || !m->pivots)
        return false;
    m->factor = m->values + n * lanes;
    m->column = m->factor + n * rows;
    m->work = m->column + n;
    return true;
}

bool phys_mass_is_whole(const struct phys_mass *mass, size_t few)
{
    return mass->pattern.n > few && mass->pattern.colours == mass->pattern.n;
}

void phys_mass_free(struct phys_mass *mass)
{
    phys_pattern_free(&mass->pattern);
    AD_FREE(mass->values, mass->pivots);
}

/* Entry (i, j), which the pattern has. */
static double entry(const struct phys_mass *m, size_t i, size_t j)
{
    return m->values[i * m->pattern.colours + m->pattern.colour[j]];
}

double phys_mass_entry(const struct phys_mass *mass, size_t i, size_t j)
{
    return phys_pattern_has(&mass->pattern, i, j) ? entry(mass, i, j) : 0;
}

bool phys_mass_is_diagonal(const struct phys_mass *mass)
{
    const struct phys_pattern *p = &mass->pattern;
    for (size_t j = 0; j < p->n; j++)
        for (size_t k = p->start[j]; k < p->start[j + 1]; k++)
            if (p->row[k] != j && entry(mass, p->row[k], j) != 0)
                return false;
    return true;
}

/* 1 + up to twice `share` or less, irregularly, alike for (i, j) and (j, i). Of opposite sign on
   the diagonal, the changes of a pivot that cancels add up. */
static double rounded(size_t n, double share, size_t i, size_t j)
{
    const double irregular = 0.6180339887498949;
    double u = 1 + fmod(irregular * (double)(i < j ? j * n + i : i * n + j), 1);
    return 1 + (i == j ? share * u : -share * u);
}

/* The values into the matrix to be factored, and the largest of each column. */
static void place_entries(struct phys_mass *m, double rounding)
{
    const struct phys_pattern *p = &m->pattern;
    const size_t n = p->n;
    if (!m->diagonal)
        memset(m->factor, 0, n * (is_band(m) ? PHYS_BAND_ROWS(p->width) : n) * sizeof *m->factor);
    for (size_t j = 0; j < n; j++) {
        const size_t to = p->place[j];
        m->column[to] = 0;
        for (size_t k = p->start[j]; k < p->start[j + 1]; k++) {
            const size_t i = p->row[k], from = p->place[i];
            if (m->diagonal && i != j)
                continue;
            const double x =
                entry(m, i, j) * (rounding > 0 && !m->diagonal ? rounded(n, rounding, i, j) : 1);
            m->factor[m->diagonal  ? to
                      : is_band(m) ? PHYS_BAND(p->width, from, to)
                                   : from * n + to] = x;
            m->column[to] = fmax(m->column[to], fabs(x));
        }
    }
}

void phys_mass_factor(struct phys_mass *mass, double rounding)
{
    struct phys_mass *m = mass;
    const struct phys_pattern *p = &m->pattern;
    size_t worst;
    m->diagonal = phys_mass_is_diagonal(m);
    place_entries(m, rounding);
    if (!m->diagonal && is_band(m))
        phys_lapack_band_factor(p->n, p->width, m->factor, m->pivots);
    else if (!m->diagonal)
        phys_lapack_lu_factor(p->n, m->factor, m->pivots);
    m->condition =
        phys_mass_condition(p->n, m->column, m->factor + first_pivot(m), stride(m), &worst);
    m->worst = p->order[worst];
    m->largest = m->column[worst];
}

void phys_mass_solve(const struct phys_mass *mass, double *b)
{
    const struct phys_mass *m = mass;
    const struct phys_pattern *p = &m->pattern;
    for (size_t k = 0; k < p->n; k++)
        m->work[p->place[k]] = b[k];
    if (!m->diagonal && is_band(m))
        phys_lapack_band_solve(p->n, p->width, m->factor, m->pivots, m->work);
    else if (!m->diagonal)
        phys_lapack_lu_solve(p->n, m->factor, m->pivots, m->work);
    for (size_t k = 0; k < p->n && m->diagonal; k++)
        m->work[k] /= m->factor[k];
    for (size_t k = 0; k < p->n; k++)
        b[k] = m->work[p->place[k]];
}
