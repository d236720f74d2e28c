/* leastaction chart scale: what ranks send, counted exactly on threads of this process and compared
   with a model; and by that model the time of a step on 1 to 10 000 ranks.

   The model is LogGP (Alexandrov, Ionescu, Schauser, Scheiman, SPAA 1995) without overhead and gap:
   a message of k bytes takes L + k / bandwidth. Of p ranks a broadcast, a sum or an agreement takes
   log2 p of them in turn. */
#include "chart.h"
#include "apps/bench/measure/thread_ranks.h"
#include "apps/bench/measure/timing.h"
#include "autodiff/clock.h"
#include "physics/physics.h"

#include <math.h>
#include <stdlib.h>

static const double DURATION = 10; /* short enough for full steps of Newton from a line */
enum { MOST = 4, SLICES = 8193, SLICES_QUICK = 1025, SUM_BLOCKS = 244, SUM_NUMBERS = 41000 };

/* ---- the model: messages and bytes of all ranks together, and the time of one after another ----
 */

struct traffic {
    double messages, bytes, seconds;
};

struct network {
    double latency, bandwidth; /* s, bytes/s */
};

static void broadcast(struct traffic *t, const struct network *net, double ranks, double bytes)
{
    t->messages += ranks - 1;
    t->bytes += (ranks - 1) * bytes;
    t->seconds += ceil(log2(ranks)) * (net->latency + bytes / net->bandwidth);
}

/* A slice to each neighbour, and one from each. */
static void halo(struct traffic *t, const struct network *net, double ranks, double bytes)
{
    t->messages += 2 * (ranks - 1);
    t->bytes += 2 * (ranks - 1) * bytes;
    t->seconds += ranks > 1 ? 2 * (net->latency + bytes / net->bandwidth) : 0;
}

static double first_of(double blocks, double ranks, double rank)
{
    return floor(blocks / ranks) * rank + floor(fmod(blocks, ranks) * rank / ranks);
}

/* Nodes of the tree over blocks whose halves different ranks begin: half has the largest power of
   two below the whole. [low, high) are the ranks that have a part. */
static double crossings(double first, double last, double blocks, double ranks, double low,
                        double high)
{
    while (low + 1 < high && first_of(blocks, ranks, low + 1) <= first)
        low++;
    while (high > low + 1 && first_of(blocks, ranks, high - 1) >= last)
        high--;
    if (high - low < 2 || last - first < 2)
        return 0;
    double half = 1;
    while (2 * half < last - first)
        half *= 2;
    bool apart = first_of(blocks, ranks, low + 1) <= first + half;
    return apart + crossings(first, first + half, blocks, ranks, low, high) +
           crossings(first + half, last, blocks, ranks, low, high);
}

/* A message at each crossing of the tree, up or down. */
static void tree(struct traffic *t, const struct network *net, double ranks, double blocks,
                 double bytes)
{
    double messages = crossings(0, blocks, blocks, ranks, 0, ranks);
    t->messages += messages;
    t->bytes += messages * bytes;
    t->seconds += ceil(log2(ranks)) * (net->latency + bytes / net->bandwidth);
}

/* ad_ranks_agree: two numbers of each rank in each of log2 p rounds. */
static void agree(struct traffic *t, const struct network *net, double ranks)
{
    const double rounds = ceil(log2(ranks)), bytes = 16;
    t->messages += ranks * rounds;
    t->bytes += ranks * rounds * bytes;
    t->seconds += rounds * (net->latency + bytes / net->bandwidth);
}

/* ad_ranks_sum of n numbers. */
static void sum(struct traffic *t, const struct network *net, double ranks, double blocks, double n)
{
    if (ranks == 1)
        return;
    agree(t, net, ranks);
    tree(t, net, ranks, blocks, 8 * n);
    broadcast(t, net, ranks, 8 * n);
}

