/* A path by blocks of slices, which ranks share (path.h): each has its part of the path alone, and
   rank 0 writes the results, to which the others send theirs piece by piece. */
#include "apps/command.h"
#include "apps/interrupt.h"
#include "apps/output/outputs.h"
#include "path.h"
#include "physics/lagrangian/conserved.h"

#include <stdlib.h>
#include <string.h>

enum { PIECE = 1 << 18 }; /* numbers sent at once: 2 MiB, or a slice that is longer */

bool path_by_blocks(const struct path_options *options)
{
    return options->blocks || (options->common.ranks && !path_wants_all(options));
}

enum ad_status path_blocks_check(const struct path_options *options, struct ad_error *error)
{
    return options_refuse(
        &options->common,
        "preset inputs data from days dims bodies reference stop-at-reference tol "
        "continue all energy energy-loss energy-weight ends hold noise every "
        "plot",
        "does not go with ranks, nor with --blocks; leave it out, or take one "
        "process",
        error);
}

static size_t rank_of(const struct path_run *run)
{
    const struct ad_ranks *ranks = run->options->common.ranks;
    return ranks ? ranks->rank : 0;
}

enum ad_status path_blocks_start(struct path_run *run, struct ad_error *error)
{
    const struct path_options *options = run->options;
    struct ad_ranks *ranks = options->common.ranks;
    size_t rows = run->settings.rule->degree * run->system.dof;
    bool line = path_from_line(options);
    if (options->init && !line && strcmp(options->init, "ode") != 0)
        return ad_fail(error, AD_E_ARGUMENT,
                       "--init %s: ranks and --blocks start from line or ode; expected one of them",
                       options->init);
    if (run->ends.free_time || run->ends.free[0] || run->ends.free[1] || run->ends.n_relations)
        return ad_fail(error, AD_E_ARGUMENT,
                       "free ends and a free time do not go with ranks, nor with --blocks; give "
                       "both ends, or take one process");
    run->settings.ends = NULL;
    if (phys_path_share(ranks, rank_of(run), run->settings.slices, &run->share, error) != AD_OK)
        return error->status;
    if (run->share.slices <= SIZE_MAX / rows / sizeof *run->path)
        run->path = malloc(rows * run->share.slices * sizeof *run->path);
    if (!run->path)
        ad_fail(error, AD_E_MEMORY, "no memory for a share of %zu slices", run->share.slices);
    run->settings.proceed = interrupt_proceed;
    if (ad_ranks_agree(ranks, error) == AD_OK)
        phys_path_ranks_start(ranks, &run->system, &run->settings, options->common.seed, line,
                              run->given, run->path, error);
    run->settings.proceed = NULL;
    return error->status;
}

/* A run, and the files of this rank. */
struct blocks_run {
    struct path_run run;
    struct outputs *outputs;
};

static enum ad_status find(struct path_run *run, struct ad_error *error)
{
    struct ad_ranks *ranks = run->options->common.ranks;
    struct phys_path_found *found = &run->found;
    run->settings.progress = path_record_step;
    run->settings.context = &run->record;
    interrupt_catch();
    path_record_begin(&run->record, run, NULL, false);
    phys_path_ranks_solve(ranks, run->solver, &run->system, &run->settings, run->path, &found->info,
                          error);
    progress_end(&run->record.progress);
    run->settings.progress = NULL;
    found->stationary =
        found->info.stop == PHYS_STOP_ROUNDING && strcmp(run->solver->name, "newton") == 0;
    found->keeps_energy = phys_keeps_energy(&run->system, error);
    if (found->stationary && error->status == AD_OK)
        phys_path_ranks_spectrum(ranks, &run->system, &run->settings, run->path, &found->spectrum,
                                 error);
    return error->status;
}

/* ---- writing ---- */

/* Takes slices `first` to first + n - 1 of a path, one a row: [n x dof]. */
typedef void take_slices(const struct path_run *run, size_t first, size_t n, const double *slices,
                         void *to);

