/* The built-in scenes, each the const struct of a file: scenes.def lists them. */
#ifndef PHYSICS_SCENES_H
#define PHYSICS_SCENES_H

#include "physics/system/internal.h"

#define SCENE(name) extern const struct phys_scene phys_scene_##name;
#include "scenes.def"
#undef SCENE

#endif