static void gradient(struct traffic *t, const struct network *net, double ranks, double blocks,
                     double dof)
{
    sum(t, net, ranks, blocks, 2);
    halo(t, net, ranks, 8 * dof);
    sum(t, net, ranks, blocks, 2);
}

/* Elimination, its way back, the length of the step, and the gradient behind it. */
static void newton(struct traffic *t, const struct network *net, double ranks, double blocks,
                   double dof)
{
    sum(t, net, ranks, blocks, 1);
    tree(t, net, ranks, blocks, 8 * ((2 * dof + 1) * (2 * dof + 1) + 2));
    broadcast(t, net, ranks, 16);
    tree(t, net, ranks, blocks, 16 * dof);
    sum(t, net, ranks, blocks, 2);
    gradient(t, net, ranks, blocks, dof);
}

/* ---- counted ---- */

static double blocks_of(double slices)
{
    double length = fmin(128, fmax(4, floor((slices - 1) / 64)));
    return ceil((slices - 1) / length);
}

struct count {
    struct phys_system system;
    struct phys_path_settings settings;
    struct traffic counted[MOST];
    struct ad_error error[MOST];
};

static enum ad_status numbers_of_block(void *context, size_t k, double *values,
                                       struct ad_error *error)
{
    (void)context;
    for (size_t i = 0; i < SUM_NUMBERS; i++)
        values[i] = (double)(k + i);
    return error->status;
}

static void count_sum(void *context, struct ad_ranks *r)
{
    struct count *c = context;
    double *total = malloc(SUM_NUMBERS * sizeof *total);
    if (total)
        ad_ranks_sum(r, SUM_BLOCKS, SUM_NUMBERS, numbers_of_block, NULL, total, &c->error[r->rank]);
    else
        ad_fail(&c->error[r->rank], AD_E_MEMORY, "out of memory");
    free(total);
    c->counted[r->rank] = (struct traffic){(double)r->messages, (double)r->bytes, 0};
}

/* What one more step of a solver sends, as the difference of two runs, and how long the run of two
   steps takes. */
static void count_step(void *context, struct ad_ranks *r, const char *solver)
{
    struct count *c = context;
    struct ad_error *error = &c->error[r->rank];
    struct phys_path_settings settings = c->settings;
    struct phys_path_share share;
    struct phys_path_info info;
    struct traffic *t = &c->counted[r->rank];
    *t = (struct traffic){0};
    if (phys_path_share(r, r->rank, settings.slices, &share, error) != AD_OK)
        return;
    double *path = malloc(c->system.dof * share.slices * sizeof *path);
    for (settings.steps = 1; path && settings.steps <= 2; settings.steps++) {
        double sign = settings.steps == 2 ? 1 : -1;
        phys_path_ranks_start(r, &c->system, &settings, 1, true, NULL, path, error);
        uint64_t messages = r->messages, bytes = r->bytes;
        const double start = ad_now();
        phys_path_ranks_solve(r, phys_solver_find(solver, error), &c->system, &settings, path,
                              &info, error);
        t->seconds = ad_now() - start;
        t->messages += sign * (double)(r->messages - messages);
        t->bytes += sign * (double)(r->bytes - bytes);
    }
    free(path);
}

static void count_gradient(void *context, struct ad_ranks *r) { count_step(context, r, "adam"); }
static void count_newton(void *context, struct ad_ranks *r) { count_step(context, r, "newton"); }

static const struct column counts_columns[] = {
    {.key = "job", .title = "sent by all ranks", .width = -28},
    {.key = "ranks", .title = "ranks", .width = 5, .shown = 2},
    {.key = "slices", .digits = 9},
    {.key = "messages", .digits = 12, .title = "messages", .width = 9, .shown = 9},
    {.key = "bytes", .digits = 15, .title = "bytes", .width = 12, .shown = 12},
    {.key = "model_messages", .digits = 12},
    {.key = "model_bytes", .digits = 15},
    {.key = "as_modelled", .title = "as modelled", .width = 11},
    {.key = "two_steps_seconds",
     .digits = 4,
     .title = "2 steps (ms)",
     .width = 10,
     .shown = 3,
     .scale = 1e3},
    {.key = NULL},
};

