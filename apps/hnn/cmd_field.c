/* leastaction field: the vector field and H of a model on a grid. */
#include "apps/command.h"
#include "field.h"
#include "apps/output/json.h"
#include "apps/output/outputs.h"

#include <math.h>

static void extremes(const struct field *f, struct range *H)
{
    *H = (struct range){INFINITY, -INFINITY};
    for (size_t i = 0; i < f->samples; i++)
        range_widen(H, f->H[i]);
}

static void report(const struct field *f, const struct common *common)
{
    struct range H;
    extremes(f, &H);
    if (common->json) {
        struct json json;
        json_open(&json, stdout);
        json_count(&json, "points", f->samples);
        json_number(&json, "H_min", f->ode.energy ? H.low : (double)NAN);
        json_number(&json, "H_max", f->ode.energy ? H.high : (double)NAN);
        json_close(&json);
    } else if (!common->quiet && f->ode.energy) {
        printf("%zu x %zu points, H from %.6g to %.6g\n", f->n, f->n, H.low, H.high);
    } else if (!common->quiet) {
        printf("%zu x %zu points\n", f->n, f->n);
    }
}

static enum ad_status write_all(const struct field *f, const struct common *common,
                                struct ad_error *error)
{
    struct outputs outputs;
    if (outputs_begin(common, &outputs, error) != AD_OK)
        return error->status;
    if (outputs.file)
        field_write_file(f, common->command, outputs.file);
    if (outputs.csv.out)
        field_write_csv(f, outputs.csv.out);
    if (outputs.plot.script && field_picture(f, &outputs.plot, error) != AD_OK)
        outputs_abandon(&outputs);
    else
        outputs_commit(&outputs, error);
    return error->status;
}

static int run(const void *values, struct ad_error *error)
{
    const struct field_options *options = values;
    struct field field;
    if (field_setup(options, &field, error) == AD_OK &&
        write_all(&field, &options->common, error) == AD_OK)
        report(&field, &options->common);
    field_free(&field);
    return command_status(error);
}

#define AT(member) offsetof(struct field_options, member)

static const struct option table[] = {
    {"axes", "I,J", OPTION_TEXT, NULL, "components of the state that vary [q1 and p1]", AT(axes)},
    {"across", "A,B", OPTION_TEXT, NULL, "range of the first [seen in training]", AT(across)},
    {"up", "A,B", OPTION_TEXT, NULL, "range of the second [seen in training]", AT(up)},
    {"at", "Q,...,P,...", OPTION_TEXT, NULL, "the other components [middle of what was seen]",
     AT(at)},
    {"grid", "N", OPTION_COUNT, "41", "points each way", AT(grid)},
};

const struct command command_field = {
    .line = {.name = "field",
             .what = "the vector field and H of a model on a grid",
             .arguments = {"MODEL"},
             .outputs = true,
             .options = table,
             .n_options = sizeof table / sizeof *table,
             .more = "CSV: a row a point: state, rates, H. HDF5: state and rate [2n x N x N], H\n"
                     "[N x N]. The picture has lines of equal H, and arrows."},
    .bytes = sizeof(struct field_options),
    .run = run,
};
