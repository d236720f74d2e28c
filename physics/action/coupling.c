/* The pattern of the second derivatives of L, and its colours (coupling.h). */
#include "coupling.h"
#include "autodiff/free.h"

#include "autodiff/derivatives.h"

#include <stdlib.h>
#include <string.h>

enum { FEW = 4 }; /* coordinates for which no product would be saved */

/* Entries of L's Hessian at one point; NULL where it is not known. */
static ad_jacobian *second_derivatives(const struct phys_system *system)
{
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_jacobian *hessian = NULL;
    if (tape && system->dof > FEW) {
        ad_var at[] = {ad_input(tape, system->dof, 1, "q"), ad_input(tape, system->dof, 1, "v")};
        ad_var L = phys_system_lagrangian(system, at[0], at[1], ad_input(tape, 1, 1, "t"));
        ad_hessian_new(L, 2, at, &hessian);
    }
    ad_tape_free(tape);
    return hessian;
}

/* coupled [dof x dof] from entries over (q, v). */
static void mark(bool *coupled, size_t dof, const struct ad_sparse *entries)
{
    memset(coupled, !entries, dof * dof * sizeof *coupled);
    for (size_t i = 0; entries && i < 2 * dof; i++)
        for (size_t k = entries->start[i]; k < entries->start[i + 1]; k++) {
            size_t j = entries->col[k] % dof;
            coupled[i % dof * dof + j] = coupled[j * dof + i % dof] = true;
        }
    for (size_t i = 0; i < dof; i++)
        coupled[i * dof + i] = true;
}

static void list_rows(struct phys_coupling *c, size_t dof, const bool *coupled)
{
    size_t n = 0;
    for (size_t j = 0; j < dof; j++) {
        c->start[j] = n;
        for (size_t i = 0; i < dof; i++)
            if (coupled[j * dof + i])
                c->row[n++] = i;
    }
    c->start[dof] = n;
}

/* Each coordinate takes the first colour that no row has already. */
static void choose_colours(struct phys_coupling *c, size_t dof, size_t *taken_by)
{
    for (size_t k = 0; k < dof; k++)
        taken_by[k] = dof;
    for (size_t j = 0; j < dof; j++) {
        for (size_t a = c->start[j]; a < c->start[j + 1]; a++)
            for (size_t b = c->start[c->row[a]]; b < c->start[c->row[a] + 1]; b++)
                if (c->row[b] < j)
                    taken_by[c->colour[c->row[b]]] = j;
        size_t colour = 0;
        while (taken_by[colour] == j)
            colour++;
        c->colour[j] = colour;
        c->colours = colour >= c->colours ? colour + 1 : c->colours;
    }
}

bool phys_coupling_new(struct phys_coupling *c, const struct phys_system *system)
{
    size_t dof = system->dof;
    bool *coupled = malloc(dof * dof * sizeof *coupled);
    *c = (struct phys_coupling){.start = malloc((dof + 1) * sizeof *c->start),
                                .row = malloc(dof * dof * sizeof *c->row),
                                .colour = malloc(2 * dof * sizeof *c->colour)};
    bool done = coupled && c->start && c->row && c->colour;
    if (done) {
        ad_jacobian *hessian = second_derivatives(system);
        mark(coupled, dof, ad_jacobian_matrix(hessian));
        ad_jacobian_free(hessian);
        list_rows(c, dof, coupled);
        choose_colours(c, dof, c->colour + dof);
    }
    free(coupled);
    return done;
}

void phys_coupling_free(struct phys_coupling *c) { AD_FREE(c->start, c->row, c->colour); }
