/* The bodies of an ephemeris system: chosen by name, or taken from Horizons tables. */
#include "horizons.h"
#include "physics/scenes/scenes.h"
#include "physics/scenes/ephemeris.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum { DAY = 86400 };

static enum ad_status check(const struct phys_system *system, size_t n, size_t dims,
                            struct ad_error *error)
{
    if (AD_LACKS(error, system, system->scene))
        return error->status;
    if (system->scene != &phys_scene_ephemeris)
        return ad_fail(error, AD_E_ARGUMENT, "%s: not the ephemeris: it has no bodies to choose",
                       system->scene->name);
    if (dims != 2 && dims != 3)
        return ad_fail(error, AD_E_ARGUMENT, "ephemeris: %zu dimensions, expected 2 or 3", dims);
    if (n < 2 || n > PHYS_EPHEMERIS_MOST)
        return ad_fail(error, AD_E_ARGUMENT, "ephemeris: %zu bodies, expected 2 to %d", n,
                       PHYS_EPHEMERIS_MOST);
    return AD_OK;
}

/* Makes the chosen bodies those of the system; names point into the params struct afterwards. */
static void adopt(struct phys_system *system, const struct ephemeris *chosen, size_t dims)
{
    struct ephemeris *s = system->params;
    *s = *chosen;
    s->dims = (double)dims;
    for (size_t k = 0; k < s->n; k++)
        s->body[k].name = s->names[k];
    system->dims = dims;
    system->bodies = s->n;
    system->dof = dims * s->n;
}

/* ---- by name ---- */

static bool is_called(const char *text, const char *name, int id)
{
    char *end;
    long number = strtol(text, &end, 10);
    return strcasecmp(text, name) == 0 || (*text && !*end && number == id);
}

static const struct ephemeris_body *chosen_body(const struct ephemeris *chosen, int id)
{
    for (size_t k = 0; k < chosen->n; k++)
        if (chosen->body[k].id == id)
            return &chosen->body[k];
    return NULL;
}

/* A body of the scene's state vectors, where `states` allows it, or one known roughly: then the
   one it moves about must be there. */
static enum ad_status find_body(const struct ephemeris *chosen, const char *name, bool states,
                                double jd, struct ephemeris_body *body, struct ad_error *error)
{
    const char *names[PHYS_EPHEMERIS_BODIES + PHYS_EPHEMERIS_ROUGH];
    size_t n = 0;
    for (size_t k = 0; states && k < PHYS_EPHEMERIS_BODIES; k++) {
        *body = phys_ephemeris_bodies[k];
        names[n++] = body->name;
        if (is_called(name, body->name, body->id))
            return AD_OK;
    }
    for (size_t k = 0; k < PHYS_EPHEMERIS_ROUGH; k++) {
        const struct ephemeris_rough *rough = &phys_ephemeris_rough[k];
        const struct ephemeris_body *centre = chosen_body(chosen, rough->about);
        names[n++] = rough->name;
        if (!is_called(name, rough->name, rough->id))
            continue;
        if (!centre)
            return ad_fail(error, AD_E_ARGUMENT,
                           "ephemeris: %s needs the body it moves about (%d) before it",
                           rough->name, rough->about);
        phys_ephemeris_place(rough, jd, centre, body);
        return AD_OK;
    }
    phys_find("approximate body", name, n, names, error);
    return AD_E_ARGUMENT;
}

static enum ad_status add_body(struct ephemeris *chosen, const char *name, bool states, double jd,
                               struct ad_error *error)
{
    struct ephemeris_body body;
    if (find_body(chosen, name, states, jd, &body, error) != AD_OK)
        return error->status;
    if (chosen_body(chosen, body.id))
        return ad_fail(error, AD_E_ARGUMENT, "ephemeris: %s is named twice", body.name);
    if (chosen->n == PHYS_EPHEMERIS_MOST)
        return ad_fail(error, AD_E_ARGUMENT, "ephemeris: more than %d bodies", PHYS_EPHEMERIS_MOST);
    snprintf(chosen->names[chosen->n], sizeof chosen->names[0], "%s", body.name);
    chosen->body[chosen->n++] = body;
    return AD_OK;
}

static enum ad_status add_bodies(struct ephemeris *chosen, const char *bodies, bool states,
                                 double jd, struct ad_error *error)
{
    for (const char *at = bodies;; at++) {
        char name[32];
        size_t length = strcspn(at, ",");
        snprintf(name, sizeof name, "%.*s", length < sizeof name ? (int)length : 31, at);
        if (add_body(chosen, name, states, jd, error) != AD_OK)
            return error->status;
        at += length;
        if (!*at)
            return AD_OK;
    }
}

