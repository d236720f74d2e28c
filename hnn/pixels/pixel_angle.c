/* The angle of a rod in a frame: a rendered rod of angle phi and brightness a is fitted to it.

   The minimum over a of |f - a r(phi)|^2 is |f|^2 - <f,r>^2/<r,r>. The best of evenly spaced angles
   starts a Gauss-Newton iteration in phi with a at its minimum (variable projection: G. Golub, V.
   Pereyra, SIAM J. Numer. Anal. 10, 413, 1973). It ends where <f - a r, r'> = 0, so a rendered
   frame gives its exact angle, although r' is a difference. */
#include "pixel_energy.h"

#include <math.h>
#include <stdlib.h>

enum { TEMPLATES = 128, ITERATIONS = 30 };

static const double difference = 1e-3, converged = 1e-7;

struct fitting {
    const struct hnn_rod *rod;
    size_t height, width;
    double norm[TEMPLATES];    /* <r,r> */
    float *templates;          /* [TEMPLATES x height x width] */
    float *here, *less, *more; /* r at an angle, and a little to both sides */
};

static double template_angle(size_t k)
{
    const double turn = 2 * acos(-1);
    return turn * ((double)(k + 1) / TEMPLATES - 0.5);
}

static double product(size_t n, const float *a, const float *b)
{
    double sum = 0;
#pragma omp simd reduction(+ : sum)
    for (size_t k = 0; k < n; k++)
        sum += (double)a[k] * b[k];
    return sum;
}

static void draw(const struct fitting *f, double angle, float *pixels)
{
    hnn_rod_draw(f->rod, angle, f->height, f->width, pixels);
}

static enum ad_status prepare(struct fitting *f, struct ad_error *error)
{
    size_t area = f->height * f->width;
    f->templates = malloc((TEMPLATES + 3) * area * sizeof *f->templates);
    if (!f->templates)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    for (size_t k = 0; k < TEMPLATES; k++) {
        float *r = f->templates + k * area;
        draw(f, template_angle(k), r);
        f->norm[k] = product(area, r, r);
    }
    f->here = f->templates + TEMPLATES * area;
    f->less = f->here + area;
    f->more = f->less + area;
    return AD_OK;
}

/* The best template's angle; NaN where none of them has anything in common with the frame. */
static double best_template(const struct fitting *f, const float *frame, double *gain)
{
    size_t area = f->height * f->width, best = TEMPLATES;
    *gain = 0;
    for (size_t k = 0; k < TEMPLATES; k++) {
        double fr = product(area, frame, f->templates + k * area);
        if (fr > 0 && fr * fr > *gain * f->norm[k]) {
            *gain = fr * fr / f->norm[k];
            best = k;
        }
    }
    return best < TEMPLATES ? template_angle(best) : NAN;
}

/* One step of the iteration; `gain` is <f,r>^2/<r,r> at the angle it starts from. */
static double gauss_newton(const struct fitting *f, const float *frame, double angle, double *gain)
{
    size_t area = f->height * f->width;
    draw(f, angle, f->here);
    draw(f, angle - difference, f->less);
    draw(f, angle + difference, f->more);
    double fr = 0, fd = 0, rr = 0, rd = 0, dd = 0;
#pragma omp simd reduction(+ : fr, fd, rr, rd, dd)
    for (size_t k = 0; k < area; k++) {
        double r = f->here[k], d = ((double)f->more[k] - f->less[k]) / (2 * difference);
        fr += frame[k] * r;
        fd += frame[k] * d;
        rr += r * r;
        rd += r * d;
        dd += d * d;
    }
    double a = fr / rr;
    *gain = fr > 0 ? fr * a : 0;
    return (fd - a * rd) / (a * (dd - rd * rd / rr));
}

/* Far from any rod the iteration may go astray: it stays within a template's neighbourhood and
   counts only where it makes the fit better. */
static double fit(const struct fitting *f, const float *frame)
{
    const double reach = 8 * atan(1) / TEMPLATES;
    double gain, best_gain, start = best_template(f, frame, &best_gain), best = start;
    double angle = start, step = INFINITY;
    for (int k = 0; k < ITERATIONS && fabs(step) > converged; k++) {
        step = gauss_newton(f, frame, angle, &gain);
        if (gain >= best_gain) {
            best_gain = gain;
            best = angle;
        }
        if (!(fabs(angle + step - start) <= reach))
            break;
        angle += step;
    }
    return best;
}

enum ad_status hnn_rod_angles(const struct hnn_rod *rod, size_t height, size_t width, size_t n,
                              const float *pixels, double *angle, struct ad_error *error)
{
    struct fitting f = {.rod = rod, .height = height, .width = width};
    if (!AD_LACKS(error, rod, pixels, angle) && hnn_rod_check(rod, error) == AD_OK &&
        prepare(&f, error) == AD_OK)
        for (size_t k = 0; k < n; k++)
            angle[k] = fit(&f, pixels + k * height * width);
    free(f.templates);
    return error->status;
}
