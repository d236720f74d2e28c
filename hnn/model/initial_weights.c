/* Initial weights. Orthogonal: A. Saxe, J. McClelland, S. Ganguli, ICLR 2014; by the Q of a QR
   factorisation of normal vectors, which prefers no direction. X. Glorot, Y. Bengio, AISTATS 2010;
   K. He, X. Zhang, S. Ren, J. Sun, ICCV 2015. */
#include "internal.h"
#include "autodiff/blas.h"
#include "physics/linear/linear.h"

#include <math.h>
#include <stdlib.h>

static void draw_normal(struct phys_random *random, size_t n, double deviation, double *values)
{
    for (size_t k = 0; k < n; k++)
        values[k] = deviation * phys_random_normal(random);
}

/* w [rows x cols]; `work` has room for three times as many. False: memory is exhausted. */
static bool draw_orthogonal(struct phys_random *random, size_t rows, size_t cols, double *w,
                            double *work)
{
    size_t n = rows < cols ? rows : cols, length = rows < cols ? cols : rows;
    draw_normal(random, n * length, 1, work);
    if (!phys_lapack_orthonormal_rows(n, length, work, work + rows * cols))
        return false;
    for (size_t r = 0; r < rows; r++)
        for (size_t c = 0; c < cols; c++)
            w[r * cols + c] = rows < cols ? work[r * length + c] : work[c * length + r];
    return true;
}

static bool draw_weight(enum hnn_start start, struct phys_random *random, const struct hnn_block *b,
                        double *w, double *work)
{
    double in = (double)b->cols, out = (double)b->rows;
    if (start == HNN_ORTHOGONAL)
        return draw_orthogonal(random, b->rows, b->cols, w, work);
    draw_normal(random, b->rows * b->cols, sqrt(2 / (start == HNN_XAVIER ? in + out : in)), w);
    return true;
}

enum ad_status hnn_start_draw(const hnn_model *model, double *values, struct ad_error *error)
{
    struct phys_random random;
    double *work = malloc(3 * model->size * sizeof *work), bound = 0;
    if (!work)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    phys_random_seed(&random, model->settings.seed);
    ad_blas_single_thread(); /* the same numbers whatever the number of threads */
    for (size_t k = 0; k < model->n_blocks && error->status == AD_OK; k++) {
        const struct hnn_block *b = &model->block[k];
        double *to = values + b->offset;
        if (b->bias) {
            for (size_t i = 0; i < b->rows; i++)
                to[i] = bound * (2 * phys_random_uniform(&random) - 1);
        } else {
            if (!draw_weight(model->settings.start, &random, b, to, work))
                ad_fail(error, AD_E_MEMORY, "out of memory for a layer of %zu", b->rows);
            bound = 1 / sqrt((double)b->cols);
        }
    }
    ad_blas_threads();
    free(work);
    return error->status;
}
