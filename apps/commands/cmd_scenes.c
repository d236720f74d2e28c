/* leastaction scenes: lists the scenes, with every parameter, its unit and default. */
#include "apps/command.h"
#include "apps/output/json.h"
#include "apps/output/report.h"
#include "hnn/hnn.h"

#include <stdio.h>

static void print_parameters(const struct phys_scene *scene)
{
    for (size_t k = 0; k < scene->n_params; k++) {
        const struct phys_param *p = &scene->params[k];
        printf("    %-12s %12g %-16s %s\n", p->name, p->value, unit_shown(p->unit),
               p->what ? p->what : "");
    }
}

static void print_scene(const struct phys_system *system)
{
    const struct phys_scene *scene = system->scene;
    printf("%-12s %s\n    %zu coordinate%s, %zu slices of %g%s%s\n", scene->name, scene->what,
           system->dof, system->dof == 1 ? "" : "s", scene->slices, scene->dt,
           unit_blank(scene->time_unit), unit_shown(scene->time_unit));
    print_parameters(scene);
}

static void print_coordinates(const struct phys_system *system)
{
    enum { SHOWN = 12 }; /* a gas has a hundred */
    char name[32];
    const char *unit = unit_shown(system->scene->unit);
    printf("    coordinates%s%s:", *unit ? " in " : "", unit);
    for (size_t k = 0; k < system->dof && k < SHOWN; k++) {
        phys_coordinate_name(system, k, name, sizeof name);
        printf(" %s", name);
    }
    puts(system->dof > SHOWN ? " ..." : "");
}

static void print_paper(const struct phys_preset *paper)
{
    printf("    published setting (--preset paper): %zu slices of %g, %zu steps of rate %g, noise "
           "%g\n",
           paper->slices, paper->dt, paper->steps, paper->learning_rate, paper->noise.sigma);
    for (size_t k = 0; k < paper->n_set; k++)
        printf("        %s = %g\n", paper->set[k].name, paper->set[k].value);
}

static void json_scene(struct json *json, const struct phys_system *system)
{
    const struct phys_scene *scene = system->scene;
    char name[32];
    json_text(json, "name", scene->name);
    json_text(json, "what", scene->what);
    json_count(json, "dof", system->dof);
    json_count(json, "slices", scene->slices);
    json_number(json, "dt", scene->dt);
    json_text(json, "unit", scene->unit);
    json_text(json, "time_unit", scene->time_unit);
    json_text(json, "energy_unit", scene->energy_unit);
    json_bool(json, "paper", scene->paper != NULL);
    json_array(json, "coordinates");
    for (size_t k = 0; k < system->dof; k++) {
        phys_coordinate_name(system, k, name, sizeof name);
        json_text(json, NULL, name);
    }
    json_end_array(json);
    json_array(json, "parameters");
    for (size_t k = 0; k < scene->n_params; k++) {
        json_object(json, NULL);
        json_text(json, "name", scene->params[k].name);
        json_number(json, "value", scene->params[k].value);
        json_text(json, "unit", scene->params[k].unit);
        json_text(json, "what", scene->params[k].what);
        json_end_object(json);
    }
    json_end_array(json);
}

static enum ad_status list(bool as_json, struct ad_error *error)
{
    struct json json;
    if (as_json) {
        json_open(&json, stdout);
        json_array(&json, "scenes");
    }
    for (size_t k = 0; phys_scenes[k]; k++) {
        struct phys_system system;
        if (phys_system_open(phys_scenes[k]->name, &system, error) != AD_OK)
            return error->status;
        if (as_json) {
            json_object(&json, NULL);
            json_scene(&json, &system);
            json_end_object(&json);
        } else {
            print_scene(&system);
        }
        phys_system_close(&system);
    }
    if (as_json) {
        json_end_array(&json);
        json_close(&json);
    }
    return AD_OK;
}

static enum ad_status details(const char *name, bool as_json, struct ad_error *error)
{
    struct phys_system system;
    if (hnn_system_open(name, &system, error) != AD_OK) {
        phys_system_close(&system);
        return error->status;
    }
    if (as_json) {
        struct json json;
        json_open(&json, stdout);
        json_scene(&json, &system);
        json_close(&json);
    } else {
        print_scene(&system);
        print_coordinates(&system);
        if (system.scene->paper)
            print_paper(system.scene->paper);
    }
    phys_system_close(&system);
    return AD_OK;
}

static int run(const void *options, struct ad_error *error)
{
    const struct common *common = options;
    if (common->n_arguments == 0)
        list(common->json, error);
    else
        details(common->argument[0], common->json, error);
    return command_status(error);
}

const struct command command_scenes = {
    .line = {.name = "scenes",
             .what = "list of scenes: coordinates, parameters, units, defaults",
             .arguments = {"[SCENE]"}},
    .bytes = sizeof(struct common),
    .run = run,
};
