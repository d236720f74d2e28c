/* Limited-memory BFGS on the full batch (autodiff/lbfgs.h). Directions are in f64 whatever the type
   of the parameters. Weight decay is the term decay/2 |x|^2 of the objective. */
#include "autodiff/free.h"
#include "train.h"
#include "autodiff/lbfgs.h"

#include <stdlib.h>

struct lbfgs {
    ad_lbfgs *method;
    size_t n;
    enum ad_type type;
    double decay, loss; /* loss: without the decay, where it was evaluated last */
    double *x, *g;      /* [n] each, one block */
    const struct hnn_problem *problem;
};

static void destroy(void *method)
{
    struct lbfgs *m = method;
    if (!m)
        return;
    ad_lbfgs_free(m->method);
    AD_FREE(m->x, m);
}

static void *create(const struct hnn_training *training, enum ad_type type, size_t n)
{
    struct lbfgs *m = malloc(sizeof *m);
    if (!m)
        return NULL;
    *m = (struct lbfgs){.method = ad_lbfgs_new(n),
                        .n = n,
                        .type = type,
                        .decay = training->weight_decay,
                        .x = malloc(2 * n * sizeof *m->x)};
    if (!m->method || !m->x) {
        destroy(m);
        return NULL;
    }
    m->g = m->x + n;
    return m;
}

/* Loss and gradient at x, rounded to the type of the parameters. */
static double evaluate(void *context, double *x, double *g)
{
    struct lbfgs *m = context;
    hnn_from_double(m->type, m->n, x, hnn_problem_point(m->problem));
    hnn_to_double(m->type, m->n, hnn_problem_point(m->problem), x);
    m->loss = hnn_problem_evaluate(m->problem);
    hnn_to_double(m->type, m->n, hnn_problem_gradient(m->problem), g);
    double square = 0;
    for (size_t k = 0; k < m->n; k++) {
        g[k] += m->decay * x[k];
        square += x[k] * x[k];
    }
    return m->loss + 0.5 * m->decay * square;
}

/* The rate bounds the first step alone, which has no scale yet: no parameter moves by more. *loss
   is that of the point the step begins at. */
static bool step(void *method, const struct hnn_problem *problem, double rate, double *loss)
{
    struct lbfgs *m = method;
    m->problem = problem;
    hnn_to_double(m->type, m->n, hnn_problem_point(problem), m->x);
    double value = evaluate(m, m->x, m->g);
    *loss = m->loss;
    if (ad_lbfgs_step(m->method, evaluate, m, rate, m->x, m->g, &value))
        return true;
    hnn_from_double(m->type, m->n, m->x, hnn_problem_point(problem));
    return false;
}

static uint64_t *count(void *method) { return ad_lbfgs_pairs(((struct lbfgs *)method)->method); }

static void *state(void *method, size_t *n, enum ad_type *type)
{
    *type = AD_F64;
    return ad_lbfgs_state(((struct lbfgs *)method)->method, n);
}

const struct hnn_optimiser hnn_lbfgs = {
    "lbfgs", "full batch; needs f64 to go far", true, create, destroy, step, count, state};
