/* The caller's functions between ranks, counted, and what is made of them but for sums. */
#include "ranks.h"
#include "clock.h"
#include "hash.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static size_t count_of(const struct ad_ranks *r) { return r ? r->count : 1; }

enum ad_status ad_ranks_check(const struct ad_ranks *r, struct ad_error *error)
{
    if (AD_LACKS(error, r, r->gather, r->broadcast, r->exchange, r->next))
        return error->status;
    if (r->size != sizeof *r)
        return ad_fail(error, AD_E_ARGUMENT, "ranks: size %zu; expected sizeof(struct ad_ranks)",
                       r->size);
    if (r->rank >= r->count)
        return ad_fail(error, AD_E_ARGUMENT, "ranks: rank %zu; expected one of 0 to %zu - 1",
                       r->rank, r->count);
    return AD_OK;
}

static enum ad_status lost(const struct ad_ranks *r, struct ad_error *error)
{
    return ad_fail(error, AD_E_IO, "rank %zu of %zu lost the others", r->rank, r->count);
}

static enum ad_status finish(struct ad_ranks *r, double began, size_t messages, size_t bytes,
                             bool done, struct ad_error *error)
{
    r->seconds += ad_now() - began;
    r->messages += messages;
    r->bytes += messages * bytes;
    return done ? AD_OK : lost(r, error);
}

enum ad_status ad_ranks_gather(struct ad_ranks *r, const void *mine, size_t bytes, void *all,
                               struct ad_error *error)
{
    if (AD_LACKS(error, mine, all))
        return error->status;
    if (!r) {
        memcpy(all, mine, bytes);
        return AD_OK;
    }
    double began = ad_now();
    bool done = r->gather(r->context, mine, bytes, all);
    return finish(r, began, r->count - 1, bytes, done, error);
}

enum ad_status ad_ranks_broadcast(struct ad_ranks *r, size_t from, void *data, size_t bytes,
                                  struct ad_error *error)
{
    if (AD_LACKS(error, data) || !r)
        return error->status;
    double began = ad_now();
    bool done = r->broadcast(r->context, from, data, bytes);
    return finish(r, began, r->rank == from ? r->count - 1 : 0, bytes, done, error);
}

enum ad_status ad_ranks_exchange(struct ad_ranks *r, size_t to, const void *sent, size_t from,
                                 void *received, size_t bytes, struct ad_error *error)
{
    if (error->status != AD_OK || (to != AD_NO_RANK && AD_LACKS(error, sent)) ||
        (from != AD_NO_RANK && AD_LACKS(error, received)) || !r)
        return error->status;
    double began = ad_now();
    bool done = r->exchange(r->context, to, sent, from, received, bytes);
    return finish(r, began, to != AD_NO_RANK, bytes, done, error);
}

enum ad_status ad_ranks_spread(struct ad_ranks *r, size_t from, void **data, size_t *bytes,
                               struct ad_error *error)
{
    if (AD_LACKS(error, data, bytes) || !r)
        return error->status;
    const bool other = r->rank != from;
    if (other)
        *data = NULL;
    uint64_t n = *bytes;
    ad_ranks_broadcast(r, from, &n, sizeof n, error);
    if (other && error->status == AD_OK)
        *data = malloc(n + 1);
    if (!*data)
        ad_fail(error, AD_E_MEMORY, "out of memory for %llu bytes of another rank",
                (unsigned long long)n);
    *bytes = n;
    if (ad_ranks_agree(r, error) == AD_OK)
        ad_ranks_broadcast(r, from, *data, n, error);
    if (other && error->status != AD_OK) {
        free(*data);
        *data = NULL;
    }
    return error->status;
}

size_t ad_ranks_first(const struct ad_ranks *r, size_t n, size_t rank)
{
    size_t count = count_of(r);
    return n / count * rank + n % count * rank / count;
}

/* ---- agreement ---- */

enum ad_status ad_ranks_least(struct ad_ranks *r, size_t n, double *values, struct ad_error *error)
{
    double other[AD_RANKS_LEAST];
    if (AD_LACKS(error, values))
        return error->status;
    if (n > AD_RANKS_LEAST)
        return ad_fail(error, AD_E_ARGUMENT, "least of %zu values: expected at most %d", n,
                       AD_RANKS_LEAST);
    const size_t count = count_of(r);
    for (size_t far = 1; far < count && error->status == AD_OK; far *= 2) {
        size_t to = (r->rank + far) % count, from = (r->rank + count - far) % count;
        ad_ranks_exchange(r, to, values, from, other, n * sizeof *values, error);
        for (size_t k = 0; k < n && error->status == AD_OK; k++)
            values[k] = fmin(values[k], other[k]);
    }
    return error->status;
}

enum ad_status ad_ranks_agree(struct ad_ranks *r, struct ad_error *error)
{
    const double none = (double)INFINITY;
    if (count_of(r) == 1)
        return error->status;
    /* The first rank that failed, and the first that did not. */
    const bool failed = error->status != AD_OK;
    double rank = (double)r->rank, first[2] = {failed ? rank : none, failed ? none : rank};
    struct ad_error sending = {0}, theirs = *error;
    if (ad_ranks_least(r, 2, first, &sending) != AD_OK)
        return lost(r, error);
    if (first[0] == none)
        return AD_OK;
    if (ad_ranks_broadcast(r, (size_t)first[0], &theirs, sizeof theirs, &sending) != AD_OK)
        return lost(r, error);
    *error = theirs;
    if (first[1] != none) {
        *error = (struct ad_error){0};
        ad_fail(error, theirs.status, "rank %.0f: %s", first[0], theirs.message);
    }
    return error->status;
}

