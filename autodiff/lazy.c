/* Libraries loaded on first use (lazy.h). */
#include "lazy.h"

#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>

/* A library that the process has is found again, not loaded twice. */
void *ad_lazy_find(const char *library, const char *name)
{
    void *handle = dlopen(library, RTLD_LAZY | RTLD_LOCAL);
    return handle ? dlsym(handle, name) : NULL;
}

void *ad_lazy_load(void **slot, const char *library, const char *name)
{
    void *at = ad_lazy_find(library, name);
    if (!at) {
        fprintf(stderr, "leastaction: cannot load %s: %s\n", library, dlerror());
        exit(127);
    }
    __atomic_store_n(slot, at, __ATOMIC_RELEASE);
    return at;
}
