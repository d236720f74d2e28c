/* Threads that wait asleep for parts of a computation. The caller computes, too, and waits only for
   parts that a thread has begun: on a busy machine it does all of them itself. */
#ifndef AUTODIFF_EXEC_POOL_H
#define AUTODIFF_EXEC_POOL_H

#include <stddef.h>

/* Calls body(context, thread, k) once for each k < n, on up to `threads` threads, which are
   numbered from 0, the caller. Which thread takes which k is open. A second caller at the same
   time, or a body, gets the caller's thread alone. */
void ad_parallel(size_t threads, size_t n, void (*body)(void *context, size_t thread, size_t k),
                 void *context);

#endif
