/* Selects the set of kernels for this machine. */
#include "kernels.h"

#include <stdlib.h>
#include <string.h>

extern const struct ad_kernels ad_kernels_f32_base, ad_kernels_f64_base;

#ifdef AD_ONLY_BASE

const struct ad_kernels *ad_kernels_for(enum ad_type type)
{
    return type == AD_F32 ? &ad_kernels_f32_base : &ad_kernels_f64_base;
}

#else

extern const struct ad_kernels ad_kernels_f32_avx2, ad_kernels_f64_avx2;
extern const struct ad_kernels ad_kernels_f32_avx512, ad_kernels_f64_avx512;

enum { BASE, AVX2, AVX512, N_ISA };

static const struct ad_kernels *const sets[N_ISA][2] = {
    [BASE] = {&ad_kernels_f32_base, &ad_kernels_f64_base},
    [AVX2] = {&ad_kernels_f32_avx2, &ad_kernels_f64_avx2},
    [AVX512] = {&ad_kernels_f32_avx512, &ad_kernels_f64_avx512},
};

static int best(void)
{
    __builtin_cpu_init();
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw"))
        return AVX512;
    return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") ? AVX2 : BASE;
}

const struct ad_kernels *ad_kernels_for(enum ad_type type)
{
    int isa = best();
    const char *wanted = getenv("LEASTACTION_ISA");
    for (int k = 0; wanted && k < isa; k++)
        if (strcmp(sets[k][0]->isa, wanted) == 0)
            isa = k;
    return sets[isa][type == AD_F64];
}

#endif
