/* The step of hand.h, vectorised over samples; compiled once for each instruction set
   (HAND_ISA), hand.c chooses.

   With h1 = tanh(W1 x + b1), h2 = tanh(W2 h1 + b2) and s = 1 - h^2 the gradient of H is
       d2 = w3 s2,   e1 = W2^T d2,   d1 = e1 s1,   g = W1^T d1,
   and backwards from the residual r = (g_p, -g_q) - rates, a bar being the derivative of the loss,
       g~ = (-r_p, r_q) / batch,   d1~ = W1 g~,   e1~ = d1~ s1,   d2~ = W2 e1~,
       z2~ = -2 h2 s2 w3 d2~,   h1~ = W2^T z2~ - 2 h1 e1 d1~,   z1~ = s1 h1~,
       W1~ = d1 g~^T + z1~ x^T,   W2~ = d2 e1~^T + z2~ h1^T,   w3~ = sum s2 d2~,   b~ = sum z~:
   six products of matrices. Samples come in blocks whose values stay in the second-level cache. */
#include "hand.h"
#include "autodiff/blas.h"

#include <math.h>
#include <string.h>

#define HAND_JOIN(a, b) a##_##b
#define HAND_NAME(isa) HAND_JOIN(hand_hnn, isa)

#ifdef __x86_64__ /* as in hand_kernels.c */
#pragma omp declare simd notinbranch
float tanhf(float);
#endif

enum { BLOCK = HAND_HNN_BLOCK };

/* Rows of W1 are (w[2 j], w[2 j + 1]). */
struct layers {
    const float *w1, *b1, *w2, *b2, *w3;
};

struct slopes {
    float *w1, *b1, *w2, *b2, *w3;
};

/* A block of n samples; matrices are [width x n]. Adjoints reuse the memory of values no longer
   needed. */
struct block {
    size_t width, n;
    const float *q, *p, *q_rate, *p_rate;
    float *h1, *h2, *d2, *e1, *e1_bar, *h1_bar, *z2_bar;
    float g_q[BLOCK], g_p[BLOCK]; /* g, then its bar */
};

static void product(bool transpose, const struct block *b, const float *w2, const float *from,
                    bool add, float *to)
{
    ad_blas_gemm(AD_F32, transpose, false, b->width, b->n, b->width, w2, b->width, from, b->n, add,
                 to, b->n);
}

static void add_outer(const struct block *b, const float *left, const float *right, float *to)
{
    ad_blas_gemm(AD_F32, false, true, b->width, b->width, b->n, left, b->n, right, b->n, true, to,
                 b->width);
}

static void first_layer(struct block *b, const struct layers *at)
{
    for (size_t j = 0; j < b->width; j++) {
        const float w_q = at->w1[2 * j], w_p = at->w1[2 * j + 1], bias = at->b1[j];
        const float *restrict q = b->q, *restrict p = b->p;
        float *restrict h = b->h1 + j * b->n;
#pragma omp simd
        for (size_t i = 0; i < b->n; i++)
            h[i] = tanhf(w_q * q[i] + w_p * p[i] + bias);
    }
}

static void second_layer(struct block *b, const struct layers *at)
{
    for (size_t j = 0; j < b->width; j++) {
        const float bias = at->b2[j], w3 = at->w3[j];
        float *restrict h = b->h2 + j * b->n, *restrict d = b->d2 + j * b->n;
#pragma omp simd
        for (size_t i = 0; i < b->n; i++) {
            h[i] = tanhf(h[i] + bias);
            d[i] = w3 * (1 - h[i] * h[i]);
        }
    }
}

static void field(struct block *b, const struct layers *at)
{
    float *restrict g_q = b->g_q, *restrict g_p = b->g_p;
    memset(b->g_q, 0, sizeof b->g_q);
    memset(b->g_p, 0, sizeof b->g_p);
    for (size_t j = 0; j < b->width; j++) {
        const float w_q = at->w1[2 * j], w_p = at->w1[2 * j + 1];
        const float *restrict h = b->h1 + j * b->n, *restrict e = b->e1 + j * b->n;
#pragma omp simd
        for (size_t i = 0; i < b->n; i++) {
            float d = e[i] * (1 - h[i] * h[i]);
            g_q[i] += w_q * d;
            g_p[i] += w_p * d;
        }
    }
}

/* Leaves the bar of g in its place; returns the sum of squares. */
static double residual(struct block *b, float scale)
{
    float sum = 0;
#pragma omp simd reduction(+ : sum)
    for (size_t i = 0; i < b->n; i++) {
        float r_q = b->g_p[i] - b->q_rate[i], r_p = -b->g_q[i] - b->p_rate[i];
        sum += r_q * r_q + r_p * r_p;
        b->g_q[i] = -scale * r_p;
        b->g_p[i] = scale * r_q;
    }
    return (double)sum;
}

