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
    p->x = calloc(3 * p->n, sizeof *p->x);
    p->g = p->x + p->n;
    p->ran = p->g + p->n;
    if (!p->x)
        return ad_fail(error, AD_E_MEMORY, "out of memory for a path");
    return phys_end_space_new(&p->ends, settings->ends, system->dof, error);
}

/* Zeros where the path is held. */
static void hold(const struct phys_path_settings *s, size_t dof, double *g)
{
    size_t degree = s->rule->degree, last = degree * (s->slices - 1), hold = s->hold ? s->hold : 1;
    for (size_t end = 0; end < 2; end++)
        for (size_t k = 0; k <= (hold - 1) * degree; k++) {
            size_t node = end ? last - k : k;
            for (size_t d = 0; d < dof; d++)
                if (!phys_end_moves(s->ends, end, d))
                    g[(node % degree * dof + d) * s->slices + node / degree] = 0;
        }
}

struct phys_path_step phys_path_points_run(struct phys_path_program *p, size_t step)
{
    struct phys_hessian *h = p->hessian;
    const struct phys_path_settings *s = p->settings;
    size_t degree = s->rule->degree, dof = h->dof, n = s->slices;
    double share = 1 / (s->dt * (double)n * bodies_of(p)), sum = 0;
    phys_hessian_gradient_at(h, p->x, 0);
    memset(p->g, 0, p->n * sizeof *p->g);
    for (size_t k = 0; k < h->side; k++) {
        double *to = p->g + (k < degree * dof ? k * n : (k - degree * dof) * n + 1);
        for (size_t e = 0; e < h->elements; e++)
            to[e] += share * h->gradient[e * h->side + k];
    }
    hold(s, dof, p->g);
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
    double drift = fmax(h->most - h->energy, h->energy - h->least);
    info->energy_mean = (2 * h->kinetic - h->action) / (weights * h->dt);
    info->energy_drift = h->energy != 0 ? drift / fabs(h->energy) : drift;
    if (p->settings->start_momentum)
        for (size_t k = 0; k < h->dof; k++)
            p->settings->start_momentum[k] = -h->gradient[k];
}
