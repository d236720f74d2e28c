/* Random elementwise operations, each with the same operation on one number. */
#include "world_operations.h"

#include <stdlib.h>

#define UNARY(X)                                                                                   \
    X(true, ad_neg(x), -x)                                                                         \
    X(true, ad_sin(ad_mul(1.25, x)), sin(1.25 * x))                                                \
    X(true, ad_cos(x), cos(x))                                                                     \
    X(true, ad_tanh(x), tanh(x))                                                                   \
    X(true, ad_sigmoid(x), 1 / (1 + exp(-x)))                                                      \
    X(true, ad_sub(ad_softplus(x), 1.0), log1p(exp(x)) - 1)                                        \
    X(true, ad_mul(ad_square(x), 0.25), 0.25 * x * x)                                              \
    X(true, ad_recip(ad_add(1.0, ad_square(x))), 1 / (1 + x * x))                                  \
    X(true, ad_sqrt(ad_add(ad_square(x), 1.0)), sqrt(1 + x * x))                                   \
    X(true, ad_exp(ad_mul(-0.5, ad_square(x))), exp(-0.5 * x * x))                                 \
    X(true, ad_log(ad_add(2.0, ad_sin(x))), log(2 + sin(x)))                                       \
    X(true, ad_log1p(ad_square(x)), log1p(x *x))                                                   \
    X(true, ad_expm1(ad_tanh(x)), expm1(tanh(x)))                                                  \
    X(true, ad_atan(x), atan(x))                                                                   \
    X(true, ad_asin(ad_mul(0.75, ad_sin(x))), asin(0.75 * sin(x)))                                 \
    X(true, ad_acos(ad_mul(0.75, ad_cos(x))), acos(0.75 * cos(x)))                                 \
    X(true, ad_tan(ad_tanh(x)), tan(tanh(x)))                                                      \
    X(true, ad_sinh(ad_sin(x)), sinh(sin(x)))                                                      \
    X(true, ad_cosh(ad_sin(x)), cosh(sin(x)))                                                      \
    X(true, ad_pow(ad_mul(0.5, x), 3.0), 0.125 * x * x * x)                                        \
    X(true, ad_pow(ad_add(1.5, ad_sin(x)), -1.5), pow(1.5 + sin(x), -1.5))                         \
    X(true, ad_div(x, ad_add(ad_square(x), 0.75)), x / (x * x + 0.75))                             \
    X(false, ad_abs(ad_sub(x, 0.1337)), fabs(x - 0.1337))                                          \
    X(false, ad_relu(ad_sub(0.2337, x)), fmax(0.2337 - x, 0))                                      \
    X(false, ad_step(ad_sub(x, 0.3337)), x > 0.3337)                                               \
    X(false, ad_select(ad_lt(x, 0.0337), ad_square(x), ad_recip(x)), x < 0.0337 ? x * x : 1 / x)   \
    X(false, ad_min(ad_max(x, -0.777), 0.888), fmin(fmax(x, -0.777), 0.888))

#define BINARY(X)                                                                                  \
    X(true, ad_mul(0.5, ad_add(x, y)), 0.5 * (x + y))                                              \
    X(true, ad_sub(x, ad_mul(y, 0.5)), x - 0.5 * y)                                                \
    X(true, ad_mul(x, ad_sin(y)), x *sin(y))                                                       \
    X(true, ad_div(x, ad_add(ad_square(y), 1.5)), x / (y * y + 1.5))                               \
    X(true, ad_hypot(x, ad_add(ad_sin(y), 2.0)), hypot(x, sin(y) + 2))                             \
    X(true, ad_atan2(x, ad_add(ad_square(y), 0.5)), atan2(x, y *y + 0.5))                          \
    X(true, ad_pow(ad_add(2.0, ad_sin(x)), ad_sin(y)), pow(2 + sin(x), sin(y)))                    \
    X(false, ad_min(x, y), fmin(x, y))                                                             \
    X(false, ad_max(x, y), fmax(x, y))                                                             \
    X(false, ad_select(ad_lt(x, 0.4337), y, x), x < 0.4337 ? y : x)

static ad_var unary_record(size_t k, ad_var x)
{
    size_t i = 0;
#define X(smooth, recorded, plain)                                                                 \
    if (i++ == k)                                                                                  \
        return recorded;
    UNARY(X)
#undef X
    return x;
}

static double unary_plain(size_t k, double x)
{
    size_t i = 0;
#define X(smooth, recorded, plain)                                                                 \
    if (i++ == k)                                                                                  \
        return plain;
    UNARY(X)
#undef X
    return x;
}

static ad_var binary_record(size_t k, ad_var x, ad_var y)
{
    size_t i = 0;
#define X(smooth, recorded, plain)                                                                 \
    if (i++ == k)                                                                                  \
        return recorded;
    BINARY(X)
#undef X
    return x;
}

static double binary_plain(size_t k, double x, double y)
{
    size_t i = 0;
#define X(smooth, recorded, plain)                                                                 \
    if (i++ == k)                                                                                  \
        return plain;
    BINARY(X)
#undef X
    return x;
}

#define X(smooth, recorded, plain) smooth,
static const bool unary_smooth[] = {UNARY(X)}, binary_smooth[] = {BINARY(X)};
#undef X
enum { N_UNARY = sizeof unary_smooth, N_BINARY = sizeof binary_smooth };

static size_t pick_function(struct world *w, size_t n, const bool *smooth)
{
    size_t k;
    do
        k = world_pick(w, n);
    while (w->smooth && !smooth[k]);
    return k;
}

void world_unary(struct world *w)
{
    size_t a = world_any(w), k = pick_function(w, N_UNARY, unary_smooth);
    struct matrix m = world_matrix(w->m[a].rows, w->m[a].cols);
    for (size_t i = 0; i < m.rows * m.cols; i++)
        m.v[i] = unary_plain(k, w->m[a].v[i]);
    world_add(w, unary_record(k, w->var[a]), m);
}

void world_binary(struct world *w)
{
    size_t a = world_any(w), b = world_partner(w, a, a),
           k = pick_function(w, N_BINARY, binary_smooth);
    if (world_pick(w, 2)) {
        size_t swap = a;
        a = b;
        b = swap;
    }
    struct matrix m =
        world_matrix(larger(w->m[a].rows, w->m[b].rows), larger(w->m[a].cols, w->m[b].cols));
    for (size_t r = 0; r < m.rows; r++)
        for (size_t c = 0; c < m.cols; c++)
            m.v[r * m.cols + c] = binary_plain(k, at(&w->m[a], r, c), at(&w->m[b], r, c));
    world_add(w, binary_record(k, w->var[a], w->var[b]), m);
}

/* The condition is a random constant: smooth in the branches. */
void world_select_by_constant(struct world *w)
{
    size_t a = world_any(w), b = world_partner(w, a, a);
    struct matrix m =
        world_matrix(larger(w->m[a].rows, w->m[b].rows), larger(w->m[a].cols, w->m[b].cols));
    double *mask = random_values(&w->structure, m.cols, -1, 1);
    for (size_t r = 0; r < m.rows; r++)
        for (size_t c = 0; c < m.cols; c++)
            m.v[r * m.cols + c] = mask[c] > 0 ? at(&w->m[a], r, c) : at(&w->m[b], r, c);
    ad_var condition = ad_gt(ad_const(w->tape, 1, m.cols, mask), 0.0);
    world_add(w, ad_select(condition, w->var[a], w->var[b]), m);
    free(mask);
}
