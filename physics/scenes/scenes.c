/* The table of the built-in scenes (scenes.def). */
#include "scenes.h"

const struct phys_scene *const phys_scenes[] = {
#define SCENE(name) &phys_scene_##name,
#include "scenes.def"
#undef SCENE
    NULL,
};

_Static_assert(LENGTH(phys_scenes) <= PHYS_SCENES_MOST + 1, "phys_system_open has room for fewer");
