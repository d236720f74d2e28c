/* Chooses the build of the hand-written kernels that this machine can run. */
#include "hand.h"

extern const struct hand_kernel hand_table_base[], hand_table_avx2[], hand_table_avx512[];
extern const struct hand_hnn hand_hnn_base, hand_hnn_avx2, hand_hnn_avx512;
extern const struct hand_force hand_forces_base[], hand_forces_avx2[], hand_forces_avx512[];

static const struct build {
    const struct hand_kernel *kernels;
    const struct hand_hnn *hnn;
    const struct hand_force *forces;
} none;

static const struct build *find_build(int k)
{
#ifndef AD_ONLY_BASE
    static const struct build avx512 = {hand_table_avx512, &hand_hnn_avx512, hand_forces_avx512};
    static const struct build avx2 = {hand_table_avx2, &hand_hnn_avx2, hand_forces_avx2};
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw") && k-- == 0)
        return &avx512;
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && k-- == 0)
        return &avx2;
#endif
    static const struct build base = {hand_table_base, &hand_hnn_base, hand_forces_base};
    return k == 0 ? &base : &none;
}

const struct hand_kernel *hand_build(int k) { return find_build(k)->kernels; }

const struct hand_hnn *hand_hnn_build(int k) { return find_build(k)->hnn; }

const struct hand_force *hand_forces(void) { return find_build(0)->forces; }
