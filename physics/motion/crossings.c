/* Events at which a quantity of the motion crosses a value (solve.h): parsing, detection, storage.
 */
#include "solving.h"
#include "physics/lagrangian/internal.h"
#include "physics/system/internal.h"
#include "physics/io/numbers.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* ---- quantities ---- */

struct phys_quantity {
    const char *name; /* NULL: prefix, and one that the scene names */
    const char *prefix;
    size_t (*find)(const struct phys_system *system, const char *name);
    size_t bodies; /* that follow the name at most: NAME:A,B */
    /* Of the state x = (q, v), y as the ode has it. */
    double (*value)(const struct phys_crossing *c, const struct phys_ode *ode, double t,
                    const double *y, const double *x);
};

static double coordinate(const struct phys_crossing *c, const struct phys_ode *ode, double t,
                         const double *y, const double *x)
{
    (void)ode, (void)t, (void)y;
    return x[c->which[0]];
}

static double velocity(const struct phys_crossing *c, const struct phys_ode *ode, double t,
                       const double *y, const double *x)
{
    (void)t, (void)y;
    return x[ode->system->dof + c->which[0]];
}

static double energy(const struct phys_crossing *c, const struct phys_ode *ode, double t,
                     const double *y, const double *x)
{
    (void)c, (void)x;
    return ode->energy(ode->context, t, y);
}

static double distance(const struct phys_crossing *c, const struct phys_ode *ode, double t,
                       const double *y, const double *x)
{
    const struct phys_system *system = ode->system;
    size_t a = c->which[0] * system->dims, b = c->which[1] * system->dims;
    double sum = 0;
    (void)t, (void)y;
    for (size_t k = 0; k < system->dims; k++)
        sum += pow(x[a + k] - (b < system->dof ? x[b + k] : 0), 2);
    return sqrt(sum);
}

static double observable(const struct phys_crossing *c, const struct phys_ode *ode, double t,
                         const double *y, const double *x)
{
    (void)y;
    return phys_observe_state(ode->system, c->which[0], x, t);
}

/* ---- names: SIZE_MAX if there is none ---- */

static size_t find_coordinate(const struct phys_system *system, const char *name)
{
    char known[64];
    for (size_t k = 0; k < system->dof; k++) {
        phys_coordinate_name(system, k, known, sizeof known);
        if (strcmp(known, name) == 0)
            return k;
    }
    return SIZE_MAX;
}

static size_t find_observable(const struct phys_system *system, const char *name)
{
    for (size_t k = 0; k < system->scene->n_observables; k++)
        if (strcmp(system->scene->observables[k].name, name) == 0)
            return k;
    return SIZE_MAX;
}

static const struct phys_quantity quantities[] = {
    {.name = "energy", .value = energy},
    {.name = "distance", .bodies = 2, .value = distance},
    {.prefix = "", .find = find_coordinate, .value = coordinate},
    {.prefix = "v_", .find = find_coordinate, .value = velocity},
    {.prefix = "", .find = find_observable, .value = observable},
};

/* ---- reading ---- */

/* A body by its number from 1 or, where bodies have names, by its name; moves *text on. */
static bool read_body(const struct phys_system *system, const char **text, size_t *body)
{
    size_t length = strcspn(*text, ",");
    for (*body = 0; *body < system->bodies; ++*body) {
        char number[24];
        const char *name = number;
        snprintf(number, sizeof number, "%zu", *body + 1);
        if (strlen(number) != length || strncmp(number, *text, length) != 0)
            name = system->scene->body_name ? system->scene->body_name(system->params, *body) : "";
        if (length > 0 && strlen(name) == length && strncmp(name, *text, length) == 0)
            break;
    }
    *text += length + ((*text)[length] == ',');
    return *body < system->bodies;
}

/* distance:A, from the origin, or distance:A,B. */
static bool read_bodies(const struct phys_system *system, const char *text,
                        struct phys_crossing *crossing)
{
    size_t *which = crossing->which;
    if (system->scene->picture != PHYS_PICTURE_PLANE || !read_body(system, &text, &which[0]))
        return false;
    which[1] = system->bodies;
    return *text == '\0' ||
           (read_body(system, &text, &which[1]) && *text == '\0' && which[0] != which[1]);
}

static bool read_quantity(const struct phys_system *system, const char *name,
                          struct phys_crossing *crossing)
{
    for (size_t k = 0; k < LENGTH(quantities); k++) {
        const struct phys_quantity *q = crossing->quantity = &quantities[k];
        size_t length = strlen(q->name ? q->name : q->prefix);
        if (strncmp(name, q->name ? q->name : q->prefix, length) != 0)
            continue;
        const char *rest = name + length;
        if (q->bodies ? *rest == ':' && read_bodies(system, rest + 1, crossing)
            : q->name ? *rest == '\0'
                      : (crossing->which[0] = q->find(system, rest)) != SIZE_MAX)
            return true;
    }
    return false;
}