struct said {
    uint64_t hash;
    char text[256]; /* its beginning */
};

enum ad_status ad_ranks_same(struct ad_ranks *r, const char *what, const char *text,
                             struct ad_error *error)
{
    struct said mine = {0};
    if (AD_LACKS(error, what, text) || count_of(r) == 1)
        return error->status;
    snprintf(mine.text, sizeof mine.text, "%s", text);
    mine.hash = ad_hash(AD_HASH_BEGIN, text, strlen(text));
    struct said first = mine;
    if (ad_ranks_broadcast(r, 0, &first, sizeof first, error) == AD_OK && first.hash != mine.hash)
        ad_fail(error, AD_E_INPUT, "%s: '%.99s', on rank 0 '%.99s'; expected one on all", what,
                mine.text, first.text);
    return ad_ranks_agree(r, error);
}

/* ---- tasks ---- */

/* Numbers stand for groups of tasks, which become smaller, so that all ranks end together: each is
   a quarter of a rank's even part of the tasks left. C. D. Polychronopoulos and D. J. Kuck, Guided
   Self-Scheduling, IEEE Transactions on Computers C-36 (1987) 1425. */
static size_t group_end(const struct ad_ranks *r, size_t tasks, size_t first)
{
    const size_t size = (tasks - first) / (4 * r->count);
    return first + (size ? size : 1);
}

static size_t groups_of(const struct ad_ranks *r, size_t tasks)
{
    size_t n = 0;
    for (size_t first = 0; first < tasks; n++)
        first = group_end(r, tasks, first);
    return n;
}

/* Takes numbers until they are used up: also after an error, so that all ranks know how many were
   taken. */
static void run_tasks(struct ad_ranks *r, size_t tasks, size_t bytes, ad_ranks_task *run,
                      void *context, char *results, unsigned char *done, struct ad_error *error)
{
    for (size_t group = 0, first = 0, number = 0;; group++) {
        double began = ad_now();
        bool dealt = r->next(r->context, &number);
        r->seconds += ad_now() - began;
        if (!dealt)
            lost(r, error);
        for (; dealt && group < number - r->dealt && first < tasks; group++)
            first = group_end(r, tasks, first);
        if (!dealt || first >= tasks)
            return;
        for (const size_t end = group_end(r, tasks, first); first < end; first++) {
            if (error->status != AD_OK)
                continue;
            run(context, first, bytes ? results + first * bytes : NULL, error);
            done[first] = 1;
        }
    }
}

/* Results [tasks x bytes] of those that rank `from` has done, to all. done [tasks]: room. */
static enum ad_status share_results(struct ad_ranks *r, size_t from, size_t tasks, size_t bytes,
                                    const unsigned char *mine, unsigned char *done, char *packed,
                                    char *results, struct ad_error *error)
{
    size_t n = 0;
    memcpy(done, mine, tasks);
    if (ad_ranks_broadcast(r, from, done, tasks, error) != AD_OK)
        return error->status;
    for (size_t k = 0; k < tasks; k++)
        if (done[k])
            memcpy(packed + n++ * bytes, results + k * bytes, bytes);
    if (n == 0 || ad_ranks_broadcast(r, from, packed, n * bytes, error) != AD_OK)
        return error->status;
    n = 0;
    for (size_t k = 0; k < tasks; k++)
        if (done[k])
            memcpy(results + k * bytes, packed + n++ * bytes, bytes);
    return AD_OK;
}

static enum ad_status deal(struct ad_ranks *r, size_t tasks, size_t bytes, ad_ranks_task *run,
                           void *context, char *results, struct ad_error *error)
{
    unsigned char *mine = calloc(tasks, 1), *done = malloc(tasks);
    char *packed = malloc(tasks * bytes + 1);
    if (!mine || !done || !packed)
        ad_fail(error, AD_E_MEMORY, "out of memory for %zu tasks", tasks);
    if (ad_ranks_agree(r, error) == AD_OK) {
        run_tasks(r, tasks, bytes, run, context, results, mine, error);
        r->dealt += groups_of(r, tasks) + r->count;
        ad_ranks_agree(r, error);
        for (size_t k = 0; bytes && k < r->count && error->status == AD_OK; k++)
            share_results(r, k, tasks, bytes, mine, done, packed, results, error);
    }
    free(mine);
    free(done);
    free(packed);
    return error->status;
}

enum ad_status ad_ranks_deal(struct ad_ranks *r, size_t tasks, size_t bytes, ad_ranks_task *run,
                             void *context, void *results, struct ad_error *error)
{
    if (AD_LACKS(error, run) || (bytes && AD_LACKS(error, results)) ||
        (r && ad_ranks_check(r, error) != AD_OK))
        return error->status;
    if (bytes)
        memset(results, 0, tasks * bytes);
    if (count_of(r) > 1)
        return tasks ? deal(r, tasks, bytes, run, context, results, error) : AD_OK;
    for (size_t k = 0; k < tasks && error->status == AD_OK; k++)
        run(context, k, bytes ? (char *)results + k * bytes : NULL, error);
    return error->status;
}
