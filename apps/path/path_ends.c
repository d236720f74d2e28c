/* leastaction path --start, --end, --time: the ends of a path as they are given (path.h). */
#include "autodiff/free.h"
#include "path.h"
#include "physics/path/ends.h"
#include "physics/io/names.h"

#include <stdlib.h>
#include <string.h>

bool path_time_is_free(const struct path_options *options)
{
    return options->time && strcmp(options->time, "free") == 0;
}

/* ---- reading ---- */

size_t path_coordinate(const struct path_run *run, const char *name, struct ad_error *error)
{
    size_t dof = run->system.dof, k = dof;
    char(*names)[32] = malloc(dof * sizeof *names);
    const char **list = malloc(dof * sizeof *list);
    if (!names || !list)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    for (size_t d = 0; names && list && d < dof; d++) {
        phys_coordinate_name(&run->system, d, names[d], sizeof names[d]);
        list[d] = names[d];
    }
    if (error->status == AD_OK)
        k = phys_find("coordinate", name, dof, list, error);
    AD_FREE(names, list);
    return k;
}

/* One NAME=VALUE of --start or --end (`last`): a number, or free. */
static enum ad_status read_coordinate(struct path_run *run, const char *word, bool last, bool *seen,
                                      struct ad_error *error)
{
    const char *option = last ? "end" : "start", *equals = strchr(word, '=');
    char name[64];
    double value = NAN;
    bool free = equals && strcmp(equals + 1, "free") == 0;
    if (!equals || (!free && !options_number(equals + 1, &value)))
        return ad_fail(error, AD_E_ARGUMENT,
                       "--%s: expected NAME=VALUE, as in x=1.5, x=pi/2 or x=free, got '%s'", option,
                       word);
    snprintf(name, sizeof name, "%.*s", (int)(equals - word), word);
    size_t k = path_coordinate(run, name, error);
    if (error->status != AD_OK)
        return error->status;
    if (seen[k])
        return ad_fail(error, AD_E_ARGUMENT, "--%s: %s is given twice; expected it once", option,
                       name);
    seen[k] = true;
    run->given[2 * k + last] = value;
    run->moves[last * run->system.dof + k] = free;
    return AD_OK;
}

static void leave_free(struct path_run *run, size_t k, bool last)
{
    run->given[2 * k + last] = (double)NAN;
    run->moves[last * run->system.dof + k] = true;
}

/* All coordinates of an end: x=1,y=-0.5. */
static enum ad_status read_list(struct path_run *run, const char *text, bool last,
                                struct ad_error *error)
{
    size_t dof = run->system.dof;
    char *copy = strdup(text), name[32];
    bool *seen = calloc(dof, sizeof *seen);
    if (!copy || !seen)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    for (char *word = copy, *comma; error->status == AD_OK && word; word = comma) {
        comma = strchr(word, ',');
        if (comma)
            *comma++ = '\0';
        read_coordinate(run, word, last, seen, error);
    }
    for (size_t k = 0; error->status == AD_OK && k < dof; k++)
        if (!seen[k] && run->options->relate) {
            leave_free(run, k, last);
        } else if (!seen[k]) {
            phys_coordinate_name(&run->system, k, name, sizeof name);
            ad_fail(error, AD_E_ARGUMENT,
                    "--%s: no value of %s, expected one for every coordinate; or %s=free",
                    last ? "end" : "start", name, name);
        }
    AD_FREE(copy, seen);
    return error->status;
}

/* The scene's own start. */
static enum ad_status scene_start(struct path_run *run, double *q, struct ad_error *error)
{
    const struct phys_scene *scene = run->system.scene;
    size_t dof = run->system.dof;
    double *room = malloc(2 * dof * sizeof *room);
    if (!room)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    else if (scene->between && scene->between(run->system.params, 2, room, error) == AD_OK)
        for (size_t k = 0; k < dof; k++)
            q[k] = room[2 * k];
    else if (!scene->between && scene->start(run->system.params, run->options->common.seed, room,
                                             room + dof, error) == AD_OK)
        memcpy(q, room, dof * sizeof *q);
    free(room);
    return error->status;
}

static enum ad_status read_end(struct path_run *run, const char *text, bool last,
                               struct ad_error *error)
{
    size_t dof = run->system.dof;
    for (size_t k = 0; !text && run->options->relate && k < dof; k++)
        leave_free(run, k, last);
    if (!text && run->options->relate)
        return AD_OK;
    if (text && (strchr(text, '=') || strspn(text, "0123456789.,+-") == strlen(text)))
        return read_list(run, text, last, error);
    double *row = malloc(dof * sizeof *row);
    if (!row)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if ((text ? path_read_end(run, text, last, row, error) : scene_start(run, row, error)) == AD_OK)
        for (size_t k = 0; k < dof; k++)
            run->given[2 * k + last] = row[k];
    free(row);
    return error->status;
}

static enum ad_status read_time(struct path_run *run, struct ad_error *error)
{
    const char *text = run->options->time;
    double time;
    if (!text || path_time_is_free(run->options))
        return AD_OK;
    if (!options_number(text, &time) || !(time > 0))
        return ad_fail(error, AD_E_ARGUMENT, "--time: expected a number over 0, or free, got '%s'",
                       text);
    run->settings.dt = time / (double)(run->settings.slices - 1) / (double)path_shares(run);
    return AD_OK;
}

