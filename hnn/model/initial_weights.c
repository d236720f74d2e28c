/* How parameters begin.
   Orthogonal: A. Saxe, J. McClelland, S. Ganguli, ICLR 2014; by Gram and Schmidt, twice, of normal
   vectors, which leaves no direction preferred. X. Glorot, Y. Bengio, AISTATS 2010; K. He, X.
   Zhang, S. Ren, J. Sun, ICCV 2015. */
#include "internal.h"

#include <math.h>
#include <stdlib.h>

static void draw_normal(struct phys_random *random, size_t n, double deviation, double *values)
{
    for (size_t k = 0; k < n; k++)
        values[k] = deviation * phys_random_normal(random);
}

static double dot(size_t n, const double *a, const double *b)
{
    double sum = 0;
    for (size_t k = 0; k < n; k++)
        sum += a[k] * b[k];
    return sum;
}

/* Makes the rows of a [n x length] orthonormal, n <= length. */
static void orthonormalise(size_t n, size_t length, double *a)
{
    for (size_t i = 0; i < n; i++) {
        double *row = a + i * length;
        for (int pass = 0; pass < 2; pass++)
            for (size_t j = 0; j < i; j++) {
                double share = dot(length, row, a + j * length);
                for (size_t k = 0; k < length; k++)
                    row[k] -= share * a[j * length + k];
            }
        double norm = sqrt(dot(length, row, row));
        for (size_t k = 0; k < length; k++)
            row[k] /= norm;
    }
}

/* w [rows x cols]; `work` has room for as many. */
static void draw_orthogonal(struct phys_random *random, size_t rows, size_t cols, double *w,
                            double *work)
{
    size_t n = rows < cols ? rows : cols, length = rows < cols ? cols : rows;
    draw_normal(random, n * length, 1, work);
    orthonormalise(n, length, work);
    for (size_t r = 0; r < rows; r++)
        for (size_t c = 0; c < cols; c++)
            w[r * cols + c] = rows < cols ? work[r * length + c] : work[c * length + r];
}

static void draw_weight(enum hnn_start start, struct phys_random *random, const struct hnn_block *b,
                        double *w, double *work)
{
    double in = (double)b->cols, out = (double)b->rows;
    if (start == HNN_ORTHOGONAL)
        draw_orthogonal(random, b->rows, b->cols, w, work);
    else
        draw_normal(random, b->rows * b->cols, sqrt(2 / (start == HNN_XAVIER ? in + out : in)), w);
}

enum ad_status hnn_start_draw(const hnn_model *model, double *values, struct ad_error *error)
{
    struct phys_random random;
    double *work = malloc(model->size * sizeof *work), bound = 0;
    if (!work)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    phys_random_seed(&random, model->settings.seed);
    for (size_t k = 0; k < model->n_blocks; k++) {
        const struct hnn_block *b = &model->block[k];
        double *to = values + b->offset;
        if (b->bias) {
            for (size_t i = 0; i < b->rows; i++)
                to[i] = bound * (2 * phys_random_uniform(&random) - 1);
        } else {
            draw_weight(model->settings.start, &random, b, to, work);
            bound = 1 / sqrt((double)b->cols);
        }
    }
    free(work);
    return AD_OK;
}
