/* Questions read: quantities and their names (simulate_event.h). */
#include "simulate_event.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- quantities ---- */

static double coordinate(const struct event_watch *w, double t, const double *y)
{
    (void)t, (void)y;
    return w->x[w->event->which[0]];
}

static double velocity(const struct event_watch *w, double t, const double *y)
{
    (void)t, (void)y;
    return w->x[w->ode->system->dof + w->event->which[0]];
}

static double energy(const struct event_watch *w, double t, const double *y)
{
    return w->ode->energy(w->ode->context, t, y);
}

static double distance(const struct event_watch *w, double t, const double *y)
{
    const struct phys_system *system = w->ode->system;
    size_t a = w->event->which[0] * system->dims, b = w->event->which[1] * system->dims;
    double sum = 0;
    (void)t, (void)y;
    for (size_t k = 0; k < system->dims; k++) {
        double d = w->x[a + k] - (b < system->dof ? w->x[b + k] : 0);
        sum += d * d;
    }
    return sqrt(sum);
}

static const struct event_quantity quantities[] = {
    {.name = "energy", .value = energy},
    {.name = "distance", .bodies = 2, .value = distance},
    {.prefix = "", .value = coordinate},
    {.prefix = "v_", .value = velocity},
};

enum { N_QUANTITIES = sizeof quantities / sizeof *quantities };

/* ---- reading ---- */

static size_t find_coordinate(const struct phys_system *system, const char *name)
{
    char known[64];
    size_t k = 0;
    for (; k < system->dof; k++) {
        phys_coordinate_name(system, k, known, sizeof known);
        if (strcmp(known, name) == 0)
            break;
    }
    return k;
}

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
static bool read_bodies(const struct phys_system *system, const char *text, struct event *event)
{
    if (system->scene->picture != PHYS_PICTURE_PLANE || !read_body(system, &text, &event->which[0]))
        return false;
    event->which[1] = system->bodies;
    return *text == '\0' || (read_body(system, &text, &event->which[1]) && *text == '\0' &&
                             event->which[0] != event->which[1]);
}

static bool read_quantity(const struct phys_system *system, const char *name, struct event *event)
{
    for (size_t k = 0; k < N_QUANTITIES; k++) {
        const struct event_quantity *q = event->quantity = &quantities[k];
        size_t length = strlen(q->name ? q->name : q->prefix);
        if (strncmp(name, q->name ? q->name : q->prefix, length) != 0)
            continue;
        const char *rest = name + length;
        if (q->bodies ? *rest == ':' && read_bodies(system, rest + 1, event)
            : q->name ? *rest == '\0'
                      : (event->which[0] = find_coordinate(system, rest)) < system->dof)
            return true;
    }
    return false;
}

static enum ad_status read_event(const struct phys_system *system, const char *text,
                                 struct event *event, struct ad_error *error)
{
    char name[64], first[64];
    size_t length = strcspn(text, "=<>");
    event->text = text;
    event->direction = text[length] == '>' ? 1 : text[length] == '<' ? -1 : 0;
    if (!text[length] || !options_number(text + length + 1, &event->value))
        return ad_fail(error, AD_E_ARGUMENT,
                       "event '%s': expected QUANTITY=VALUE such as energy=1, or > where it rises "
                       "and < where it falls",
                       text);
    snprintf(name, sizeof name, "%.*s", (int)length, text);
    if (read_quantity(system, name, event))
        return AD_OK;
    phys_coordinate_name(system, 0, first, sizeof first);
    return ad_fail(error, AD_E_ARGUMENT,
                   "event '%s': %s has no quantity '%s'; expected a coordinate (%s, ...), v_ and a "
                   "coordinate (v_%s, ...), energy%s",
                   text, system->scene->name, name, first, first,
                   system->scene->picture == PHYS_PICTURE_PLANE
                       ? ", distance:A from the origin or distance:A,B of two bodies"
                       : "");
}

enum ad_status event_questions_read(const struct texts *texts, const char *until,
                                    const struct phys_system *system,
                                    struct event_questions *questions, struct ad_error *error)
{
    size_t n = texts->n + (until != NULL);
    *questions = (struct event_questions){0};
    if (n == 0)
        return AD_OK;
    if (!(questions->event = calloc(n, sizeof *questions->event)))
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    for (questions->n = 0; questions->n < n; questions->n++) {
        struct event *event = &questions->event[questions->n];
        event->last = questions->n == texts->n;
        if (read_event(system, event->last ? until : texts->text[questions->n], event, error) !=
            AD_OK)
            return error->status;
    }
    return AD_OK;
}

void event_questions_free(struct event_questions *questions)
{
    free(questions->event);
    *questions = (struct event_questions){0};
}
