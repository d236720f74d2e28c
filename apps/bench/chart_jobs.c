/* leastaction chart jobs: seconds and what is left of the error at the end of whole jobs, with the
   published settings and with ours. */
#include "chart_jobs.h"
#include "charts.h"
#include "apps/command.h"
#include "apps/output/json.h"
#include "apps/quantum/quantum_paper.h"

#include <math.h>

enum ad_status jobs_quantum(bool quick, struct job jobs[], size_t *n, struct ad_error *error)
{
    struct paper_cost cost;
    if (paper_measure(quick ? 0.3 : 1, &cost, error) == AD_OK)
        jobs[(*n)++] =
            (struct job){.name = "packet in a box",
                         .group = "quantum",
                         .measure = "distance of the mean from the particle at the end",
                         .published = {cost.published_seconds, cost.published_error, false},
                         .ours = {cost.seconds, cost.error, false},
                         .level = cost.error <= cost.published_error ? cost.seconds : INFINITY};
    return error->status;
}

static void write_rows(size_t n, const struct job jobs[], FILE *csv)
{
    fputs("group,job,measure,published_seconds,published_error,published_cut,our_seconds,our_error,"
          "our_cut,level_seconds\n",
          csv);
    for (const struct job *j = jobs; j < jobs + n; j++)
        fprintf(csv, "%s,%s,%s,%.4g,%.4g,%s,%.4g,%.4g,%s,%.4g\n", j->group, j->name, j->measure,
                j->published.seconds, j->published.error, j->published.cut ? "yes" : "no",
                j->ours.seconds, j->ours.error, j->ours.cut ? "yes" : "no", j->level);
}

static void print_side(const struct job_side *side)
{
    printf("%10.3g s%c %9.2g", side->seconds, side->cut ? '*' : ' ', side->error);
}

static void print_table(size_t n, const struct job jobs[])
{
    printf("%-8s %-16s %23s %23s %14s\n", "", "", "published: error", "ours: error",
           "ours as exact");
    for (const struct job *j = jobs; j < jobs + n; j++) {
        printf("%-8s %-16s ", j->group, j->name);
        print_side(&j->published);
        putchar(' ');
        print_side(&j->ours);
        if (isfinite(j->level))
            printf(" %10.3g s\n", j->level);
        else
            puts("        never");
    }
    puts(
        "seconds of the processor, both by this library, one thread; as exact: until the published "
        "error;\n* stopped by the limit of time");
}

static void json_side(struct json *json, const char *key, const struct job_side *side)
{
    json_object(json, key);
    json_number(json, "seconds", side->seconds);
    json_number(json, "error", side->error);
    json_bool(json, "cut", side->cut);
    json_end_object(json);
}

static void print_json(size_t n, const struct job jobs[], FILE *out)
{
    struct json json;
    json_open(&json, out);
    json_array(&json, "jobs");
    for (const struct job *j = jobs; j < jobs + n; j++) {
        json_object(&json, NULL);
        json_text(&json, "job", j->name);
        json_text(&json, "group", j->group);
        json_text(&json, "measure", j->measure);
        json_side(&json, "published", &j->published);
        json_side(&json, "ours", &j->ours);
        json_number(&json, "level_seconds", j->level);
        json_end_object(&json);
    }
    json_end_array(&json);
    json_close(&json);
}

int chart_jobs(const struct chart_settings *settings, struct ad_error *error)
{
    struct job jobs[JOBS_MOST];
    struct result csv = {0};
    struct plot plot = {0};
    size_t n = 0;
    if (chart_csv(settings, "jobs", &csv, error) == AD_OK &&
        chart_picture(settings, "jobs", &plot, error) == AD_OK &&
        jobs_paths(settings->quick, jobs, &n, error) == AD_OK &&
        jobs_networks(settings->quick, jobs, &n, error) == AD_OK &&
        jobs_quantum(settings->quick, jobs, &n, error) == AD_OK) {
        write_rows(n, jobs, csv.out);
        jobs_draw(n, jobs, &plot);
    }
    if (chart_end(&plot, &csv, error) != AD_OK)
        return command_status(error);
    if (!settings->quiet)
        print_table(n, jobs);
    if (settings->json)
        print_json(n, jobs, stdout);
    return DONE;
}