enum ad_status phys_ephemeris_choose(struct phys_system *system, const char *bodies, size_t dims,
                                     struct ad_error *error)
{
    if (AD_LACKS(error, bodies))
        return error->status;
    enum ad_status status = check(system, 2, dims, error);
    if (status != AD_OK)
        return status;
    struct ephemeris chosen = *(const struct ephemeris *)system->params;
    chosen.n = 0;
    status = add_bodies(&chosen, bodies, true, PHYS_EPHEMERIS_JD, error);
    if (status != AD_OK)
        return status;
    status = check(system, chosen.n, dims, error);
    if (status == AD_OK)
        adopt(system, &chosen, dims);
    return status;
}

enum ad_status phys_ephemeris_add(struct phys_system *system, const char *bodies, double jd,
                                  struct ad_error *error)
{
    if (AD_LACKS(error, system, system->scene, bodies))
        return error->status;
    enum ad_status status = check(system, system->bodies, system->dims, error);
    if (status != AD_OK)
        return status;
    struct ephemeris more = *(const struct ephemeris *)system->params;
    if (more.n == 0)
        return ad_fail(error, AD_E_ARGUMENT, "ephemeris: choose its bodies before adding to them");
    status = add_bodies(&more, bodies, false, jd, error);
    if (status == AD_OK)
        adopt(system, &more, system->dims);
    return status;
}

/* ---- from tables ---- */

/* Velocity at an epoch of a table that has none: one-sided differences of second order, looking
   back where three epochs ahead are not there. */
static void difference_velocity(const struct phys_horizons *table, size_t at, double *v)
{
    bool ahead = at + 2 < table->n;
    size_t near = ahead ? at + 1 : at - 1, far = ahead ? at + 2 : at - 2;
    double dt = (table->jd[near] - table->jd[at]) * DAY;
    const double *x = table->position;
    for (size_t k = 0; k < 3; k++)
        v[k] = (4 * x[3 * near + k] - 3 * x[3 * at + k] - x[3 * far + k]) / (2 * dt);
}

static bool has_mass(const struct ephemeris *s, const struct phys_horizons *table)
{
    for (size_t k = 0; k < PHYS_EPHEMERIS_BODIES; k++)
        if (phys_ephemeris_bodies[k].id == table->id && s->mass[k] != 0)
            return true;
    return table->gm > 0;
}

static enum ad_status add_table(struct ephemeris *chosen, const struct phys_horizons *table,
                                size_t first, size_t slices, struct ad_error *error)
{
    if (first >= table->n || slices > table->n - first)
        return ad_fail(error, AD_E_INPUT, "%s: %zu epochs from index %zu wanted, the table has %zu",
                       table->target, slices, first, table->n);
    if (!has_mass(chosen, table))
        return ad_fail(error, AD_E_INPUT, "%s: the table's header gives no GM", table->target);
    if (!table->velocity && table->n < 3)
        return ad_fail(error, AD_E_INPUT,
                       "%s: no velocities, and fewer than 3 epochs to take them from",
                       table->target);
    struct ephemeris_body *body = &chosen->body[chosen->n];
    char *name = chosen->names[chosen->n++];
    *body = (struct ephemeris_body){.id = table->id, .gm = table->gm};
    snprintf(name, sizeof chosen->names[0], "%.23s", table->target);
    for (char *c = name; *c; c++)
        *c = *c == ' ' ? '_' : (char)tolower((unsigned char)*c);
    memcpy(body->position, table->position + 3 * first, sizeof body->position);
    if (table->velocity)
        memcpy(body->velocity, table->velocity + 3 * first, sizeof body->velocity);
    else
        difference_velocity(table, first, body->velocity);
    return AD_OK;
}

static void copy_reference(size_t n, const struct phys_horizons *tables, size_t first,
                           size_t slices, size_t dims, double *reference)
{
    for (size_t k = 0; k < n * dims; k++)
        for (size_t i = 0; i < slices; i++)
            reference[k * slices + i] = tables[k / dims].position[3 * (first + i) + k % dims];
}

enum ad_status phys_ephemeris_use(struct phys_system *system, size_t n,
                                  const struct phys_horizons *tables, size_t first, size_t slices,
                                  size_t dims, double *reference, struct ad_error *error)
{
    if (AD_LACKS(error, tables))
        return error->status;
    enum ad_status status = check(system, n, dims, error);
    if (status != AD_OK)
        return status;
    struct ephemeris chosen = *(const struct ephemeris *)system->params;
    chosen.n = 0;
    for (size_t k = 0; k < n; k++) {
        status = add_table(&chosen, &tables[k], first, slices, error);
        if (status != AD_OK)
            return status;
    }
    adopt(system, &chosen, dims);
    if (reference)
        copy_reference(n, tables, first, slices, dims, reference);
    return AD_OK;
}
