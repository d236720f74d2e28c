/* Chooses among the builds of the hand-written kernels what this machine can run. */
#include "hand.h"

#include <stddef.h>

extern const struct hand_kernel hand_table_base[], hand_table_avx2[], hand_table_avx512[];

const struct hand_kernel *hand_build(int k)
{
#ifndef AD_ONLY_BASE
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw") && k-- == 0)
        return hand_table_avx512;
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && k-- == 0)
        return hand_table_avx2;
#endif
    return k == 0 ? hand_table_base : NULL;
}
