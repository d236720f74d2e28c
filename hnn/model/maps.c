/* Which tensors of a file are the maps of a perceptron (maps.h). */
#include "maps.h"
#include "internal.h"

#include <ctype.h>
#include <stdlib.h>
#include <string.h>

/* By the numbers in names, then by the rest: linear10 behind linear9. */
static int by_name(const char *a, const char *b)
{
    while (*a && *b) {
        if (isdigit((unsigned char)*a) && isdigit((unsigned char)*b)) {
            char *end_a, *end_b;
            const unsigned long long x = strtoull(a, &end_a, 10), y = strtoull(b, &end_b, 10);
            if (x != y)
                return x < y ? -1 : 1;
            a = end_a;
            b = end_b;
        } else if (*a != *b) {
            break;
        } else {
            a++;
            b++;
        }
    }
    return (unsigned char)*a - (unsigned char)*b;
}

static int by_weight(const void *a, const void *b)
{
    const struct hnn_tensor *const *s = a, *const *t = b;
    return by_name((*s)->name, (*t)->name);
}

/* Whether names differ in numbers alone. */
static bool same_words(const char *a, const char *b)
{
    for (;; a++, b++) {
        while (isdigit((unsigned char)*a) && isdigit((unsigned char)a[1]))
            a++;
        while (isdigit((unsigned char)*b) && isdigit((unsigned char)b[1]))
            b++;
        if (*a != *b && !(isdigit((unsigned char)*a) && isdigit((unsigned char)*b)))
            return false;
        if (!*a)
            return true;
    }
}

/* A search for the orders of maps that shapes and, among names of the same words, numbers allow. */
struct orders {
    const struct hnn_tensor *const *weight; /* [n], by name */
    const struct hnn_tensor *at[HNN_LAYERS_MOST], *found[HNN_LAYERS_MOST];
    size_t n, count, looks; /* count: how many were found, at most 2 */
    bool used[HNN_LAYERS_MOST];
};
enum { LOOKS_MOST = 100000 };

/* Whether map k may come next: behind all of its words with smaller numbers. */
static bool may_follow(const struct orders *o, size_t depth, size_t k)
{
    bool may = !o->used[k] && (depth == 0 || o->weight[k]->dims[1] == o->at[depth - 1]->dims[0]);
    for (size_t j = 0; j < k && may; j++)
        may = o->used[j] || !same_words(o->weight[j]->name, o->weight[k]->name) ||
              by_name(o->weight[j]->name, o->weight[k]->name) == 0;
    return may;
}

static void find_orders(struct orders *o, size_t depth)
{
    if (depth == o->n && o->count++ == 0)
        memcpy(o->found, o->at, sizeof o->found);
    for (size_t k = 0; k < o->n && depth < o->n && o->count < 2; k++)
        if (may_follow(o, depth, k) && o->looks++ < LOOKS_MOST) {
            o->used[k] = true;
            o->at[depth] = o->weight[k];
            find_orders(o, depth + 1);
            o->used[k] = false;
        }
}

/* Maps by the numbers in their names; where words differ, in the one order that shapes allow. */
static enum ad_status order_maps(const struct hnn_tensors *t, struct hnn_maps *m,
                                 struct ad_error *error)
{
    size_t same = 1;
    qsort(m->weight, m->n, sizeof m->weight[0], by_weight);
    while (same < m->n && same_words(m->weight[0]->name, m->weight[same]->name) &&
           by_name(m->weight[same - 1]->name, m->weight[same]->name) != 0)
        same++;
    if (same == m->n)
        return AD_OK;
    struct orders o = {.weight = m->weight, .n = m->n};
    find_orders(&o, 0);
    if (o.count != 1 || o.looks > LOOKS_MOST)
        return ad_fail(error, AD_E_INPUT,
                       "%s: '%.80s' and '%.80s': %s; expected names that differ in one number, as "
                       "net.0.weight, net.2.weight",
                       t->file, m->weight[0]->name, m->weight[same]->name,
                       o.count ? "neither numbers in their names nor shapes tell their order"
                               : "shapes fit in no order");
    memcpy(m->weight, o.found, sizeof m->weight);
    return AD_OK;
}

static bool ends_in(const char *name, const char *end)
{
    const size_t n = strlen(name), m = strlen(end);
    return n >= m && strcmp(name + n - m, end) == 0;
}

