/* Frees several pointers at once; NULL is left out. */
#ifndef AUTODIFF_FREE_H
#define AUTODIFF_FREE_H

#include <stdlib.h>

#define AD_FREE(...)                                                                               \
    ad_free_all(sizeof(void *[]){__VA_ARGS__} / sizeof(void *), (void *[]){__VA_ARGS__})

static inline void ad_free_all(size_t n, void *const all[])
{
    for (size_t k = 0; k < n; k++)
        free(all[k]);
}

#endif
