/* Scenes in shared objects: a valid one runs; every other is refused with its defect. */
#include "published.h"
#include "physics/physics.h"
#include "tests/close.h"
#include "tests/files.h"
#include "tests/mentions.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* FLAW is a designated initialiser more: the last one of a member counts. */
static const char source[] =
    "#include \"physics/physics.h\"\n"
    "struct mass { double m; };\n"
    "static ad_var lagrangian(ad_var q, ad_var v, ad_var t, const void *p)\n"
    "{ const struct mass *s = p; (void)q, (void)t;\n"
    "  return ad_mul(0.5 * s->m, ad_square(ad_row(v, 0))); }\n"
    "static enum ad_status start(const void *p, uint64_t seed, double *q, double *v,\n"
    "                            struct ad_error *error)\n"
    "{ (void)p, (void)seed, (void)error; q[0] = 1; v[0] = 2; return AD_OK; }\n"
    "static const struct phys_param params[] = {{\"m\", \"kg\", \"mass\", 2, 0}};\n"
    "static const struct phys_param outside[] = {{\"m\", \"kg\", \"mass\", 2, 4}};\n"
    "static const struct phys_param askew[] = {{\"m\", \"kg\", \"mass\", 2, 1}};\n"
    "extern const void *use[]; const void *use[] = {outside, askew};\n"
    "const struct phys_scene SYMBOL = {\n"
    "    .version = PHYS_SCENE_VERSION, .size = sizeof(struct phys_scene), .name = \"mass\",\n"
    "    .what = \"a mass\", .dof = 1, .dims = 1, .unit = \"m\", .time_unit = \"s\",\n"
    "    .energy_unit = \"J\", .params = params, .n_params = 1,\n"
    "    .params_bytes = sizeof(struct mass), .lagrangian = lagrangian, .slices = 9, .dt = 0.5,\n"
    "    .start = start, FLAW};\n";

static struct path build(const char *symbol, const char *flaw)
{
    static int count;
    char name[32], command[2048];
    struct path c = files_write_text("scene.c", source);
    snprintf(name, sizeof name, "scene%d.so", count++);
    struct path so = files_temporary(name);
    snprintf(command, sizeof command,
             "${CC:-cc} -std=c11 -I. -shared -fPIC '-DSYMBOL=%s' '-DFLAW=%s' -o '%s' '%s'", symbol,
             flaw, so.text, c.text);
    if (system(command) != 0)
        fail_msg("cannot compile: %s", command);
    return so;
}

static void a_scene_from_outside_runs(void **state)
{
    (void)state;
    struct path so = build("leastaction_scene", ".dt = 0.5");
    struct phys_system system;
    struct ad_error error = {0};
    phys_system_open(so.text, &system, &error);
    assert_no_error(&error);
    assert_true(phys_system_get(&system, "m") == 2);
    phys_system_set(&system, "m", 3, &error);
    const double q = 0, v = 1;
    double path[3];
    phys_motion_path(&system, NULL, &q, &v, 3, 0.5, path, &error);
    assert_no_error(&error);
    assert_close(path[2], 1, 1e-15, 0);
    phys_system_close(&system);
}

static void assert_refused(const char *file, const char *message)
{
    struct phys_system system;
    struct ad_error error = {0};
    assert_int_equal(phys_system_open(file, &system, &error), AD_E_INPUT);
    assert_mentions(error.message, message);
    phys_system_close(&system);
}

/* Linked instead of loaded: the pendulum's Lagrangian under another name, and without a start. */
static void a_linked_scene_runs(void **state)
{
    (void)state;
    struct phys_system system;
    struct ad_error error = {0};
    assert_int_equal(phys_system_open("pendulum", &system, &error), AD_OK);
    struct phys_scene scene = *system.scene;
    phys_system_close(&system);
    scene.name = "swing";
    assert_int_equal(phys_system_make(&scene, &system, &error), AD_OK);
    assert_ptr_equal(system.scene, &scene);
    assert_int_equal(phys_system_set(&system, "l", 2, &error), AD_OK);
    assert_true(phys_system_get(&system, "l") == 2 && system.dof == 1);
    phys_system_close(&system);
    scene.start = NULL;
    assert_int_equal(phys_system_make(&scene, &system, &error), AD_E_INPUT);
    assert_mentions(error.message, "start");
    phys_system_close(&system);
}

static void flawed_scenes_are_refused(void **state)
{
    (void)state;
    const struct {
        const char *flaw, *message;
    } table[] = {
        {".version = 99", "version"},
        {".version = 0x100 + AD_N_OPS", "version"}, /* ad_var without `recording` */
        {".size = 40", "version"},
        {".name = 0", "name"},
        {".unit = 0", "units"},
        {".dof = 0", "freedom"},
        {".dims = 0", "dims"},
        {".lagrangian = 0", "Lagrangian"},
        {".start = 0", "start"},
        {".slices = 2", "3 slices"},
        {".dt = -1", "time step"},
        {".params = outside", "parameters"},
        {".params = askew, .params_bytes = 16", "parameters"},
        {".params_bytes = -1", "parameters"},
        {".dof = 3, .dims = 2", "parameters"},
    };
    for (size_t k = 0; k < sizeof table / sizeof *table; k++) {
        struct path so = build("leastaction_scene", table[k].flaw);
        assert_refused(so.text, table[k].message);
    }
    struct path other = build("another_name", ".dt = 0.5");
    assert_refused(other.text, "leastaction_scene");
}

/* Mapping more of a file than there is would end the process with a signal. */
static void cut_files_are_refused(void **state)
{
    (void)state;
    size_t size;
    struct path so = build("leastaction_scene", ".dt = 0.5");
    char *bytes = files_read(so.text, &size);
    for (size_t length = 0; length < size; length += 1 + size / 9) {
        struct path cut = files_write("cut.so", bytes, length);
        assert_refused(cut.text, "complete");
    }
    free(bytes);
}

static void files_that_are_no_shared_objects_are_refused(void **state)
{
    (void)state;
    assert_refused("no-such-scene.so", "no-such-scene.so");
    assert_refused("/no/such/scene", "/no/such/scene");
    struct path text = files_write_text("text.so", "not a shared object\n");
    assert_refused(text.text, "text.so scene");
    char long_name[5000];
    memset(long_name, 'x', sizeof long_name);
    memcpy(long_name + sizeof long_name - 4, ".so", 4);
    assert_refused(long_name, "long");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_scene_from_outside_runs),
        cmocka_unit_test(a_linked_scene_runs),
        cmocka_unit_test(flawed_scenes_are_refused),
        cmocka_unit_test(cut_files_are_refused),
        cmocka_unit_test(files_that_are_no_shared_objects_are_refused),
    };
    return cmocka_run_group_tests(tests, files_setup, files_teardown);
}
