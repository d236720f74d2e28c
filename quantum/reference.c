/* A packet by Schroedinger's equation alone, as a reference for sums over paths: Strang splitting
   with the kinetic energy in Fourier space (Feit, Fleck, Steiger, J. Comput. Phys. 47, 1982). Steps
   are halved until two Richardson extrapolations agree, the grid is refined until the highest wave
   numbers are empty, and open boxes are widened until their ends are empty. */
#include "fft.h"
#include "autodiff/sized.h"
#include "internal.h"

#include <complex.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { FIRST_STEPS = 32, MOST_POINTS = 1 << 16 };

static const double rough = 1e-2;
/* Largest number of points times slices for a reference. */
static const double worth = 2e8;

struct split {
    const struct qm_slice *slice;
    size_t m; /* points of the period, a power of two */
    double origin, period;
    bool mirrored; /* the second half of the period is the first one's mirror image */
    bool open;
    double mass;
    double *V;       /* [m] */
    double *re, *im; /* [m] */
    double *start;   /* [2 m] */
    struct qm_fft fft;
};

static void split_free(struct split *s)
{
    free(s->V);
    qm_fft_free(&s->fft);
}

static double place(const struct split *s, size_t j)
{
    return s->origin + s->period * (double)j / (double)s->m;
}

static enum ad_status fill(struct split *s, const struct qm_gaussian *packet,
                           struct ad_error *error)
{
    size_t m = s->m, half = s->mirrored ? m / 2 + 1 : m;
    double h = s->period / (double)m;
    const struct qm_grid *box = &s->slice->grid;
    struct qm_grid grid = {s->origin - h / 2, s->origin - h / 2 + h * (double)half, half};
    qm_complex *psi = malloc(half * sizeof *psi);
    if (!psi)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu points", m);
    if (qm_potential(s->slice->system, &grid, s->V, &s->mass, error) == AD_OK &&
        qm_packet_wound(s->slice, &grid, packet, 1, 0, psi, error) == AD_OK) {
        for (size_t j = 0; j < m; j++) {
            size_t i = j < half ? j : m - j;
            double x = place(s, i), sign = j < half ? 1 : -1;
            bool inside = s->open || (x >= box->low && x <= box->high);
            if (s->mirrored && (j == 0 || j == m / 2))
                inside = false;
            s->V[j] = s->V[i];
            s->start[j] = inside ? sign * creal(psi[i]) : 0;
            s->start[m + j] = inside ? sign * cimag(psi[i]) : 0;
            if (!isfinite(s->V[j]))
                ad_fail(error, AD_E_NONFINITE, "the potential at x = %g is not finite", x);
        }
    }
    free(psi);
    return error->status;
}

static enum ad_status split_new(const struct qm_slice *slice, const struct qm_gaussian *packet,
                                size_t m, double width, struct split *s, struct ad_error *error)
{
    double box = slice->grid.high - slice->grid.low;
    bool open = slice->walls == QM_OPEN || slice->absorb > 0;
    bool mirrored = !open && slice->walls == QM_REFLECT;
    *s = (struct split){.slice = slice, .m = m, .open = open, .mirrored = mirrored};
    s->period = open ? width * box : mirrored ? 2 * box : box;
    s->origin = open ? 0.5 * (slice->grid.low + slice->grid.high - s->period) : slice->grid.low;
    s->V = calloc(5 * m, sizeof *s->V);
    if (!s->V)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu points", m);
    s->re = s->V + m;
    s->im = s->re + m;
    s->start = s->im + m;
    if (qm_fft_new(m, &s->fft, error) == AD_OK)
        fill(s, packet, error);
    return error->status;
}

static void turn(size_t m, const double *phase, double *re, double *im)
{
    for (size_t j = 0; j < m; j++) {
        double c = cos(phase[j]), d = sin(phase[j]), x = re[j];
        re[j] = x * c - im[j] * d;
        im[j] = x * d + im[j] * c;
    }
}

/* re, im times the factors c + i d */
static void multiply(size_t m, const double *c, const double *d, double *re, double *im)
{
    for (size_t j = 0; j < m; j++) {
        double x = re[j];
        re[j] = x * c[j] - im[j] * d[j];
        im[j] = x * d[j] + im[j] * c[j];
    }
}

/* Share of the wave in [from, to) of its points. */
static double share(const struct split *s, size_t from, size_t to)
{
    double sum = 0, all = 0;
    for (size_t j = 0; j < s->m; j++) {
        double p = s->re[j] * s->re[j] + s->im[j] * s->im[j];
        all += p;
        sum += j >= from && j < to ? p : 0;
    }
    return all > 0 ? sum / all : 0;
}

struct limits {
    double ends, high; /* largest shares seen at the ends of an open box, at high wave numbers */
};

static bool off_grid(const struct limits *seen, double wanted)
{
    return seen->ends > wanted * wanted || seen->high > wanted * wanted;
}

