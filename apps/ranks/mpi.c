/* Ranks by MPI (Open MPI, MPICH): the one file that calls it. */
#include "engine.h"
#include "autodiff/clock.h"
#include "autodiff/version.h"
#include "physics/io/hdf5_file.h"

#include <limits.h>
#include <mpi.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <string.h>

static const double patience = 2; /* seconds after an error, in which the others fail alike */

static MPI_Comm deals; /* of task numbers, apart from other messages */
static _Atomic size_t numbers;
static _Atomic bool closing;
static pthread_t dealer;
static bool dealer_runs;

static void nap(long ms) { nanosleep(&(struct timespec){.tv_nsec = ms * 1000000}, NULL); }

/* ---- bytes: more than an int counts are elements of a type of their own ---- */

struct span {
    int count;
    MPI_Datatype type;
    bool own;
};

static bool span_new(struct span *s, size_t bytes)
{
    enum { PIECE = 1 << 20 };
    *s = (struct span){(int)bytes, MPI_BYTE, false};
    if (bytes <= INT_MAX)
        return true;
    if (bytes / PIECE > INT_MAX)
        return false;
    MPI_Datatype piece;
    MPI_Aint at[2] = {0, (MPI_Aint)(bytes / PIECE * PIECE)};
    s->count = 1;
    s->own = MPI_Type_contiguous(PIECE, MPI_BYTE, &piece) == MPI_SUCCESS &&
             MPI_Type_create_struct(2, (int[]){(int)(bytes / PIECE), (int)(bytes % PIECE)}, at,
                                    (MPI_Datatype[]){piece, MPI_BYTE}, &s->type) == MPI_SUCCESS &&
             MPI_Type_commit(&s->type) == MPI_SUCCESS && MPI_Type_free(&piece) == MPI_SUCCESS;
    return s->own;
}

static bool span_end(struct span *s, int result)
{
    if (s->own)
        MPI_Type_free(&s->type);
    return result == MPI_SUCCESS;
}

static bool gather(void *context, const void *mine, size_t bytes, void *all)
{
    struct span s;
    (void)context;
    return span_new(&s, bytes) &&
           span_end(&s, MPI_Allgather(mine, s.count, s.type, all, s.count, s.type, MPI_COMM_WORLD));
}

static bool broadcast(void *context, size_t from, void *data, size_t bytes)
{
    struct span s;
    (void)context;
    return span_new(&s, bytes) &&
           span_end(&s, MPI_Bcast(data, s.count, s.type, (int)from, MPI_COMM_WORLD));
}

static bool exchange(void *context, size_t to, const void *sent, size_t from, void *received,
                     size_t bytes)
{
    const bool sends = to != AD_NO_RANK, receives = from != AD_NO_RANK;
    struct span s;
    (void)context;
    return span_new(&s, bytes) &&
           span_end(&s,
                    MPI_Sendrecv(sent, sends ? s.count : 0, s.type, sends ? (int)to : MPI_PROC_NULL,
                                 0, received, receives ? s.count : 0, s.type,
                                 receives ? (int)from : MPI_PROC_NULL, 0, MPI_COMM_WORLD,
                                 MPI_STATUS_IGNORE));
}

/* ---- task numbers: a thread of rank 0 deals them, so that none waits while rank 0 computes ----
 */

static void *deal(void *unused)
{
    MPI_Status asked;
    (void)unused;
    while (!closing) {
        int there = 0;
        if (MPI_Iprobe(MPI_ANY_SOURCE, 0, deals, &there, &asked) != MPI_SUCCESS)
            break;
        if (!there) {
            nap(2); /* each takes some 30 us of the work beside it */
            continue;
        }
        uint64_t number = atomic_fetch_add(&numbers, 1);
        MPI_Recv(NULL, 0, MPI_BYTE, asked.MPI_SOURCE, 0, deals, MPI_STATUS_IGNORE);
        MPI_Send(&number, 1, MPI_UINT64_T, asked.MPI_SOURCE, 1, deals);
    }
    return NULL;
}