enum ad_status path_ends(struct path_run *run, struct ad_error *error)
{
    const struct path_options *options = run->options;
    size_t dof = run->system.dof;
    bool given = options->start || options->end || options->relate;
    bool free_time = run->system.scene->free_time || path_time_is_free(options);
    const struct conflict rows[] = {
        {options->start && !options->end && !options->relate, "--start needs --end, the other end"},
        {given && (options->data || options->preset || strcmp(options->ends, "both") != 0),
         "--start, --end, --relate do not go with --data, --preset, --ends: these give the ends"},
        {options->time && ((!isnan(options->dt) && !path_time_is_free(options)) || options->data ||
                           options->preset),
         "--time does not go with --dt, --data, --preset: these give the time"},
        {options->time && !path_time_is_free(options) && run->system.scene->free_time,
         "--time: the end time of this scene is free, expected free; --dt is where its search "
         "begins"},
        {free_time && options->hold != 1,
         "--hold does not go with a free end time: its slices would keep their places, not their "
         "times"},
        {path_time_is_free(options) && options->solver && strcmp(options->solver, "newton") != 0,
         "--time free needs --solver newton; leave out --solver"},
        {path_time_is_free(options) && strcmp(options->ends, "both") != 0,
         "--time free does not go with --ends start: it needs both ends"},
    };
    if (options_conflicts(sizeof rows / sizeof *rows, rows, error) != AD_OK ||
        read_time(run, error) != AD_OK)
        return error->status;
    run->ends.size = sizeof run->ends;
    run->ends.free_time = free_time;
    run->ends.energy = option_number_or(options->energy, 0);
    run->settings.ends = &run->ends;
    if (path_is_periodic(options))
        return path_periodic_ends(run, error);
    if (!given)
        return AD_OK;
    run->given = malloc(2 * dof * sizeof *run->given);
    run->moves = calloc(2 * dof, sizeof *run->moves);
    if (!run->given || !run->moves)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    for (size_t end = 0; end < 2; end++) {
        const bool *moves = run->moves + end * dof;
        if (read_end(run, end ? options->end : options->start, end, error) != AD_OK)
            return error->status;
        run->ends.free[end] = memchr(moves, 1, dof * sizeof *moves) ? moves : NULL;
    }
    if (path_relations(run, error) != AD_OK)
        return error->status;
    bool free = run->ends.free[0] || run->ends.free[1] || options->relate;
    bool serves =
        strcmp(run->solver->name, "newton") == 0 || strcmp(run->solver->name, "lbfgs") == 0;
    if (free && (!serves || options->hold != 1))
        return ad_fail(error, AD_E_ARGUMENT,
                       "--start, --end, --relate: a coordinate that is free or related needs "
                       "--solver newton or lbfgs and no --hold");
    return AD_OK;
}

/* ---- the start of the run, and what was found ---- */

/* Free coordinates begin where the path given has them; on a line where the other end is, or the
   scene's start; then at the nearest ends that keep the relations. */
enum ad_status path_meet_ends(struct path_run *run, bool line, struct ad_error *error)
{
    size_t dof = run->system.dof, n = run->settings.slices;
    double *between = path_new(run, error), *q = malloc(dof * sizeof *q);
    if (!between || !q || (line && scene_start(run, q, error) != AD_OK)) {
        AD_FREE(between, q);
        return error->status == AD_OK ? ad_fail(error, AD_E_MEMORY, "out of memory")
                                      : error->status;
    }
    for (size_t k = 0; k < dof; k++)
        for (size_t end = 0; end < 2; end++) {
            double here = run->given[2 * k + end], other = run->given[2 * k + 1 - end];
            size_t at = k * n + end * (n - 1);
            double loose = !line ? run->start[at] : isnan(other) ? q[k] : other;
            between[at] = isnan(here) ? loose : here;
        }
    struct phys_end_space space = {0};
    struct ad_error lost = {0};
    if (phys_ends_check(&run->system, &run->ends, n, between, &lost) == AD_OK &&
        phys_end_space_new(&space, &run->ends, dof, &lost) == AD_OK)
        phys_end_space_meet_path(&space, n, between);
    else
        ad_fail(error, lost.status, "--relate: %s", lost.message);
    phys_end_space_free(&space);
    if (line)
        phys_path_line(dof, n, between, run->start);
    else
        phys_path_bend(dof, n, between, run->start);
    for (size_t k = 0; k < dof; k++) { /* to the last bit */
        run->start[k * n] = between[k * n];
        run->start[k * n + n - 1] = between[k * n + n - 1];
    }
    AD_FREE(between, q);
    return error->status;
}

void path_report_ends(const struct path_run *run, struct report *report)
{
    size_t dof = run->system.dof, n = run->settings.slices;
    char name[32];
    if (path_is_periodic(run->options)) {
        path_periodic_report(run, report);
        return;
    }
    if (run->ends.free_time)
        report_number(report, "time", "time, found", run->system.scene->time_unit,
                      run->settings.dt * (double)(n - 1));
    for (size_t k = 0; k < 2 * dof && run->moves; k++) {
        size_t d = k % dof, last = k / dof;
        if (!run->moves[k])
            continue;
        phys_coordinate_name(&run->system, d, name, sizeof name);
        report_item(report, "free");
        report_text(report, "at", "free at the", last ? "end" : "start");
        report_text(report, "coordinate", "coordinate", name);
        report_number(report, "value", "found", run->system.scene->unit,
                      run->path[d * n + last * (n - 1)]);
    }
    report_item(report, NULL);
    if (run->ends.free[1])
        report_number(report, "free_momentum", "momentum of what is free, of the motion", NULL,
                      run->found.free_momentum);
}
