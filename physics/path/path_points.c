/* The action of a path and its gradient from L at the points of its rule (path_program.h): no
   recording of the path, so that grids of all rules and lengths share one of L. */
#include "path_program.h"
#include "autodiff/clock.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static double bodies_of(const struct phys_path_program *p)
{
    return p->system->scene->per_body ? (double)p->system->bodies : 1;
}

enum ad_status phys_path_program_over(struct phys_path_program *p, const struct phys_system *system,
                                      const struct phys_path_settings *settings,
                                      struct phys_hessian *hessian, struct ad_error *error)
{
    *p = (struct phys_path_program){.system = system,
                                    .settings = settings,
                                    .hessian = hessian,
                                    .nearest_at = (double)INFINITY,
                                    .started = ad_now(),
                                    .n = settings->rule->degree * system->dof * settings->slices};
    p->x = calloc(2 * p->n, sizeof *p->x);
    p->g = p->x + p->n;
    return p->x ? AD_OK : ad_fail(error, AD_E_MEMORY, "out of memory for a path");
}

/* Whether coordinate d of node `node` of the whole path moves. */
static bool moves(const struct phys_path_settings *s, size_t node, size_t d)
{
    size_t last = s->rule->degree * (s->slices - 1), hold = s->hold ? s->hold : 1;
    for (size_t end = 0; end < 2; end++) {
        size_t from_end = end ? last - node : node;
        const bool *free = s->ends ? s->ends->free[end] : NULL;
        if (from_end <= (hold - 1) * s->rule->degree && !(free && free[d]))
            return false;
    }
    return true;
}

struct phys_path_step phys_path_points_run(struct phys_path_program *p, size_t step)
{
    struct phys_hessian *h = p->hessian;
    const struct phys_path_settings *s = p->settings;
    size_t degree = s->rule->degree, dof = h->dof, n = s->slices;
    double share = 1 / (s->dt * (double)n * bodies_of(p)), sum = 0;
    phys_hessian_gradient_at(h, p->x, 0);
    memset(p->g, 0, p->n * sizeof *p->g);
    for (size_t e = 0; e < h->elements; e++)
        for (size_t k = 0; k < h->side; k++) {
            size_t node = e * degree + k / dof, d = k % dof;
            if (moves(s, node, d))
                p->g[(node % degree * dof + d) * n + node / degree] +=
                    share * h->gradient[e * h->side + k];
        }
    for (size_t k = 0; k < p->n; k++)
        sum += p->g[k] * p->g[k];
    return (struct phys_path_step){.step = step,
                                   .path = p->x,
                                   .action = h->action,
                                   .action_mean = share * h->action,
                                   .kinetic_mean = share * h->kinetic,
                                   .potential_mean = share * (h->kinetic - h->action),
                                   .objective = share * h->action,
                                   .grad_norm = sqrt(sum)};
}

void phys_path_points_measure(struct phys_path_program *p, struct phys_path_info *info)
{
    const struct phys_hessian *h = p->hessian;
    double weights = (double)h->elements + h->repeat;
    info->energy_mean = (2 * h->kinetic - h->action) / (weights * h->dt);
    info->energy_drift = h->energy != 0 ? h->drift / fabs(h->energy) : h->drift;
    if (p->settings->start_momentum)
        for (size_t k = 0; k < h->dof; k++)
            p->settings->start_momentum[k] = -h->gradient[k];
}
