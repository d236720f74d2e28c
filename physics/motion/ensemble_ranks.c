/* Members of an ensemble from the rank that has run them to the others. */
#include "ensemble_run.h"

#include <stdio.h>
#include <stdlib.h>

/* Bytes to a stream, or from it. */
struct transfer {
    FILE *stream;
    bool out, failed;
};

static void move(struct transfer *t, void *data, size_t bytes)
{
    if (bytes == 0 || t->failed)
        return;
    if (t->out)
        t->failed = fwrite(data, bytes, 1, t->stream) != 1;
    else
        t->failed = fread(data, bytes, 1, t->stream) != 1;
}

/* An array of a struct that was moved: NULL stays NULL. */
static void move_array(struct transfer *t, void **array, size_t bytes)
{
    if (!*array)
        return;
    if (!t->out) {
        *array = t->failed ? NULL : malloc(bytes + 1);
        t->failed |= !*array;
    }
    move(t, *array, bytes);
}

static void move_crossed(struct transfer *t, struct phys_crossed *c, size_t dof, size_t crossings)
{
    const size_t column = c->n * sizeof(double);
    void *which = c->which, *touch = c->touch, *time = c->t, *x = c->x, *off = c->uncertainty,
         *constant = c->constant;
    move_array(t, &which, column);
    move_array(t, &touch, column);
    move_array(t, &time, column);
    move_array(t, &x, 2 * dof * column);
    move_array(t, &off, column);
    move_array(t, &constant, crossings * sizeof(bool));
    if (!t->out)
        *c = (struct phys_crossed){.n = c->n,
                                   .room = c->n,
                                   .which = which,
                                   .touch = touch,
                                   .t = time,
                                   .x = x,
                                   .uncertainty = off,
                                   .undecided = c->undecided,
                                   .which_undecided = c->which_undecided,
                                   .constant = constant};
}

static void move_members(const struct ensemble_task *task, struct transfer *t, size_t first,
                         size_t end)
{
    struct phys_ensemble *e = task->ensemble;
    const size_t states = 2 * e->dof, rows = e->n * e->n_times;
    for (size_t i = first; i < end && !t->failed; i++) {
        struct phys_crossed *c = &e->member[i].crossed;
        if (!t->out)
            phys_crossed_clear(c);
        move(t, e->x + i * e->n_times * states, e->n_times * states * sizeof *e->x);
        move(t, e->energy + i * e->n_times, e->n_times * sizeof *e->energy);
        move(t, e->energy + rows + i, sizeof *e->energy);
        move(t, &e->member[i], sizeof e->member[i]);
        move_crossed(t, c, e->dof, task->settings->motion->n_crossings);
    }
}

enum ad_status phys_ensemble_share(const struct ensemble_task *task, size_t from, size_t first,
                                   size_t end, struct ad_error *error)
{
    struct ad_ranks *ranks = task->settings->ranks;
    struct transfer t = {.out = ranks->rank == from};
    char *text = NULL;
    void *data = NULL;
    size_t bytes = 0;
    if (t.out && (t.stream = open_memstream(&text, &bytes))) {
        move_members(task, &t, first, end);
        t.failed |= fclose(t.stream) != 0;
        data = t.failed ? NULL : text;
    }
    ad_ranks_spread(ranks, from, &data, &bytes, error);
    if (!t.out && data && (t.stream = fmemopen(data, bytes, "r"))) {
        move_members(task, &t, first, end);
        fclose(t.stream);
    }
    if (error->status == AD_OK && (t.failed || !t.stream))
        ad_fail(error, AD_E_MEMORY, "out of memory for members of another rank");
    free(t.out ? text : data);
    return ad_ranks_agree(ranks, error);
}
