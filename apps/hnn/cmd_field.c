/* leastaction field: the vector field and H of a model on a grid. */
#include "apps/command.h"
#include "field.h"
#include "apps/output/outputs.h"

#include <math.h>

static void extremes(const struct field *f, struct range *H)
{
    *H = (struct range){INFINITY, -INFINITY};
    for (size_t i = 0; i < f->samples; i++)
        range_widen(H, f->H[i]);
}

static void field_report(const void *context, struct report *report)
{
    const struct field *f = context;
    struct range H;
    extremes(f, &H);
    report_line(report, "%zu points", f->samples);
    report_count(report, "points", NULL, f->samples);
    report_number(report, "H_min", "least H", NULL, f->ode.energy ? H.low : (double)NAN);
    report_number(report, "H_max", "largest H", NULL, f->ode.energy ? H.high : (double)NAN);
}

static const struct output_kind outputs = {field_report, field_write_file, field_write_csv,
                                           field_picture, NULL};

static int run(const void *values, struct ad_error *error)
{
    const struct field_options *options = values;
    struct field field;
    if (field_setup(options, &field, error) == AD_OK)
        outputs_run(&outputs, &options->common, &field, NULL, error);
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
             .more =
                 "CSV: one row per point: state, rates, H. HDF5: state and rate [2n x N x N], H\n"
                 "[N x N]. The picture has lines of equal H, and arrows."},
    .bytes = sizeof(struct field_options),
    .run = run,
};
