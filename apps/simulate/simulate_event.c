/* Questions asked while a simulation runs, and their answers (simulate_event.h). */
#include "simulate_event.h"

#include <math.h>
#include <stdlib.h>

/* ---- asking ---- */

static bool get_state(const struct event_watch *w, double t, const double *y, double *x)
{
    struct ad_error ignored = {0}; /* of the same state the next step will complain */
    return phys_ode_leave(w->ode, t, y, x, x + w->ode->system->dof, &ignored) == AD_OK;
}

static void values(void *context, double t, const double *y, double *g)
{
    const struct event_watch *w = context;
    *g = get_state(w, t, y, w->x) ? w->event->quantity->value(w, t, y) - w->event->value
                                  : (double)NAN;
}

static bool grow(struct event_answers *a)
{
    size_t room = a->room ? 2 * a->room : 16;
    const struct event **event = realloc(a->event, room * sizeof *event);
    if (event)
        a->event = event;
    bool *touch = realloc(a->touch, room * sizeof *touch);
    if (touch)
        a->touch = touch;
    double *t = realloc(a->t, room * sizeof *t);
    if (t)
        a->t = t;
    double *x = realloc(a->x, room * 2 * a->dof * sizeof *x);
    if (x)
        a->x = x;
    a->room = event && touch && t && x ? room : a->room;
    return event && touch && t && x;
}

static bool keep(const struct event_watch *w, bool touch, double t, const double *y)
{
    struct event_answers *a = w->answers;
    if (a->n == a->room && !grow(a)) {
        a->failed = true;
        return false;
    }
    if (get_state(w, t, y, a->x + 2 * a->n * a->dof)) {
        a->event[a->n] = w->event;
        a->touch[a->n] = touch;
        a->t[a->n++] = t;
    }
    return touch || !w->event->last;
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

enum ad_status event_watch_all(const struct event_questions *questions, const struct phys_ode *ode,
                               struct event_answers *answers, struct event_watch **watches,
                               struct phys_events *events, struct ad_error *error)
{
    size_t n = questions->n, dof = ode->system->dof;
    *answers = (struct event_answers){.dof = dof};
    *watches = NULL;
    if (n == 0)
        return AD_OK;
    double *x = malloc(2 * dof * sizeof *x); /* of the first, shared: one value at a time */
    struct event_watch *w = *watches = calloc(n, sizeof *w);
    if (!x || !w) {
        free(x);
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    }
    for (size_t k = 0; k < n; k++) {
        w[k] = (struct event_watch){&questions->event[k], ode, answers, x};
        events[k] = (struct phys_events){.n = 1,
                                         .values = values,
                                         .direction = questions->event[k].direction,
                                         .found = found,
                                         .touched = touched,
                                         .context = &w[k]};
    }
    return AD_OK;
}

void event_watches_free(struct event_watch *watches)
{
    if (watches)
        free(watches->x);
    free(watches);
}

void event_answers_free(struct event_answers *answers)
{
    free(answers->event);
    free(answers->touch);
    free(answers->t);
    free(answers->x);
    *answers = (struct event_answers){0};
}

/* ---- answers ---- */

static bool answered(const struct event_answers *answers, const struct event *event)
{
    for (size_t i = 0; i < answers->n; i++)
        if (answers->event[i] == event)
            return true;
    return false;
}

static void report_answer(const struct event_answers *answers, size_t i,
                          const struct phys_system *system, struct report *report)
{
    enum { WIDE = 3 /* coordinates whose state fits into a line */ };
    char text[512];
    const double *x = answers->x + 2 * i * answers->dof;
    size_t length = (size_t)snprintf(text, sizeof text, "  %-24s t = %.12g",
                                     answers->event[i]->text, answers->t[i]);
    for (size_t k = 0; k < 2 * answers->dof && answers->dof <= WIDE && length < sizeof text; k++) {
        char name[64];
        phys_coordinate_name(system, k % answers->dof, name, sizeof name);
        length += (size_t)snprintf(text + length, sizeof text - length, ", %s%s = %.6g",
                                   k < answers->dof ? "" : "v_", name, x[k]);
    }
    report_line(report, "%s%s", text, answers->touch[i] ? ", touched, not crossed" : "");
}

/* The run file has them as datasets (event_answers_file). */
static void report_events(const struct event_answers *answers, struct report *report)
{
    report->passing = true;
    if (answers->n == 0)
        report_texts(report, "events", 0, NULL);
    for (size_t i = 0; i < answers->n; i++) {
        const double *x = answers->x + 2 * i * answers->dof;
        report_item(report, "events");
        report_text(report, "event", NULL, answers->event[i]->text);
        report_number(report, "t", NULL, NULL, answers->t[i]);
        report_flag(report, "touch", NULL, answers->touch[i]);
        report_list(report, "q", NULL, NULL, answers->dof, x);
        report_list(report, "v", NULL, NULL, answers->dof, x + answers->dof);
    }
    report_item(report, NULL);
    report->passing = false;
}

void event_answers_report(const struct event_answers *answers,
                          const struct event_questions *questions, const struct phys_system *system,
                          struct report *report)
{
    enum { MOST = 12 };
    if (questions->n == 0)
        return;
    report_events(answers, report);
    for (size_t i = 0; i < answers->n && i < MOST; i++)
        report_answer(answers, i, system, report);
    if (answers->n > MOST)
        report_line(report, "  and %zu more: --json and --out have all", answers->n - MOST);
    for (size_t k = 0; k < questions->n; k++)
        if (!answered(answers, &questions->event[k]))
            report_line(report, "  %-24s not in this time", questions->event[k].text);
}

enum ad_status event_answers_file(const struct event_answers *answers,
                                  const struct event_questions *questions, phys_runfile *file,
                                  struct ad_error *error)
{
    size_t n = answers->n;
    if (questions->n == 0)
        return AD_OK;
    double *number = malloc((n + 1) * sizeof *number);
    if (!number)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    for (size_t i = 0; i < n; i++)
        number[i] = (double)(answers->event[i] - questions->event + 1);
    phys_runfile_folder(file, "events");
    for (size_t k = 0; k < questions->n; k++) {
        char name[24];
        snprintf(name, sizeof name, "%zu", k + 1);
        phys_runfile_text(file, "events", name, questions->event[k].text);
    }
    if (n > 0) {
        phys_runfile_write(file, "events/number", AD_F64, 1, &n, number);
        for (size_t i = 0; i < n; i++)
            number[i] = answers->touch[i];
        phys_runfile_write(file, "events/touch", AD_F64, 1, &n, number);
        phys_runfile_write(file, "events/time", AD_F64, 1, &n, answers->t);
        phys_runfile_write(file, "events/state", AD_F64, 2, (size_t[]){n, 2 * answers->dof},
                           answers->x);
        phys_runfile_text(file, "events/state", "axes", "event, coordinates and velocities");
    }
    free(number);
    return AD_OK;
}
