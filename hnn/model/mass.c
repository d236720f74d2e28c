/* The mass matrix L_vv of a Lagrangian model over many states: how nearly singular it is, and
   whether it is singular between them. */
#include "autodiff/free.h"
#include "internal.h"
#include "physics/linear/linear.h"

#include <math.h>
#include <stdlib.h>

enum { PIECE = 256 };

/* Eigenvalues [n] of M [n x n] with rows and columns scaled to a largest element of 1, ascending;
   B [n x n] is room. False: they are not finite. */
static bool eigenvalues(size_t n, double *M, double *B, double *values)
{
    for (size_t i = 0; i < n; i++) {
        double most = 0;
        for (size_t j = 0; j < n; j++)
            most = fmax(most, fabs(M[i * n + j]));
        values[i] = most > 0 ? sqrt(most) : 1;
    }
    bool finite = true;
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++) {
            M[i * n + j] /= values[i] * values[j];
            B[i * n + j] = i == j;
            finite = finite && isfinite(M[i * n + j]);
        }
    return finite && phys_lapack_eigenvectors(n, M, B, values) == 0;
}

static void take(size_t n, size_t state, double *M, double *B, double *values,
                 struct hnn_mass *mass)
{
    double least = INFINITY, most = 0;
    size_t negative = 0;
    bool known = eigenvalues(n, M, B, values);
    for (size_t k = 0; k < n && known; k++) {
        least = fmin(least, fabs(values[k]));
        most = fmax(most, fabs(values[k]));
        negative += values[k] < 0;
    }
    double condition = known && least > 0 ? most / least : (double)INFINITY;
    if (condition > mass->condition) {
        mass->condition = condition;
        mass->worst = state;
    }
    mass->negative_least = negative < mass->negative_least ? negative : mass->negative_least;
    mass->negative_most = negative > mass->negative_most ? negative : mass->negative_most;
}

static void follow(const hnn_model *model, size_t n, const double *x, ad_program *program,
                   ad_var in, ad_var out, double *work, struct hnn_mass *mass)
{
    /* matrices of a state: one, or that of each site */
    const size_t matrices = model->settings.lattice ? model->settings.dof : 1;
    const size_t dof = model->settings.dof / matrices, square = dof * dof;
    size_t rows = hnn_rows(model);
    double *some = work, *all = some + rows * PIECE, *M = all + matrices * square * PIECE,
           *B = M + square, *values = B + square;
    for (size_t first = 0; first < n; first += PIECE) {
        size_t count = n - first < PIECE ? n - first : PIECE;
        for (size_t r = 0; r < rows; r++)
            for (size_t k = 0; k < PIECE; k++)
                some[r * PIECE + k] = x[r * n + first + (k < count ? k : count - 1)];
        ad_set(program, in, some);
        ad_run(program);
        ad_get(program, out, all);
        for (size_t k = 0; k < count * matrices; k++) {
            for (size_t i = 0; i < square; i++)
                M[i] = all[(k / count * square + i) * PIECE + k % count];
            take(dof, first + k % count, M, B, values, mass);
        }
    }
}

enum ad_status hnn_model_mass(const hnn_model *model, size_t n, const double *x,
                              struct hnn_mass *mass, struct ad_error *error)
{
    if (AD_LACKS(error, model, x, mass))
        return error->status;
    size_t dof = model->settings.dof;
    if (model->settings.kind != HNN_LAGRANGIAN || n == 0)
        return ad_fail(error, AD_E_ARGUMENT, "L_vv: expected a Lagrangian model and some states");
    *mass = (struct hnn_mass){.condition = 0, .negative_least = dof};
    const size_t square = model->settings.lattice ? dof : dof * dof;
    double *work = malloc(((hnn_rows(model) + square) * PIECE + 2 * square + dof) * sizeof *work),
           *values = malloc(model->size * sizeof *values);
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_program *program = NULL;
    if (work && values && tape) {
        struct hnn_record r;
        ad_var w = ad_input(tape, 1, model->size, "parameters"),
               in = ad_input(tape, hnn_rows(model), PIECE, "x");
        ad_var out = ad_mul(1.0, hnn_record_lagrangian(model, w, in, &r));
        hnn_to_double(model->settings.precision, model->size, model->parameters, values);
        if (ad_compile(tape, 1, &out, &program) == AD_OK) {
            ad_set(program, w, values);
            follow(model, n, x, program, in, out, work, mass);
        }
        phys_tape_status(tape, error);
    } else {
        ad_fail(error, AD_E_MEMORY, "out of memory");
    }
    ad_program_free(program);
    ad_tape_free(tape);
    AD_FREE(work, values);
    return error->status;
}
