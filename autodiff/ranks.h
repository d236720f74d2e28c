/* Ranks: processes that work on one task together, each with a share of it. The library sends
   nothing itself: the caller gives it functions, such as those of MPI, or of threads of one
   process. All ranks call the same functions below in the same order.

   Results are the same bits for every number of ranks: a sum is taken over blocks that the task
   fixes, by a tree that their number fixes. `ranks` NULL everywhere: one rank, alone. Errors:
   AD_E_ARGUMENT for NULL and for ranks that ad_ranks_check refuses, AD_E_MEMORY, AD_E_IO where a
   function of the caller's failed. Threads: a struct ad_ranks is used by one thread at a time. */
#ifndef AUTODIFF_RANKS_H
#define AUTODIFF_RANKS_H

#include "status.h"

AD_HEADER_BEGIN

#define AD_NO_RANK SIZE_MAX

struct ad_ranks {
    size_t size;        /* sizeof(struct ad_ranks) */
    size_t rank, count; /* this one, and how many there are */
    void *context;      /* of the caller's functions, which return whether they succeeded */
    /* all [count x bytes] are the `mine` of all ranks, in their order. */
    bool (*gather)(void *context, const void *mine, size_t bytes, void *all);
    /* data [bytes] of rank `from` to all. */
    bool (*broadcast)(void *context, size_t from, void *data, size_t bytes);
    /* Sends `bytes` to one rank while it receives as many from one; AD_NO_RANK: does not send, or
       receive. Two ranks that send to each other first do not wait for ever. */
    bool (*exchange)(void *context, size_t to, const void *sent, size_t from, void *received,
                     size_t bytes);
    /* 0, 1, 2, ...: a number that no rank had before. The one function that a rank may call
       without the others. */
    bool (*next)(void *context, size_t *number);
    /* Counted by the functions below: messages and bytes that this rank sent, taking each gather
       and broadcast as count - 1 messages of the sender's, and seconds inside the functions
       above. */
    uint64_t messages, bytes;
    double seconds;
    size_t dealt; /* numbers taken by earlier calls of ad_ranks_deal */
};

/* AD_E_ARGUMENT names what is missing or out of range. */
enum ad_status ad_ranks_check(const struct ad_ranks *ranks, struct ad_error *error);

/* The caller's functions, counted. With `ranks` NULL: gather copies, the others do nothing. */
enum ad_status ad_ranks_gather(struct ad_ranks *ranks, const void *mine, size_t bytes, void *all,
                               struct ad_error *error);
enum ad_status ad_ranks_broadcast(struct ad_ranks *ranks, size_t from, void *data, size_t bytes,
                                  struct ad_error *error);
enum ad_status ad_ranks_exchange(struct ad_ranks *ranks, size_t to, const void *sent, size_t from,
                                 void *received, size_t bytes, struct ad_error *error);

/* *data [*bytes] of rank `from` to all: on the others the memory is new, freed by the caller
   (free), and NULL after an error. */
enum ad_status ad_ranks_spread(struct ad_ranks *ranks, size_t from, void **data, size_t *bytes,
                               struct ad_error *error);

/* values [n], n at most AD_RANKS_LEAST, become the least of all ranks', on every rank: in
   log2(count) rounds, in round k to the rank 2^k further on while from the one as far back. NaN
   counts as none. */
#define AD_RANKS_LEAST 2
enum ad_status ad_ranks_least(struct ad_ranks *ranks, size_t n, double *values,
                              struct ad_error *error);

/* Of n blocks, rank r has those from ad_ranks_first(ranks, n, r) to before that of r + 1. */
size_t ad_ranks_first(const struct ad_ranks *ranks, size_t n, size_t rank);

/* The error of the lowest rank that has one, on every rank, its message led by that rank's number
   where other ranks had none. Unlike elsewhere, *error may hold one already. */
enum ad_status ad_ranks_agree(struct ad_ranks *ranks, struct ad_error *error);
/* AD_E_INPUT on every rank unless `text`, called `what` in the message, is that of rank 0 on all.
 */
enum ad_status ad_ranks_same(struct ad_ranks *ranks, const char *what, const char *text,
                             struct ad_error *error);

/* The n values of block k of a sum, to `values`. */
typedef enum ad_status ad_ranks_block(void *context, size_t k, double *values,
                                      struct ad_error *error);
/* sum [n] on every rank: that of blocks 0 to blocks - 1. Each rank makes its own blocks
   (ad_ranks_first) in ascending order; blocks are added in pairs, pairs in pairs, and so on. The
   error of a block is that of all ranks. Memory: about 2 log2(blocks) n doubles. */
enum ad_status ad_ranks_sum(struct ad_ranks *ranks, size_t blocks, size_t n, ad_ranks_block *block,
                            void *context, double *sum, struct ad_error *error);

/* One task; its result, `bytes` long, is zero before. */
typedef enum ad_status ad_ranks_task(void *context, size_t task, void *result,
                                     struct ad_error *error);
/* Tasks 0 to tasks - 1, each run once by the next rank that is free; results [tasks x bytes], in
   the order of tasks, on every rank. After an error no rank begins another task. */
enum ad_status ad_ranks_deal(struct ad_ranks *ranks, size_t tasks, size_t bytes, ad_ranks_task *run,
                             void *context, void *results, struct ad_error *error);

AD_HEADER_END
#endif
