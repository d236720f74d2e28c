/* The problems of Microsoft's ADBench (Srajer, Kukelova, Fitzgibbon 2018) on the tape. Each file
   records one of them, on numbers by a fixed rule instead of ADBench's files. */
#ifndef DOCS_EXAMPLES_ADBENCH_ADBENCH_H
#define DOCS_EXAMPLES_ADBENCH_ADBENCH_H

#include <autodiff/autodiff.h>

enum { MOST_INPUTS = 3 };

struct problem {
    ad_tape *tape;
    ad_var x[MOST_INPUTS], y;        /* a scalar, or the vector of a Jacobian */
    double *at[MOST_INPUTS], *fixed; /* values of inputs, and of the last constant */
    double *start;                   /* of the LSTM's state */
    size_t n;
};

/* Number k of a series, in [-1, 1): the top bits of splitmix64. */
static inline double number(uint64_t series, uint64_t k)
{
    uint64_t z = (series * 1000003 + k + 1) * 0x9e3779b97f4a7c15u;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return (double)((z ^ z >> 31) >> 11) / (double)(UINT64_C(1) << 52) - 1;
}

/* An input of numbers offset + scale * number(series, k), kept in the problem. */
ad_var adbench_input(struct problem *p, size_t rows, size_t cols, uint64_t series, double offset,
                     double scale);
/* The same as a constant, the last one kept in the problem. */
ad_var adbench_constant(struct problem *p, size_t rows, size_t cols, uint64_t series, double offset,
                        double scale);
/* Rotation of the columns of v by the axis and angle r (3 x 1, or a column each). */
ad_var adbench_rotate(ad_var r, ad_var v);

void adbench_gmm(struct problem *p, const size_t size[3]);  /* dimensions, components, points */
void adbench_ba(struct problem *p, const size_t size[3]);   /* cameras, points, observations */
void adbench_lstm(struct problem *p, const size_t size[3]); /* layers, units, steps */
void adbench_lstm_loop(struct problem *p, const size_t size[3]);
/* How likely `next` follows x; state[] goes on by a step. */
ad_var adbench_lstm_step(const size_t size[3], ad_var main, ad_var extra, ad_var x, ad_var next,
                         ad_var state[]);
void adbench_hand(struct problem *p, const size_t size[3]); /* points, whether of triangles */

/* By hand: the derivatives by all inputs; the entries of the Jacobian row by row. */
void adbench_gmm_by_hand(const struct problem *p, const size_t size[3], double *gradient);
void adbench_ba_by_hand(const struct problem *p, const size_t size[3], double *value);
void adbench_lstm_by_hand(const struct problem *p, const size_t size[3], double *gradient);

#endif
