/* A pool of threads (pool.h). OpenMP's barrier waits, spinning, for threads that the system may not
   run for milliseconds. */
#include "pool.h"

#include <pthread.h>
#include <signal.h>
#include <stdbool.h>

static pthread_mutex_t caller = PTHREAD_MUTEX_INITIALIZER; /* of one job at a time */
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;   /* of all below */
static pthread_cond_t wake = PTHREAD_COND_INITIALIZER, idle = PTHREAD_COND_INITIALIZER;
static struct {
    void (*body)(void *context, size_t thread, size_t k);
    void *context;
    size_t n, next;       /* next: not yet taken; atomic */
    size_t threads, busy; /* places left for threads; threads that compute */
} job;
static size_t workers;

static void take_parts(size_t thread)
{
    for (size_t k; (k = __atomic_fetch_add(&job.next, 1, __ATOMIC_RELAXED)) < job.n;)
        job.body(job.context, thread, k);
}

static void *work(void *unused)
{
    (void)unused;
    pthread_mutex_lock(&lock);
    for (;;) {
        while (job.threads == 0)
            pthread_cond_wait(&wake, &lock);
        size_t thread = job.threads--;
        job.busy++;
        pthread_mutex_unlock(&lock);
        take_parts(thread);
        pthread_mutex_lock(&lock);
        if (--job.busy == 0)
            pthread_cond_signal(&idle);
    }
    return NULL;
}

/* The child of a fork has no workers, and no job of another thread. */
static void in_child(void)
{
    job.threads = job.busy = workers = 0;
    caller = lock = (pthread_mutex_t)PTHREAD_MUTEX_INITIALIZER;
    wake = idle = (pthread_cond_t)PTHREAD_COND_INITIALIZER;
}

/* Signals are for the threads that there were before. */
static void start_workers(size_t n)
{
    static bool started;
    pthread_attr_t attributes;
    sigset_t all, before;
    if (workers >= n || pthread_attr_init(&attributes) != 0)
        return;
    if (!started)
        started = pthread_atfork(NULL, NULL, in_child) == 0;
    pthread_attr_setdetachstate(&attributes, PTHREAD_CREATE_DETACHED);
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    for (pthread_t thread; workers < n && pthread_create(&thread, &attributes, work, NULL) == 0;)
        workers++;
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    pthread_attr_destroy(&attributes);
}

void ad_parallel(size_t threads, size_t n, void (*body)(void *context, size_t thread, size_t k),
                 void *context)
{
    if (threads < 2 || n < 2 || pthread_mutex_trylock(&caller) != 0) {
        for (size_t k = 0; k < n; k++)
            body(context, 0, k);
        return;
    }
    const size_t others = (threads < n ? threads : n) - 1;
    pthread_mutex_lock(&lock);
    start_workers(others);
    job.body = body;
    job.context = context;
    job.n = n;
    __atomic_store_n(&job.next, 0, __ATOMIC_RELAXED);
    job.threads = others;
    pthread_cond_broadcast(&wake);
    pthread_mutex_unlock(&lock);
    take_parts(0);
    pthread_mutex_lock(&lock);
    job.threads = 0;
    while (job.busy > 0)
        pthread_cond_wait(&idle, &lock);
    pthread_mutex_unlock(&lock);
    pthread_mutex_unlock(&caller);
}
