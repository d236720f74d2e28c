/* The built-in scenes listed in scenes.def, one const struct per file. */
#ifndef PHYSICS_SCENES_SCENES_H
#define PHYSICS_SCENES_SCENES_H

#include "physics/system/internal.h"

#define SCENE(name) extern const struct phys_scene phys_scene_##name;
#include "scenes.def"
#undef SCENE

/* Members of a scene that all here give alike: its parameters stand in `params`. */
#define PHYS_SCENE_OF(type)                                                                        \
    .version = PHYS_SCENE_VERSION, .size = sizeof(struct phys_scene), .params = params,            \
    .n_params = LENGTH(params), .params_bytes = sizeof(type)
#define PHYS_PURE_NUMBERS .unit = "1", .time_unit = "1", .energy_unit = "1"

#endif
