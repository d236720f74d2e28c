/* Failing calls (calls.h). */
#define _DEFAULT_SOURCE /* MAP_ANONYMOUS */
#include "calls.h"
#include "tests/close.h"

#include <pthread.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

struct calls *calls;
static pthread_mutex_t one = PTHREAD_MUTEX_INITIALIZER;

void calls_share(void)
{
    calls = mmap(NULL, sizeof *calls, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    assert_true(calls != MAP_FAILED);
}

/* Places that are noted, the last one of each remainder: most calls end here. */
static const void *noted[1 << 12];

static void note(const char *function, const void *place)
{
    const void **last = &noted[(uintptr_t)place % LENGTH(noted)];
    size_t k = 0;
    if (*last == place)
        return;
    *last = place;
    if (strcmp(function, "phys_atomic_file_begin") == 0)
        return; /* signals remove what it made, which would be lost */
    while (k < calls->n && calls->at[k].place != place)
        k++;
    if (k < calls->n || k == CALLS_MOST)
        return;
    calls->at[k].place = place;
    calls->at[k].function = function;
    calls->n++;
}

static void wrong(const char *function, const char *what, const struct ad_error *error)
{
    fprintf(stderr, "%s %s: %s\n", function, what, error->message);
    abort();
}

/* Whether calls of it may begin beside an error: each rank says whether it has one, a report says
   so, and some calls follow each other before the error is looked at. */
static bool may_be_beside(const char *function)
{
    static const char *const names[] = {
        "ad_ranks_",          "hnn_find",          "hnn_model_note",
        "hnn_share_agree",    "hnn_task_ode",      "page_end",
        "phys_check_",        "phys_legendre_new", "phys_motion_diagnose",
        "phys_ode_enter",     "phys_ode_leave",    "phys_ranked_range",
        "phys_simulate",      "phys_system_set",   "report_show",
        "rollout_name_cause",
    };
    for (size_t k = 0; k < LENGTH(names); k++)
        if (strncmp(function, names[k], strlen(names[k])) == 0)
            return true;
    return false;
}

enum call call_begins(const char *function, const void *place, const struct ad_error *error)
{
    enum call call = CALL_CLEAN;
    if (error->status != AD_OK) {
        if (!may_be_beside(function))
            wrong(function, "begins beside an error", error);
        return CALL_BESIDE_ERROR;
    }
    pthread_mutex_lock(&one);
    if (calls)
        note(function, place);
    if (calls && calls->failing == place) {
        call = CALL_FAILS;
        calls->failing = NULL;
    }
    pthread_mutex_unlock(&one);
    return call;
}

enum ad_status call_ends(const char *function, enum call call, enum ad_status status,
                         struct ad_error *error)
{
    if ((status == AD_OK) != (error->status == AD_OK) && call != CALL_BESIDE_ERROR)
        wrong(function, "returns another status than that of its error", error);
    return call == CALL_FAILS
               ? ad_fail(error, AD_E_ARGUMENT, "this call of %s was made to fail", function)
               : status;
}