/* Every slice of the path in order, to rank 0; `own`: those of this rank, here. */
static enum ad_status each_piece(const struct path_run *run, bool own, take_slices *take, void *to,
                                 struct ad_error *error)
{
    struct ad_ranks *ranks = run->options->common.ranks;
    const size_t dof = run->system.dof, me = rank_of(run), count = ranks ? ranks->count : 1;
    const size_t most = dof < PIECE ? PIECE / dof : 1;
    double *piece = malloc(most * dof * sizeof *piece);
    if (!piece)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    for (size_t rank = 0; rank < count && error->status == AD_OK; rank++) {
        struct phys_path_share s;
        phys_path_share(ranks, rank, run->settings.slices, &s, error);
        size_t slices = s.slices - (rank + 1 < count), n; /* the last is the next one's first */
        if (own && me != rank)
            continue;
        for (size_t i = 0; i < slices && error->status == AD_OK; i += n) {
            n = slices - i < most ? slices - i : most;
            for (size_t k = 0; me == rank && k < n * dof; k++)
                piece[k] = run->path[k % dof * s.slices + i + k / dof];
            if (me == 0 && rank > 0)
                ad_ranks_exchange(ranks, AD_NO_RANK, NULL, rank, piece, n * dof * sizeof *piece,
                                  error);
            else if (!own && me == rank && rank > 0)
                ad_ranks_exchange(ranks, 0, piece, AD_NO_RANK, NULL, n * dof * sizeof *piece,
                                  error);
            if ((own || me == 0) && error->status == AD_OK)
                take(run, s.first + i, n, piece, to);
        }
    }
    free(piece);
    return error->status;
}

static void write_rows(const struct path_run *run, size_t first, size_t n, const double *slices,
                       void *to)
{
    const size_t dof = run->system.dof;
    for (size_t i = 0; i < n; i++) {
        fprintf(to, "%.17g", (double)(first + i) * run->settings.dt);
        for (size_t k = 0; k < dof; k++)
            fprintf(to, ",%.17g", slices[i * dof + k]);
        fputc('\n', to);
    }
}

static void put_rows(const struct path_run *run, size_t first, size_t n, const double *slices,
                     void *to)
{
    (void)run;
    phys_hdf5_put(to, "slices", first, n, slices);
}

/* By all ranks into one file, where HDF5 and the file system let them. */
static enum ad_status put_all(const struct path_run *run, phys_hdf5 *file, struct ad_error *error)
{
    struct ad_ranks *ranks = run->options->common.ranks;
    bool shared;
    if (phys_hdf5_share(ranks, &file, &shared, error) != AD_OK)
        return error->status;
    each_piece(run, shared, put_rows, file, error);
    return shared ? phys_hdf5_unshare(ranks, &file, error) : error->status;
}

static enum ad_status begin(void *context, struct outputs *outputs, struct ad_error *error)
{
    struct blocks_run *blocks = context;
    blocks->outputs = outputs;
    return error->status;
}

/* Finds the path, and writes it while all ranks are there. */
static enum ad_status solve(void *context, struct ad_error *error)
{
    struct blocks_run *blocks = context;
    const struct path_run *run = &blocks->run;
    const struct common *common = &run->options->common;
    FILE *csv = blocks->outputs->csv.out;
    phys_hdf5 *file = blocks->outputs->file;
    if (find(&blocks->run, error) != AD_OK)
        return error->status;
    if (csv)
        path_write_titles(run, csv);
    if (file) {
        phys_hdf5_blank(file, "slices", AD_F64, 2,
                        (size_t[]){run->settings.slices, run->system.dof});
        phys_hdf5_text(file, "slices", "unit", run->system.scene->unit);
        phys_hdf5_text(file, "slices", "axes", "slice, coordinate");
    }
    if (common->csv && each_piece(run, false, write_rows, csv, error) != AD_OK)
        return error->status;
    return common->out ? put_all(run, file, error) : AD_OK;
}

static enum ad_status write_file(const void *context, phys_hdf5 *file, struct ad_error *error)
{
    const struct path_run *run = context;
    report_parameters(&run->system, file);
    return error->status;
}

static void written(const void *context, FILE *out) { (void)context, (void)out; }

static const struct output_kind outputs = {path_report_blocks, write_file, written, NULL, begin};

static int judge(const struct path_run *run, struct ad_error *error)
{
    const struct phys_path_info *info = &run->found.info;
    bool newton = strcmp(run->solver->name, "newton") == 0;
    bool asked = newton || run->settings.tolerance > 0;
    if (info->stop == PHYS_STOP_INTERRUPTED)
        ad_fail(error, AD_E_ACCURACY, "interrupted after step %zu of %zu; results are partial",
                info->steps, run->settings.steps);
    else if (asked && info->stop != PHYS_STOP_ROUNDING && info->stop != PHYS_STOP_TOLERANCE)
        ad_fail(error, AD_E_ACCURACY,
                "not converged: %s, |gradient| %.3g after %zu steps; try "
                "--init ode, more --steps, or a smaller --dt",
                path_stop_name(info->stop), info->grad_norm, info->steps);
    return error->status == AD_OK ? DONE : NOT_REACHED;
}

int path_blocks_run(const struct path_options *options, struct ad_error *error)
{
    struct blocks_run blocks = {0};
    bool done = path_setup(options, &blocks.run, error) == AD_OK &&
                outputs_run(&outputs, &options->common, &blocks, solve, error) == AD_OK;
    int status = done ? judge(&blocks.run, error) : command_status(error);
    path_run_free(&blocks.run);
    return status;
}
