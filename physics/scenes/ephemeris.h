/* Parameters of the ephemeris scene, for the functions that choose its bodies (physics/ephemeris/).
 */
#ifndef PHYSICS_SCENES_EPHEMERIS_H
#define PHYSICS_SCENES_EPHEMERIS_H

#include "ephemeris_states.h"

#include <stddef.h>

enum { PHYS_EPHEMERIS_MOST = 32 };

struct ephemeris {
    double G, dims, relativity;
    double mass[PHYS_EPHEMERIS_BODIES]; /* of the bodies of ephemeris_states.h; 0: GM / G */
    size_t n;                           /* chosen bodies; 0: those of ephemeris_states.h */
    struct ephemeris_body body[PHYS_EPHEMERIS_MOST];
    char names[PHYS_EPHEMERIS_MOST][24];
};

size_t phys_ephemeris_count(const struct ephemeris *ephemeris);
const struct ephemeris_body *phys_ephemeris_body(const struct ephemeris *ephemeris, size_t k);

#endif