/* The packet after `steps` steps of t / steps, in re and im. */
static enum ad_status follow(struct split *s, double t, size_t steps, struct limits *seen,
                             struct ad_error *error)
{
    size_t m = s->m, every = steps / 16 + 1;
    double dt = t / (double)steps, hbar = s->slice->hbar;
    double *phase = malloc(5 * m * sizeof *phase);
    if (!phase)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu points", m);
    double *vc = phase + m, *vs = vc + m, *kc = vs + m, *ks = kc + m;
    for (size_t j = 0; j < m; j++) {
        double k = 2 * M_PI / s->period * (j < m / 2 ? (double)j : (double)j - (double)m);
        double kinetic = -hbar * k * k * dt / (2 * s->mass);
        phase[j] = -s->V[j] * dt / (2 * hbar);
        vc[j] = cos(2 * phase[j]), vs[j] = sin(2 * phase[j]);
        kc[j] = cos(kinetic) / (double)m, ks[j] = sin(kinetic) / (double)m;
    }
    memcpy(s->re, s->start, 2 * m * sizeof *s->re);
    turn(m, phase, s->re, s->im);
    for (size_t k = 1; k <= steps; k++) {
        qm_fft_run(&s->fft, s->re, s->im);
        if (k % every == 0 || k == 1)
            seen->high = fmax(seen->high, share(s, m / 4, m - m / 4));
        multiply(m, kc, ks, s->re, s->im);
        qm_fft_run(&s->fft, s->im, s->re);
        if (k < steps)
            multiply(m, vc, vs, s->re, s->im);
        if (s->open && (k % every == 0 || k == steps))
            seen->ends = fmax(seen->ends, share(s, 0, m / 16) + share(s, m - m / 16, m));
    }
    turn(m, phase, s->re, s->im);
    free(phase);
    return AD_OK;
}

/* The trigonometric polynomial through the points, at those of the slice's grid; and its norm. */
static double interpolate(struct split *s, qm_complex *psi)
{
    size_t m = s->m, n = s->slice->grid.n;
    double norm = 0;
    for (size_t j = 0; j < m; j++)
        norm += s->re[j] * s->re[j] + s->im[j] * s->im[j];
    qm_fft_run(&s->fft, s->re, s->im);
    for (size_t a = 0; a < n; a++) {
        double u = 2 * M_PI * (qm_x(&s->slice->grid, a) - s->origin) / s->period;
        qm_complex z = cexp(I * u), up = 1, sum = s->re[0] + I * s->im[0];
        for (size_t j = 1; j < m / 2; j++) {
            up *= z;
            sum += up * (s->re[j] + I * s->im[j]) + conj(up) * (s->re[m - j] + I * s->im[m - j]);
        }
        psi[a] = sum / (double)m;
    }
    return norm * s->period / (double)m / (s->mirrored ? 2 : 1);
}

static double apart(const struct qm_grid *grid, const qm_complex *a, const qm_complex *b)
{
    double sum = 0;
    for (size_t k = 0; k < grid->n; k++)
        sum += pow(cabs(a[k] - b[k]), 2);
    return sqrt(sum * qm_dx(grid));
}

/* Halves the steps until psi is known to `wanted`, or, as far as `rough`, another grid is needed:
   seen is of the last run. */
static enum ad_status converge(struct split *s, double t, double wanted, bool last, qm_complex *psi,
                               struct qm_reference *reference, struct limits *seen,
                               struct ad_error *error)
{
    const struct qm_grid *grid = &s->slice->grid;
    size_t n = grid->n;
    qm_complex *now = calloc(3 * n, sizeof *now);
    if (!now)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu points", n);
    qm_complex *before = now + n, *better = before + n;
    reference->uncertainty = INFINITY;
    for (size_t steps = FIRST_STEPS, level = 0; (double)steps * (double)s->m <= worth;
         steps *= 2, level++) {
        *seen = (struct limits){0};
        if (follow(s, t, steps, seen, error) != AD_OK)
            break;
        reference->norm = interpolate(s, now);
        for (size_t a = 0; a < n; a++) {
            better[a] = level ? (4 * now[a] - before[a]) / 3 : now[a];
            before[a] = now[a];
        }
        if (level > 1)
            reference->uncertainty = apart(grid, better, psi);
        memcpy(psi, better, n * sizeof *psi);
        if (reference->uncertainty <= (last || !off_grid(seen, wanted) ? wanted : rough))
            break;
    }
    free(now);
    return error->status;
}

enum ad_status qm_reference(const struct qm_slice *slice, const struct qm_gaussian *packet,
                            double t, double wanted, qm_complex *psi,
                            struct qm_reference *reference, struct ad_error *error)
{
    double width = 2;
    if (AD_LACKS(error, packet, psi, reference))
        return error->status;
    *reference = (struct qm_reference){.uncertainty = INFINITY};
    if (qm_slice_check(slice, error) != AD_OK)
        return error->status;
    AD_OWN(qm_slice, slice, threads, error);
    if (!(packet->sigma > 0) || !isfinite(packet->x + packet->p) || !(t >= 0) || !isfinite(t))
        return ad_fail(error, AD_E_ARGUMENT,
                       "reference: expected finite numbers, a width above 0 and a time from 0 on, "
                       "got packet %g,%g,%g, t = %g",
                       packet->x, packet->sigma, packet->p, t);
    if (!(wanted > 0))
        return ad_fail(error, AD_E_ARGUMENT, "reference: expected a wanted error above 0, got %g",
                       wanted);
    size_t m = 128;
    while (m < 2 * slice->grid.n && m < MOST_POINTS)
        m *= 2;
    for (bool last = false; !last && error->status == AD_OK; m *= 2) {
        struct split split;
        struct limits seen = {0};
        last = 2 * m > MOST_POINTS;
        if (split_new(slice, packet, m, width, &split, error) == AD_OK)
            converge(&split, t, wanted, last, psi, reference, &seen, error);
        split_free(&split);
        reference->uncertainty += sqrt(seen.high) + sqrt(seen.ends);
        last = last || !off_grid(&seen, wanted);
        /* what the grid cannot resolve is seen at the ends, too, wherever they are */
        width *= seen.ends > wanted * wanted && !(seen.high > wanted * wanted) ? 2 : 1;
    }
    return error->status;
}
