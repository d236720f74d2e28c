/* The built-in scenes listed in scenes.def, one const struct per file. */
#ifndef PHYSICS_SCENES_H
#define PHYSICS_SCENES_H

#include "physics/system/internal.h"

#define SCENE(name) extern const struct phys_scene phys_scene_##name;
#include "scenes.def"
#undef SCENE

#endif
