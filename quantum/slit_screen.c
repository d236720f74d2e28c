/* The intensity on the screen of the double slit, beside the closed form for thin slits (slit.h).
 */
#include "slit.h"

#include <complex.h>
#include <math.h>

/* |sum of two spread Gaussians|^2, where one has spread by z = 1 + i theta. */
static void fill_expected(struct qm_slit *s, double most)
{
    const struct qm_slit_setup *p = s->setup;
    double theta = s->setup->hbar * p->flight / (2 * p->mass * p->sigma * p->sigma), highest = 0;
    for (size_t b = 0; b < s->y.n; b++) {
        qm_complex sum = 0;
        for (int side = -1; side <= 1; side += 2) {
            double u = (qm_x(&s->y, b) - side * p->apart / 2) / (2 * p->sigma);
            sum += cexp(-u * u / (1 + I * theta));
        }
        s->expected[b] = creal(sum * conj(sum));
        highest = fmax(highest, s->expected[b]);
    }
    for (size_t b = 0; b < s->y.n; b++)
        s->expected[b] *= most / highest;
}

/* Where the parabola through a point and its neighbours is least. */
static double valley(const struct qm_slit *s, size_t b)
{
    const double *at = s->screen + b;
    double bend = at[-1] - 2 * at[0] + at[1];
    return qm_x(&s->y, b) + 0.5 * (at[-1] - at[1]) / bend * qm_dx(&s->y);
}

/* The distance between the dark lines on both sides of the middle. */
static double measure_fringe(const struct qm_slit *s)
{
    size_t up = s->y.n / 2, down = s->y.n / 2 - 1;
    while (up + 1 < s->y.n && s->screen[up + 1] < s->screen[up])
        up++;
    while (down > 0 && s->screen[down - 1] < s->screen[down])
        down--;
    return up + 1 < s->y.n && down > 0 ? valley(s, up) - valley(s, down) : (double)NAN;
}

void qm_slit_measure(struct qm_slit *s)
{
    if (!s || !s->psi)
        return;
    const struct qm_slit_setup *p = s->setup;
    double at = (s->setup->speed * s->setup->flight - s->x.low) / qm_dx(&s->x), most = 0;
    size_t row = (size_t)at;
    for (size_t b = 0; b < s->y.n; b++) {
        qm_complex z = s->psi[row * s->y.n + b];
        s->screen[b] = creal(z * conj(z));
        most = fmax(most, s->screen[b]);
    }
    s->norm = 0;
    for (size_t k = 0; k < s->x.n * s->y.n; k++)
        s->norm += s->density[(s->frames - 1) * s->x.n * s->y.n + k];
    s->norm *= qm_dx(&s->x) * qm_dx(&s->y);
    s->fringe = measure_fringe(s);
    s->closed = qm_exact_fringe(p->mass, p->hbar, p->apart, p->sigma, p->flight);
    fill_expected(s, most);
}
