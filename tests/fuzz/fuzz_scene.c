/* Fuzzer of user-defined scenes: one of another version or size, without a required member, or with
   parameters outside its struct is refused; an accepted one gives a system or a message. */
#include "fuzz.h"

#include "physics/system/internal.h"

#include <math.h>

/* What the bytes say of a scene. */
struct bytes {
    uint32_t version, size;
    uint32_t without; /* bit k: pointer k is NULL */
    uint16_t dof, dims, slices, n_params;
    uint64_t params_bytes, offset[2];
    double dt, value;
};

static ad_var free_motion(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)q, (void)t, (void)params;
    return ad_sum_rows(ad_square(v));
}

static enum ad_status start(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = v[0] = 1;
    return AD_OK;
}

static size_t dof_of(const void *params) { return (size_t)fmin(fabs(*(const double *)params), 64); }

static struct phys_scene scene_of(const struct bytes *b, const struct phys_param params[2])
{
#define UNLESS(bit, pointer) ((b->without >> (bit)) & 1 ? NULL : (pointer))
    return (struct phys_scene){
        .version = b->version ? b->version : PHYS_SCENE_VERSION,
        .size = b->size ? b->size : sizeof(struct phys_scene),
        .name = UNLESS(0, "mass"),
        .what = UNLESS(1, "a mass"),
        .unit = UNLESS(2, "m"),
        .time_unit = UNLESS(3, "s"),
        .energy_unit = UNLESS(4, "J"),
        .params = UNLESS(5, params),
        .lagrangian = UNLESS(6, free_motion),
        .kinetic = UNLESS(7, free_motion),
        .potential = UNLESS(8, free_motion),
        .start = UNLESS(9, start),
        .dof_of = b->n_params % 3 && b->offset[0] == 0 ? UNLESS(10, dof_of) : NULL,
        .dof = b->dof,
        .dims = b->dims,
        .slices = b->slices,
        .n_params = b->n_params % 3,
        .params_bytes = b->params_bytes,
        .dt = b->dt,
    };
#undef UNLESS
}

int fuzz_scene(const uint8_t *data, size_t size)
{
    struct bytes b;
    if (size < sizeof b)
        return 0;
    memcpy(&b, data, sizeof b);
    const struct phys_param params[2] = {{"m", "kg", "mass", b.value, b.offset[0]},
                                         {"k", "N/m", "stiffness", 2, b.offset[1]}};
    const struct phys_scene scene = scene_of(&b, params);
    if (phys_scene_flaw(&scene) || scene.params_bytes > 1 << 20)
        return 0;
    struct phys_system system = {0};
    struct ad_error error = {0};
    char name[32];
    if (phys_system_begin(&system, &scene, &error) == AD_OK) {
        fuzz_require(system.dof == system.bodies * system.dims && system.dof > 0);
        phys_system_set(&system, "k", b.value, &error);
        phys_system_set(&system, "m", b.value, &error);
        phys_coordinate_name(&system, system.dof - 1, name, sizeof name);
    } else {
        fuzz_require(error.message[0]);
    }
    phys_system_close(&system);
    return 0;
}