static const struct counted_job {
    const char *name;
    void (*work)(void *context, struct ad_ranks *ranks);
    void (*model)(struct traffic *t, const struct network *net, double ranks, double blocks,
                  double dof);
    bool weak; /* a path whose slices grow with the ranks */
} counted_jobs[] = {
    {"sum of 41000 numbers", count_sum, NULL, false},
    {"path: gradient", count_gradient, gradient, false},
    {"path: step of newton", count_newton, newton, false},
    {"path: the same (weak)", count_newton, newton, true},
};

static enum ad_status count(struct chart *chart, struct sheet *sheet, const struct counted_job *job,
                            size_t ranks, struct ad_error *error)
{
    const struct network any = {1, 1};
    struct count c = {0};
    struct traffic all = {0}, model = {0};
    if (phys_system_open("threebody", &c.system, error) != AD_OK)
        return error->status;
    c.settings = phys_path_defaults(&c.system);
    c.settings.slices = chart->quick ? SLICES_QUICK : SLICES;
    c.settings.slices = (c.settings.slices - 1) * (job->weak ? ranks : 1) + 1;
    c.settings.dt = DURATION / (double)(c.settings.slices - 1);
    c.settings.learning_rate = 1e-9;
    with_ranks(ranks, job->work, &c);
    for (size_t k = 0; k < ranks; k++) {
        all.messages += c.counted[k].messages;
        all.bytes += c.counted[k].bytes;
        all.seconds = fmax(all.seconds, c.counted[k].seconds);
        ad_fail(error, c.error[k].status, "%s", c.error[k].message);
    }
    if (job->model)
        job->model(&model, &any, (double)ranks, blocks_of((double)c.settings.slices),
                   (double)c.system.dof);
    else
        sum(&model, &any, (double)ranks, SUM_BLOCKS, SUM_NUMBERS);
    bool same = all.messages == model.messages && all.bytes == model.bytes;
    if (!same)
        chart->missed = "ranks sent other messages than the model has";
    phys_system_close(&c.system);
    return sheet_row(sheet,
                     ROW(NAME(job->name), NUMBER(ranks),
                         NUMBER(job->model ? (double)c.settings.slices : NAN), NUMBER(all.messages),
                         NUMBER(all.bytes), NUMBER(model.messages), NUMBER(model.bytes),
                         NAME(same ? "yes" : "no"), NUMBER(job->model ? all.seconds : NAN)),
                     error);
}

/* ---- planned ---- */

static const struct column model_columns[] = {
    {.key = "job"},
    {.key = "ranks"},
    {.key = "seconds", .digits = 4},
    {.key = "speedup", .digits = 4},
    {.key = "efficiency", .digits = 4},
    {.key = "sending_share", .digits = 4},
    {.key = NULL},
};

/* Work is dealt in whole blocks: floating-point operations of one, and how many. The operations are
   estimates: a Hamiltonian network's step takes 16 for each parameter and sample, a slice of three
   bodies 4000 in a step of Newton's method and 300 in a gradient, a member of an ensemble 1e9. */
static const struct planned_job {
    const char *name;
    double blocks, work;
    int kind; /* 0: sum, 1: gradient, 2: newton, 3: ensemble */
} planned_jobs[] = {
    {"training on 1e6 samples", SUM_BLOCKS, 4096 * 16.0 * SUM_NUMBERS, 0},
    {"gradient of 1e6 slices", 7813, 128 * 300, 1},
    {"newton of 1e6 slices", 7813, 128 * 4000, 2},
    {"newton of 1e8 slices", 781250, 128 * 4000, 2},
    {"ensemble of 1e5 members", 1e5, 1e9, 3},
};
enum { THREE_BODIES = 6 };

