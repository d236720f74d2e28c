/* Accelerations of many states at once, as one recording (euler_lagrange.h). */
#include "euler_lagrange.h"
#include "autodiff/derivatives.h"
#include "physics/system/internal.h"

#include <stdlib.h>

/* M = L_vv: column k is the derivative of the momenta along velocity k. */
static ad_var record_masses(ad_var p, ad_var v, size_t n)
{
    ad_var *column = malloc(n * sizeof *column), M = v;
    double *unit = calloc(n, sizeof *unit);
    if (!column || !unit)
        M = ad_refuse(v.tape, AD_E_MEMORY, "out of memory for %zu coordinates", n);
    for (size_t k = 0; column && unit && k < n; k++) {
        unit[k] = 1;
        const ad_var along = ad_const(v.tape, n, 1, unit);
        ad_jvp(p, 1, &v, &along, &column[k]);
        unit[k] = 0;
    }
    if (column && unit)
        M = ad_concat_rows(n, column);
    free(column);
    free(unit);
    return M;
}

ad_var phys_record_accelerations(const struct phys_system *system, ad_var q, ad_var v, ad_var t)
{
    struct ad_error refused = {0};
    if (phys_refuse_constraints(system, "recorded accelerations", &refused) != AD_OK)
        return ad_refuse(q.tape, refused.status, "%s", refused.message);
    /* of copies, which do not depend on each other */
    ad_var x[] = {ad_unary(AD_OP_copy, q), ad_unary(AD_OP_copy, v),
                  ad_unary(AD_OP_copy, ad_broadcast(t, 1, ad_cols(q)))};
    const ad_var place[] = {x[0], x[2]}, rate[] = {x[1], ad_scalar(q.tape, 1)};
    ad_var L = phys_system_lagrangian(system, x[0], x[1], x[2]), by[2], along;
    if (ad_grad(L, 2, x, by) != AD_OK || ad_jvp(by[1], 2, place, rate, &along) != AD_OK)
        return L;
    ad_var force = phys_system_add_forces(system, by[0], x[0], x[1], x[2]);
    ad_var M = ad_label(record_masses(by[1], x[1], system->dof), "L_vv");
    return ad_label(ad_solve(M, ad_sub(force, along), AD_LU), "accelerations");
}
