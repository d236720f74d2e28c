/* The files a run was asked to write, all begun before it starts, so that one that cannot be
   written is found before anything is computed. */
#ifndef APPS_OUTPUTS_H
#define APPS_OUTPUTS_H

#include "apps/options.h"
#include "plot.h"
#include "result.h"
#include "physics/io/hdf5_file.h"

struct outputs {
    phys_runfile *file; /* NULL, or with .out or .script NULL: not asked for */
    struct result csv;
    struct plot plot;
};

enum ad_status outputs_begin(const struct common *common, struct outputs *outputs,
                             struct ad_error *error);
/* All of them appear, up to the first that fails. */
enum ad_status outputs_commit(struct outputs *outputs, struct ad_error *error);
void outputs_abandon(struct outputs *outputs);

#endif
