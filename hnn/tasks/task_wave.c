/* A wave, q_tt = k q_xx, on sites h apart, of mass 1: H = sum p^2/2 + k ((q_next - q)/h)^2/2; a
   ring of length 2 pi, or a string of length pi between walls. Mode m turns at sqrt(k) 2/h sin(m
   h/2): near m sqrt(k). M. Cranmer et al., arXiv 2003.04630, learn such a wave. */
#include "task.h"

#include <math.h>

enum { RING = 32, STRING = 31, MODES = 4 };

static ad_var energy(ad_var q, ad_var p, ad_var next, double k, double h)
{
    ad_var stretch = ad_sum_rows(ad_square(ad_sub(next, q)));
    return ad_mul(0.5, ad_add(ad_sum_rows(ad_square(p)), ad_mul(k / (h * h), stretch)));
}

static ad_var ring(ad_var q, ad_var p, ad_var t, const void *params)
{
    (void)t;
    ad_var next = ad_concat_rows(2, (ad_var[]){ad_slice_rows(q, 1, RING - 1), ad_row(q, 0)});
    return energy(q, p, next, *(const double *)params, 2 * M_PI / RING);
}

static ad_var string(ad_var q, ad_var p, ad_var t, const void *params)
{
    (void)t;
    ad_var wall = ad_mul(0.0, ad_row(q, 0));
    return energy(ad_concat_rows(2, (ad_var[]){wall, q}), p, ad_concat_rows(2, (ad_var[]){q, wall}),
                  *(const double *)params, M_PI / (STRING + 1));
}

/* The longest modes: m of amplitudes between both radii, over m, at random phases. */
static void start(struct phys_random *random, const struct hnn_sampling *s, size_t n, double h,
                  bool fixed, double *y)
{
    for (size_t i = 0; i < 2 * n; i++)
        y[i] = 0;
    for (size_t m = 1; m <= MODES; m++) {
        double frequency = sqrt(s->strength) * 2 / h * sin(0.5 * (double)m * h), size[2], phase[2];
        for (size_t j = 0; j < 2; j++) {
            size[j] = hnn_between(random, s->radius_min, s->radius_max) / (double)m;
            size[j] *= j ? frequency : 1;
            phase[j] = hnn_between(random, 0, 2 * M_PI);
        }
        for (size_t i = 0; i < 2 * n; i++) {
            size_t j = i / n;
            double x = (double)m * h * (double)(i % n + fixed);
            y[i] += size[j] * (fixed ? cos(phase[j]) * sin(x) : cos(x + phase[j]));
        }
    }
}

static void start_ring(struct phys_random *random, const struct hnn_sampling *s, double *y)
{
    start(random, s, RING, 2 * M_PI / RING, false, y);
}

static void start_string(struct phys_random *random, const struct hnn_sampling *s, double *y)
{
    start(random, s, STRING, M_PI / (STRING + 1), true, y);
}

static const char *const sites[] = {
    "1",  "2",  "3",  "4",  "5",  "6",  "7",  "8",  "9",  "10", "11", "12", "13", "14", "15", "16",
    "17", "18", "19", "20", "21", "22", "23", "24", "25", "26", "27", "28", "29", "30", "31", "32"};

#define SAMPLED                                                                                    \
    {                                                                                              \
        .size = sizeof(struct hnn_sampling), .trials = 100, .points = 20, .time = 4,               \
        .radius_min = 0.1, .radius_max = 1, .strength = 1                                          \
    }

const struct hnn_task hnn_task_wave = {
    .name = "wave",
    .what = "a wave on a ring of 32 sites, of its four longest modes",
    .dof = RING,
    .coordinates = sites,
    .H = ring,
    .start = start_ring,
    .unit_masses = true,
    .published = SAMPLED,
};

const struct hnn_task hnn_task_string = {
    .name = "string",
    .what = "a wave on a string of 31 sites between walls, of its four longest modes",
    .dof = STRING,
    .coordinates = sites,
    .H = string,
    .start = start_string,
    .unit_masses = true,
    .published = SAMPLED,
};
