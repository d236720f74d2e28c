/* Kernels: the loops over lanes, built once per element type and instruction set. */
#ifndef AUTODIFF_KERNELS_KERNELS_H
#define AUTODIFF_KERNELS_KERNELS_H

#include "autodiff/autodiff.h"

/* o[i] = f(a[i], b[i], c[i]) for n lanes. o may be one of the inputs, no other overlap. */
typedef void ad_kernel(size_t n, void *o, const void *a, const void *b, const void *c);

/* Variants, one bit per input that is a single number for all lanes. */
enum { VARIANT_A_NUMBER = 1, VARIANT_B_NUMBER = 2, VARIANT_C_NUMBER = 4, N_VARIANTS = 8 };

/* ab + c, c + ab, ab - c, c - ab */
enum product_sum { PRODUCT_PLUS, PLUS_PRODUCT, PRODUCT_MINUS, MINUS_PRODUCT, N_PRODUCT_SUMS };

/* Largest n of small systems, n x n, and of a single one, whose n*n is an int of LAPACK. */
enum { AD_MOST_SIDE = 32, AD_LARGEST_SIDE = 46340 };

/* The first singular column, SIZE_MAX if none, and the largest condition number of the others (see
   ad_program_condition). */
struct ad_factored {
    size_t singular;
    double condition;
};

/* Factors of one step of an optimiser; the bias corrections of Adam are in rate and epsilon. */
struct ad_step {
    double rate;     /* x -= rate * direction */
    double keep;     /* x *= keep first: decoupled weight decay */
    double decay;    /* g += decay * x */
    double momentum; /* SGD */
    double beta1, beta2, epsilon;
    double least; /* below it x, velocity and mean become 0 */
};

struct ad_kernels {
    const char *isa;
    ad_kernel *op[AD_N_OPS][N_VARIANTS]; /* unary: the first two; binary: four */
    ad_kernel *product_sum[N_PRODUCT_SUMS][N_VARIANTS];
    /* sine and cosine of n lanes; either may lie where a does. NULL: two kernels are as fast */
    void (*sin_and_cos)(size_t n, void *sin, void *cos, const void *a);
    double (*sum)(size_t n, const void *a);
    /* o[i] = scale*(a[i+1] - a[i]) */
    void (*diff)(size_t n, void *o, const void *a, double scale);
    /* o[k] = sum of n doubles partial[k + i*count], in order, as the element type */
    void (*collect)(size_t count, void *o, size_t n, const double *partial);
    /* true if a lane is not finite; *lane is the first */
    bool (*nonfinite)(size_t n, const void *a, size_t *lane);
    /* o [cols x rows] = transpose of a [rows x cols]; ldo, lda: row strides in elements */
    void (*transpose)(size_t rows, size_t cols, void *o, size_t ldo, const void *a, size_t lda);
    /* o[i] = a[list[i]]; o[list[i]] += a[i] */
    void (*gather)(size_t n, void *o, const void *a, const uint32_t *list);
    void (*scatter)(size_t n, void *o, const void *a, const uint32_t *list);
    /* o[i] = a[0] + ... + a[i], or from the other end; added in double */
    void (*cumsum)(size_t n, void *o, const void *a, bool reversed);
    /* Linear systems, n x n in each column (small_systems.h) or in one (large_systems.h); ldo, lda,
       ldf, ldb: row strides in elements. factor fills the factor of a singular matrix with NaN.
       solve: m right sides, row i*m + k is element i of side k. */
    struct ad_factored (*factor)(size_t n, size_t cols, void *o, size_t ldo, const void *a,
                                 size_t lda, bool cholesky);
    void (*solve)(size_t n, size_t m, size_t cols, void *o, size_t ldo, const void *f, size_t ldf,
                  const void *b, size_t ldb, bool cholesky, bool transposed);
    void (*logdet)(size_t n, size_t cols, void *o, const void *f, size_t ldf, bool cholesky);
    void (*from_double)(size_t n, void *o, const double *a);
    void (*to_double)(size_t n, double *o, const void *a);
    /* steps of the optimisers, optim_step.h; v, m: moments */
    void (*sgd)(size_t n, void *x, const void *g, void *v, const struct ad_step *step);
    void (*adam)(size_t n, void *x, const void *g, void *m, void *v, const struct ad_step *step);
};

/* The fastest set this machine runs; LEASTACTION_ISA=base|avx2|avx512 in the environment asks for a
   lesser one (used by tests). */
const struct ad_kernels *ad_kernels_for(enum ad_type type);

#endif
