/* Tests of the library are linked without the command's archive. */
#include "apps/bench/measure/thread_ranks.c"