enum ad_status phys_crossing_read(const struct phys_system *system, const char *text,
                                  struct phys_crossing *crossing, struct ad_error *error)
{
    char name[64], first[64];
    if (AD_LACKS(error, crossing))
        return error->status;
    *crossing = (struct phys_crossing){.text = text};
    if (AD_LACKS(error, system, system->scene, text))
        return error->status;
    size_t length = strcspn(text, "=<>");
    const char *number = text + length + 1, *end = text + strlen(text);
    crossing->direction = text[length] == '>' ? 1 : text[length] == '<' ? -1 : 0;
    if (!text[length] || phys_text_number(number, end, &crossing->value) != end ||
        !isfinite(crossing->value))
        return ad_fail(error, AD_E_ARGUMENT,
                       "event '%s': expected QUANTITY=VALUE such as energy=1, or > where it rises "
                       "and < where it falls",
                       text);
    snprintf(name, sizeof name, "%.*s", (int)length, text);
    if (read_quantity(system, name, crossing))
        return AD_OK;
    phys_coordinate_name(system, 0, first, sizeof first);
    return ad_fail(error, AD_E_ARGUMENT,
                   "event '%s': %s has no quantity '%s'; expected a coordinate (%s, ...), v_ and a "
                   "coordinate (v_%s, ...), energy%s%s",
                   text, system->scene->name, name, first, first,
                   system->scene->n_observables ? ", an observable" : "",
                   system->scene->picture == PHYS_PICTURE_PLANE
                       ? ", distance:A from the origin or distance:A,B of two bodies"
                       : "");
}

/* ---- watching ---- */

static bool get_state(const struct solving *s, double t, const double *y, double *x)
{
    const struct phys_ode *ode = &s->solution->ode;
    struct ad_error ignored = {0}; /* of the same state the next step will complain */
    return phys_ode_leave(ode, t, y, x, x + ode->system->dof, &ignored) == AD_OK;
}

double phys_crossing_value(const struct phys_crossing *c, const struct phys_ode *ode, double t,
                           const double *x, double *y)
{
    struct ad_error ignored = {0};
    if (phys_ode_enter(ode, t, x, x + ode->system->dof, y, &ignored) != AD_OK)
        return (double)NAN;
    return c->quantity->value(c, ode, t, y, x) - c->value;
}

static void values(void *context, double t, const double *y, double *g)
{
    const struct crossing_watch *w = context;
    struct solving *s = w->solving;
    const struct phys_crossing *c = &s->settings->crossings[w->number];
    *g = get_state(s, t, y, s->state)
             ? c->quantity->value(c, &s->solution->ode, t, y, s->state) - c->value
             : (double)NAN;
}

static bool grow(struct phys_crossed *c, size_t columns)
{
    size_t room = c->room ? 2 * c->room : 16;
    bool grown = solving_widen(&c->which, room) && solving_widen(&c->touch, room) &&
                 solving_widen(&c->t, room) && solving_widen(&c->uncertainty, room) &&
                 solving_widen(&c->x, room * columns);
    c->room = grown ? room : c->room;
    return grown;
}

static bool keep(const struct crossing_watch *w, bool touch, double t, const double *y)
{
    struct solving *s = w->solving;
    struct phys_crossed *c = &s->solution->crossed;
    size_t columns = 2 * s->solution->system->dof;
    if (c->n == c->room && !grow(c, columns)) {
        s->failed = true;
        return false;
    }
    if (get_state(s, t, y, c->x + c->n * columns)) {
        c->which[c->n] = (double)(w->number + 1);
        c->touch[c->n] = touch;
        c->uncertainty[c->n] = (double)NAN;
        c->t[c->n++] = t;
    }
    return touch || !s->settings->crossings[w->number].last;
}

static bool found(void *context, size_t k, double t, const double *y)
{
    (void)k;
    return keep(context, false, t, y);
}

static bool touched(void *context, size_t k, double t, const double *y)
{
    (void)k;
    return keep(context, true, t, y);
}

/* A conserved energy crosses nothing: what does is the error of the motion. */
void phys_crossings_watch(struct solving *s, struct crossing_watch *watches,
                          struct phys_events *events)
{
    for (size_t k = 0; k < s->settings->n_crossings; k++) {
        bool *constant = &s->solution->crossed.constant[k];
        *constant =
            s->solution->keeps_energy && s->settings->crossings[k].quantity->value == energy;
        watches[k] = (struct crossing_watch){s, k};
        events[k] = (struct phys_events){.n = !*constant,
                                         .values = values,
                                         .direction = s->settings->crossings[k].direction,
                                         .found = found,
                                         .touched = touched,
                                         .context = &watches[k]};
    }
}
