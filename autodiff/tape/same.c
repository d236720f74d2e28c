/* Compares two recordings. */
#include "autodiff/internal.h"

#include <string.h>

static bool same_node(const struct node *a, const struct node *b)
{
    return a->op == b->op && a->rows == b->rows && a->cols == b->cols && a->aux == b->aux &&
           memcmp(a->in, b->in, sizeof a->in) == 0;
}

/* Recorded in the same order, constants and lists have the same places. */
bool ad_tape_same(const ad_tape *a, const ad_tape *b)
{
    if (!a || !b || a->type != b->type || a->n_nodes != b->n_nodes ||
        a->n_numbers != b->n_numbers || a->n_lists != b->n_lists || a->n_loops != b->n_loops ||
        a->n_customs != b->n_customs)
        return false;
    for (uint32_t id = 0; id < a->n_nodes; id++)
        if (!same_node(node_at(a, id), node_at(b, id)))
            return false;
    for (size_t k = 0; k < a->n_loops; k++)
        if (a->loops[k].steps != b->loops[k].steps ||
            !ad_tape_same(a->loops[k].body, b->loops[k].body))
            return false;
    for (size_t k = 0; k < a->n_customs; k++)
        if (memcmp(&a->customs[k].by, &b->customs[k].by, sizeof a->customs[k].by) != 0)
            return false;
    return (!a->n_numbers ||
            memcmp(a->numbers, b->numbers, a->n_numbers * sizeof *a->numbers) == 0) &&
           (!a->n_lists || memcmp(a->lists, b->lists, a->n_lists * sizeof *a->lists) == 0);
}