static bool next(void *context, size_t *number)
{
    const struct ad_ranks *ranks = context;
    uint64_t dealt = 0;
    if (ranks->rank == 0) {
        if (!dealer_runs)
            dealer_runs = pthread_create(&dealer, NULL, deal, NULL) == 0;
        *number = atomic_fetch_add(&numbers, 1);
        return dealer_runs;
    }
    bool received = MPI_Sendrecv(NULL, 0, MPI_BYTE, 0, 0, &dealt, 1, MPI_UINT64_T, 0, 1, deals,
                                 MPI_STATUS_IGNORE) == MPI_SUCCESS;
    *number = dealt;
    return received;
}

/* ---- files of all ranks ---- */

#ifdef RANKS_HDF5
static bool on_all_ranks(void *set, int64_t access)
{
    int (*set_fapl_mpio)(int64_t, MPI_Comm, MPI_Info);
    memcpy(&set_fapl_mpio, &set, sizeof set);
    return set_fapl_mpio(access, MPI_COMM_WORLD, MPI_INFO_NULL) >= 0;
}
#endif

/* ---- start and end ---- */

static struct ad_ranks world = {.size = sizeof world,
                                .context = &world,
                                .gather = gather,
                                .broadcast = broadcast,
                                .exchange = exchange,
                                .next = next};

static enum ad_status join(size_t launched, const char *variable, struct ad_error *error)
{
    int rank = 0, count = 1, threads = 0;
    if (MPI_Init_thread(NULL, NULL, MPI_THREAD_MULTIPLE, &threads) != MPI_SUCCESS ||
        MPI_Comm_rank(MPI_COMM_WORLD, &rank) != MPI_SUCCESS ||
        MPI_Comm_size(MPI_COMM_WORLD, &count) != MPI_SUCCESS ||
        MPI_Comm_dup(MPI_COMM_WORLD, &deals) != MPI_SUCCESS)
        return ad_fail(error, AD_E_IO, "MPI did not start");
    MPI_Comm_set_errhandler(MPI_COMM_WORLD, MPI_ERRORS_RETURN);
    MPI_Comm_set_errhandler(deals, MPI_ERRORS_RETURN);
    world.rank = (size_t)rank;
    world.count = (size_t)count;
    if (threads < MPI_THREAD_MULTIPLE)
        return ad_fail(error, AD_E_ARGUMENT, "this MPI lacks MPI_THREAD_MULTIPLE; try another");
    if (world.count != launched)
        return ad_fail(error, AD_E_ARGUMENT,
                       "%s: started as %zu processes, of which MPI joined %zu; expected the mpirun "
                       "of the MPI that the program was built with",
                       variable, launched, world.count);
    return AD_OK;
}

static struct ad_ranks *start(size_t launched, const char *variable, struct ad_error *error)
{
    join(launched, variable, error);
    if (world.rank > 0 && !freopen("/dev/null", "w", stdout))
        ad_fail(error, AD_E_IO, "/dev/null cannot be opened");
#ifdef RANKS_HDF5
    phys_hdf5_parallel(RANKS_HDF5, on_all_ranks);
#endif
    return &world;
}

static bool meet(struct ad_ranks *ranks, bool failed)
{
    MPI_Request all;
    int here = 0;
    /* The lowest rank that failed gives up first, so that one speaks for all. */
    double until = ad_now() + patience + 0.1 * (double)ranks->rank;
    if (MPI_Ibarrier(MPI_COMM_WORLD, &all) != MPI_SUCCESS)
        return false;
    while (MPI_Test(&all, &here, MPI_STATUS_IGNORE) == MPI_SUCCESS && !here &&
           !(failed && ad_now() > until))
        nap(1);
    return here;
}

static void end(struct ad_ranks *ranks, bool met, int status)
{
    (void)ranks;
    if (!met)
        MPI_Abort(MPI_COMM_WORLD, status);
    closing = true;
    if (dealer_runs)
        pthread_join(dealer, NULL);
    MPI_Comm_free(&deals);
    MPI_Finalize();
}

const struct ranks_engine ranks_engine = {LEASTACTION_VERSION, start, meet, end};