static void field_back(struct block *b, const struct layers *at, const struct slopes *to)
{
    for (size_t j = 0; j < b->width; j++) {
        const float w_q = at->w1[2 * j], w_p = at->w1[2 * j + 1];
        const float *restrict h = b->h1 + j * b->n, *restrict e = b->e1 + j * b->n;
        const float *restrict g_q = b->g_q, *restrict g_p = b->g_p;
        float *restrict e_bar = b->e1_bar + j * b->n, *restrict h_bar = b->h1_bar + j * b->n;
        float sum_q = 0, sum_p = 0;
#pragma omp simd reduction(+ : sum_q, sum_p)
        for (size_t i = 0; i < b->n; i++) {
            float s = 1 - h[i] * h[i], d = e[i] * s, d_bar = w_q * g_q[i] + w_p * g_p[i];
            sum_q += d * g_q[i];
            sum_p += d * g_p[i];
            e_bar[i] = d_bar * s;
            h_bar[i] = -2 * h[i] * e[i] * d_bar;
        }
        to->w1[2 * j] += sum_q;
        to->w1[2 * j + 1] += sum_p;
    }
}

/* d2~ becomes z2~. */
static void second_layer_back(struct block *b, const struct layers *at, const struct slopes *to)
{
    for (size_t j = 0; j < b->width; j++) {
        const float w3 = at->w3[j];
        const float *restrict h = b->h2 + j * b->n;
        float *restrict z = b->z2_bar + j * b->n, sum_w = 0, sum_b = 0;
#pragma omp simd reduction(+ : sum_w, sum_b)
        for (size_t i = 0; i < b->n; i++) {
            float along = (1 - h[i] * h[i]) * z[i];
            z[i] = -2 * w3 * h[i] * along;
            sum_w += along;
            sum_b += z[i];
        }
        to->w3[j] += sum_w;
        to->b2[j] += sum_b;
    }
}

static void first_layer_back(const struct block *b, const struct slopes *to)
{
    for (size_t j = 0; j < b->width; j++) {
        const float *restrict h = b->h1 + j * b->n, *restrict h_bar = b->h1_bar + j * b->n;
        float sum_q = 0, sum_p = 0, sum_b = 0;
#pragma omp simd reduction(+ : sum_q, sum_p, sum_b)
        for (size_t i = 0; i < b->n; i++) {
            float z = (1 - h[i] * h[i]) * h_bar[i];
            sum_q += z * b->q[i];
            sum_p += z * b->p[i];
            sum_b += z;
        }
        to->w1[2 * j] += sum_q;
        to->w1[2 * j + 1] += sum_p;
        to->b1[j] += sum_b;
    }
}

static double add_block(struct block *b, const struct layers *at, float scale,
                        const struct slopes *to)
{
    first_layer(b, at);
    product(false, b, at->w2, b->h1, false, b->h2);
    second_layer(b, at);
    product(true, b, at->w2, b->d2, false, b->e1);
    field(b, at);
    double squares = residual(b, scale);
    field_back(b, at, to);
    product(false, b, at->w2, b->e1_bar, false, b->z2_bar);
    add_outer(b, b->d2, b->e1_bar, to->w2);
    second_layer_back(b, at, to);
    product(true, b, at->w2, b->z2_bar, true, b->h1_bar);
    add_outer(b, b->z2_bar, b->h1, to->w2);
    first_layer_back(b, to);
    return squares;
}

static double gradient(const struct hand_hnn_shape *shape, const float *parameters, const float *x,
                       const float *rates, float *gradient, float *room)
{
    const size_t w = shape->width, n = shape->batch, matrix = w * BLOCK;
    const float *w1 = parameters;
    float *g1 = gradient;
    const struct layers at = {w1, w1 + 2 * w, w1 + 3 * w, w1 + (3 + w) * w, w1 + (4 + w) * w};
    const struct slopes to = {g1, g1 + 2 * w, g1 + 3 * w, g1 + (3 + w) * w, g1 + (4 + w) * w};
    double squares = 0;
    memset(gradient, 0, hand_hnn_parameters(w) * sizeof *gradient);
    ad_blas_single_thread();
    for (size_t first = 0; first < n; first += BLOCK) {
        struct block b = {.width = w,
                          .n = n - first < BLOCK ? n - first : BLOCK,
                          .q = x + first,
                          .p = x + n + first,
                          .q_rate = rates + first,
                          .p_rate = rates + n + first,
                          .h1 = room,
                          .h2 = room + matrix,
                          .d2 = room + 2 * matrix,
                          .e1 = room + 3 * matrix,
                          .e1_bar = room + 4 * matrix,
                          .h1_bar = room + 5 * matrix,
                          .z2_bar = room + 3 * matrix}; /* e1 was needed last for the bar of h1 */
        squares += add_block(&b, &at, 1 / (float)n, &to);
    }
    ad_blas_threads();
    return squares / (double)(2 * n);
}

static void adam(size_t parameters, size_t step, double weight_decay, const float *gradient,
                 float *moments, float *x)
{
    const double root = sqrt(1 - pow(0.999, (double)step));
    const float rate = (float)(1e-3 * root / (1 - pow(0.9, (double)step)));
    const float epsilon = (float)(1e-8 * root), decay = (float)weight_decay;
    const float *restrict g = gradient;
    float *restrict m = moments, *restrict v = moments + parameters, *restrict at = x;
#pragma omp simd
    for (size_t i = 0; i < parameters; i++) {
        float d = g[i] + decay * at[i];
        m[i] = 0.9F * m[i] + 0.1F * d;
        v[i] = 0.999F * v[i] + 0.001F * d * d;
        at[i] -= rate * m[i] / (sqrtf(v[i]) + epsilon);
    }
}

extern const struct hand_hnn HAND_NAME(HAND_ISA);
const struct hand_hnn HAND_NAME(HAND_ISA) = {gradient, adam};