static const struct hnn_tensor *bias_of(const struct hnn_tensors *t,
                                        const struct hnn_tensor *weight)
{
    const size_t stem = strlen(weight->name) - strlen("weight");
    for (size_t k = 0; k < t->n; k++)
        if (strlen(t->tensor[k].name) == stem + strlen("bias") &&
            strncmp(t->tensor[k].name, weight->name, stem) == 0 &&
            strcmp(t->tensor[k].name + stem, "bias") == 0)
            return &t->tensor[k];
    return NULL;
}

enum ad_status hnn_maps_find(const struct hnn_tensors *t, struct hnn_maps *m,
                             struct ad_error *error)
{
    *m = (struct hnn_maps){0};
    for (size_t k = 0; k < t->n; k++)
        if (ends_in(t->tensor[k].name, "weight") && t->tensor[k].rank == 2) {
            if (m->n == HNN_LAYERS_MOST)
                return ad_fail(error, AD_E_INPUT, "%s: over %d maps", t->file, HNN_LAYERS_MOST);
            m->weight[m->n++] = &t->tensor[k];
        }
    if (m->n && order_maps(t, m, error) != AD_OK)
        return error->status;
    for (size_t k = 0; k < m->n; k++) {
        const struct hnn_tensor *w = m->weight[k], *b = m->bias[k] = bias_of(t, w);
        if (k && w->dims[1] != m->weight[k - 1]->dims[0])
            return ad_fail(
                error, AD_E_INPUT, "%s: '%.80s' has %zu columns, expected %zu, the rows of '%.80s'",
                t->file, w->name, w->dims[1], m->weight[k - 1]->dims[0], m->weight[k - 1]->name);
        if (b && (b->rank != 1 || b->dims[0] != w->dims[0]))
            return ad_fail(error, AD_E_INPUT, "%s: '%.80s' has another shape, expected [%zu]",
                           t->file, b->name, w->dims[0]);
    }
    for (size_t k = 0; k < t->n; k++) {
        bool known = false;
        for (size_t i = 0; i < m->n; i++)
            known = known || m->weight[i] == &t->tensor[k] || m->bias[i] == &t->tensor[k];
        if (!known)
            return ad_fail(error, AD_E_INPUT,
                           "%s: '%.80s' is neither X.weight [out x in] nor X.bias [out] of a "
                           "perceptron; expected these alone",
                           t->file, t->tensor[k].name);
    }
    return m->n ? AD_OK : ad_fail(error, AD_E_INPUT, "%s: has no X.weight [out x in]", t->file);
}

size_t hnn_maps_outputs(const struct hnn_settings *s, size_t given, size_t *first)
{
    const bool H = s->kind == HNN_HAMILTONIAN;
    *first = H && given == 2 && s->field == HNN_SYMPLECTIC;
    return s->kind == HNN_BASELINE ? 2 * s->dof : H && (given == 2 || s->field == HNN_BOTH) ? 2 : 1;
}

enum ad_status hnn_maps_settings(const struct hnn_tensors *t, const struct hnn_maps *m,
                                 const struct hnn_settings *assumed, struct hnn_settings *s,
                                 struct ad_error *error)
{
    const size_t inputs = m->weight[0]->dims[1], outputs = m->weight[m->n - 1]->dims[0];
    size_t first;
    *s = *assumed;
    s->dof = inputs / 2;
    s->layers = m->n;
    s->precision = AD_F32;
    for (size_t k = 0; k < t->n; k++)
        if (t->tensor[k].dtype && strcmp(t->tensor[k].dtype, "F64") == 0)
            s->precision = AD_F64;
    for (size_t k = 0; k + 1 < m->n; k++)
        s->hidden[k] = m->weight[k]->dims[0];
    if (inputs == 0 || inputs % 2)
        return ad_fail(error, AD_E_INPUT,
                       "%s: '%.80s' has %zu columns; expected an even number, coordinates and as "
                       "many momenta or velocities",
                       t->file, m->weight[0]->name, inputs);
    if (outputs != hnn_maps_outputs(s, outputs, &first))
        return ad_fail(error, AD_E_INPUT, "%s: '%.80s' has %zu rows; expected %zu of model %s%s",
                       t->file, m->weight[m->n - 1]->name, outputs,
                       hnn_maps_outputs(s, outputs, &first), hnn_kinds[s->kind],
                       s->kind == HNN_BASELINE ? "" : "; try --model baseline");
    return AD_OK;
}
