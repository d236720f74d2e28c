/* --event and --until: where a quantity of the motion crosses a value. */
#ifndef APPS_SIMULATE_EVENT_H
#define APPS_SIMULATE_EVENT_H

#include "apps/output/report.h"
#include "apps/options.h"
#include "physics/motion/motion.h"
#include "physics/io/hdf5_file.h"

struct event_watch;

struct event_quantity {
    const char *name; /* NULL: a coordinate, as the scene calls it */
    const char *prefix;
    size_t bodies; /* that follow the name at most: NAME:A,B */
    double (*value)(const struct event_watch *watch, double t, const double *y);
};

/* One question, such as theta=0, "v_x<0.1", distance:1,2=0.5. */
struct event {
    const char *text;
    const struct event_quantity *quantity;
    size_t which[2]; /* coordinate; or two bodies, the second that of no body: from the origin */
    double value;
    int direction; /* +1: it rises through the value, -1: it falls */
    bool last;     /* ends the run */
};

/* All questions of a run. */
struct event_questions {
    size_t n;
    struct event *event; /* [n] */
};

/* Reads --event texts and --until (or NULL). AD_E_ARGUMENT says what the scene has. Ends with
   event_questions_free. */
enum ad_status event_questions_read(const struct texts *texts, const char *until,
                                    const struct phys_system *system,
                                    struct event_questions *questions, struct ad_error *error);
void event_questions_free(struct event_questions *questions);

/* What was found. */
struct event_answers {
    size_t n, room, dof;
    const struct event **event; /* [n] */
    bool *touch;                /* [n] it touches the value and turns back */
    double *t;                  /* [n] */
    double *x;                  /* [n][2 dof]: q, then v */
    bool failed;                /* out of memory */
};

/* The questions as the integrators ask them: events [questions->n], each with a watch behind it.
   Answers grow while the simulation runs; end with event_answers_free. */
struct event_watch {
    const struct event *event;
    const struct phys_ode *ode;
    struct event_answers *answers;
    double *x; /* [2 dof] */
};
enum ad_status event_watch_all(const struct event_questions *questions, const struct phys_ode *ode,
                               struct event_answers *answers, struct event_watch **watches,
                               struct phys_events *events, struct ad_error *error);
void event_watches_free(struct event_watch *watches);
void event_answers_free(struct event_answers *answers);

/* Also which questions have no answer. */
void event_answers_report(const struct event_answers *answers,
                          const struct event_questions *questions, const struct phys_system *system,
                          struct report *report);
/* The folder "events": number of the question, time, state. */
enum ad_status event_answers_file(const struct event_answers *answers,
                                  const struct event_questions *questions, phys_runfile *file,
                                  struct ad_error *error);

#endif