static struct traffic sending(const struct planned_job *job, const struct network *net,
                              double ranks)
{
    struct traffic t = {0};
    if (job->kind == 0)
        sum(&t, net, ranks, job->blocks, SUM_NUMBERS);
    else if (job->kind == 1)
        gradient(&t, net, ranks, job->blocks, THREE_BODIES);
    else if (job->kind == 2)
        newton(&t, net, ranks, job->blocks, THREE_BODIES);
    else if (ranks > 1) /* rank 0 deals out groups of members, one after another (ad_ranks_deal) */
        t.seconds = fmin(job->blocks, 4 * ranks * (1 + fmax(0, log(job->blocks / (4 * ranks))))) *
                    net->latency;
    return t;
}

static enum ad_status plan(const struct chart *chart, struct sheet *sheet, struct ad_error *error)
{
    static const double ranks[] = {1,   2,   4,    8,    16,   32,   64,   100,
                                   200, 500, 1000, 2000, 3000, 5000, 7000, 10000};
    const struct network net = {chart->latency, chart->bandwidth};
    for (size_t j = 0; j < sizeof planned_jobs / sizeof *planned_jobs; j++)
        for (size_t k = 0; k < sizeof ranks / sizeof *ranks; k++) {
            const struct planned_job *job = &planned_jobs[j];
            double one = job->blocks * job->work / chart->flops, p = fmin(ranks[k], job->blocks);
            double work = ceil(job->blocks / p) * job->work / chart->flops;
            double sent = sending(job, &net, p).seconds, all = work + sent;
            sheet_row(sheet,
                      ROW(NAME(job->name), NUMBER(ranks[k]), NUMBER(all), NUMBER(one / all),
                          NUMBER(one / all / ranks[k]), NUMBER(sent / all)),
                      error);
        }
    return error->status;
}

/* ---- output ---- */

static void draw(const struct sheet *model, struct plot *plot)
{
    static const struct layout layout = {.width = 1040,
                                         .height = 440,
                                         .columns = 2,
                                         .room = {0.07, 0.72, 0.14, 0.88},
                                         .title = "Ranks, as planned by the model",
                                         .gap = {0.08, 0}};
    static const char *const shown[][2] = {{"speedup", NULL},
                                           {"efficiency", "at graph 1.03,1 " KEY_COLUMN}};
    struct figure figure;
    figure_begin(&figure, plot, &layout);
    for (size_t panel = 0; panel < 2; panel++) {
        figure_panel(&figure, &(struct panel){.x = "ranks",
                                              .y = shown[panel][0],
                                              .log = panel ? "x" : "xy",
                                              .x_range = "[1:10000]",
                                              .y_range = panel ? "[0:1.05]" : "[1:10000]",
                                              .key = shown[panel][1]});
        for (size_t j = 0; j < sizeof planned_jobs / sizeof *planned_jobs; j++)
            figure_curve(&figure, model, "ranks", shown[panel][0], planned_jobs[j].name,
                         STYLE(figure_colours[j], 7, 2, 0.4), "job", planned_jobs[j].name);
    }
    figure_end(&figure);
}

enum ad_status chart_scale(struct chart *chart, struct ad_error *error)
{
    struct sheet *counts = chart_sheet(chart, "scale_counts", counts_columns, error);
    struct sheet *model = chart_sheet(chart, "scale_model", model_columns, error);
    struct plot *plot = chart_picture(chart, "scale", error);
    for (size_t j = 0; j < sizeof counted_jobs / sizeof *counted_jobs; j++)
        for (size_t ranks = 1; ranks <= MOST && error->status == AD_OK; ranks++)
            count(chart, counts, &counted_jobs[j], ranks, error);
    if (plan(chart, model, error) == AD_OK)
        draw(model, plot);
    sheet_json(counts, "counts", &chart->json);
    sheet_json(model, "model", &chart->json);
    return error->status;
}
