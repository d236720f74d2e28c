/* Ranks by an engine, which is loaded where a launcher started more than one process (ranks.h). */
#include "engine.h"
#include "autodiff/version.h"

#include <dlfcn.h>
#include <limits.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

static const struct ranks_engine *engine;

/* Beside the command as built, or installed. Its symbols are for all: plug-ins of Open MPI do not
   name the library that they belong to. */
static void load(const char *variable, size_t processes, struct ad_error *error)
{
    static const char *const places[] = {"mpi.so", "../libexec/leastaction/mpi.so"};
    char at[PATH_MAX] = "", file[PATH_MAX + 40], *slash;
    if (readlink("/proc/self/exe", at, sizeof at - 1) > 0 && (slash = strrchr(at, '/')))
        *slash = '\0';
    for (size_t k = 0; k < sizeof places / sizeof *places; k++) {
        snprintf(file, sizeof file, "%s/%s", at, places[k]);
        if (access(file, F_OK) != 0)
            continue;
        void *library = dlopen(file, RTLD_NOW | RTLD_GLOBAL);
        engine = library ? dlsym(library, "ranks_engine") : NULL;
        if (!engine)
            ad_fail(error, AD_E_IO, "%s", dlerror());
        else if (strcmp(engine->version, LEASTACTION_VERSION) != 0)
            ad_fail(error, AD_E_INPUT, "%s: of version %s; expected " LEASTACTION_VERSION, file,
                    engine->version);
        return;
    }
    ad_fail(error, AD_E_ARGUMENT,
            "%s: started as %zu processes, but built without MPI; expected one, or a program "
            "of make MPI=1; try env -u %s for runs of their own",
            variable, processes, variable);
}

struct ad_ranks *ranks_start(struct ad_error *error)
{
    const char *variable;
    size_t n = ranks_launched(&variable);
    if (n == 1)
        return NULL;
    load(variable, n, error);
    return error->status == AD_OK ? engine->start(n, variable, error) : NULL;
}

bool ranks_meet(struct ad_ranks *ranks, bool failed)
{
    return !ranks || engine->meet(ranks, failed);
}

void ranks_end(struct ad_ranks *ranks, bool met, int status)
{
    if (ranks)
        engine->end(ranks, met, status);
}
