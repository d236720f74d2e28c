/* --inputs of commands where a learnt model is a scene: columns of a table over the time t. */
#ifndef APPS_SCENE_INPUTS_H
#define APPS_SCENE_INPUTS_H

#include "apps/options.h"
#include "hnn/rollout/rollout.h"

struct scene_inputs {
    struct hnn_path table;
    struct hnn_inputs inputs;
};
/* The inputs of the model that neither --set nor the time gives; `file` NULL: nothing. Ends with
   scene_inputs_free, after the system is closed, whatever it returned. */
enum ad_status scene_inputs_read(const struct common *common, const char *file,
                                 struct phys_system *system, struct scene_inputs *inputs,
                                 struct ad_error *error);
void scene_inputs_free(struct scene_inputs *inputs);

#endif
