/* Ranks as threads of one process. */
#include "apps/bench/measure/thread_ranks.h"
