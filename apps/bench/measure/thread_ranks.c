#include "thread_ranks.h"

#include <pthread.h>
#include <stdlib.h>

struct box {
    const void *data; /* NULL: empty */
};

struct team {
    size_t count, number;
    pthread_mutex_t mutex;
    pthread_cond_t changed;
    pthread_barrier_t all;
    const void **given; /* [count] */
    struct box *box;    /* [from][to] */
    void (*work)(void *context, struct ad_ranks *ranks);
    void *context;
};

struct member {
    struct team *team;
    struct ad_ranks ranks;
    pthread_t thread;
};

static bool gather(void *context, const void *mine, size_t bytes, void *all)
{
    struct member *m = context;
    struct team *t = m->team;
    t->given[m->ranks.rank] = mine;
    pthread_barrier_wait(&t->all);
    for (size_t k = 0; k < t->count; k++)
        memcpy((char *)all + k * bytes, t->given[k], bytes);
    pthread_barrier_wait(&t->all);
    return true;
}

static bool broadcast(void *context, size_t from, void *data, size_t bytes)
{
    struct member *m = context;
    struct team *t = m->team;
    if (m->ranks.rank == from)
        t->given[from] = data;
    pthread_barrier_wait(&t->all);
    if (m->ranks.rank != from)
        memcpy(data, t->given[from], bytes);
    pthread_barrier_wait(&t->all);
    return true;
}

static bool exchange(void *context, size_t to, const void *sent, size_t from, void *received,
                     size_t bytes)
{
    struct member *m = context;
    struct team *t = m->team;
    struct box *out = to == AD_NO_RANK ? NULL : &t->box[m->ranks.rank * t->count + to];
    struct box *in = from == AD_NO_RANK ? NULL : &t->box[from * t->count + m->ranks.rank];
    pthread_mutex_lock(&t->mutex);
    if (out)
        out->data = sent;
    pthread_cond_broadcast(&t->changed);
    if (in) {
        while (!in->data)
            pthread_cond_wait(&t->changed, &t->mutex);
        memcpy(received, in->data, bytes);
        in->data = NULL;
        pthread_cond_broadcast(&t->changed);
    }
    while (out && out->data)
        pthread_cond_wait(&t->changed, &t->mutex);
    pthread_mutex_unlock(&t->mutex);
    return true;
}

static bool next(void *context, size_t *number)
{
    struct member *m = context;
    pthread_mutex_lock(&m->team->mutex);
    *number = m->team->number++;
    pthread_mutex_unlock(&m->team->mutex);
    return true;
}

static void *run(void *member)
{
    struct member *m = member;
    m->team->work(m->team->context, &m->ranks);
    return NULL;
}

void with_ranks(size_t count, void (*work)(void *context, struct ad_ranks *ranks), void *context)
{
    if (count == 0) {
        work(context, NULL);
        return;
    }
    struct team team = {.count = count, .work = work, .context = context};
    struct member *member = calloc(count, sizeof *member);
    team.given = calloc(count, sizeof *team.given);
    team.box = calloc(count * count, sizeof *team.box);
    pthread_mutex_init(&team.mutex, NULL);
    pthread_cond_init(&team.changed, NULL);
    pthread_barrier_init(&team.all, NULL, (unsigned)count);
    for (size_t k = 0; k < count; k++) {
        member[k].team = &team;
        member[k].ranks = (struct ad_ranks){.size = sizeof(struct ad_ranks),
                                            .rank = k,
                                            .count = count,
                                            .context = &member[k],
                                            .gather = gather,
                                            .broadcast = broadcast,
                                            .exchange = exchange,
                                            .next = next};
        pthread_create(&member[k].thread, NULL, run, &member[k]);
    }
    for (size_t k = 0; k < count; k++)
        pthread_join(member[k].thread, NULL);
    pthread_barrier_destroy(&team.all);
    pthread_cond_destroy(&team.changed);
    pthread_mutex_destroy(&team.mutex);
    free(member);
    free((void *)team.given);
    free(team.box);
}
