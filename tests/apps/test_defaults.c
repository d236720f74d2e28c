/* Every scene with its defaults: path, motion and checks succeed. */
#include "tests/close.h"
#include "shell.h"
#include "physics/physics.h"

#include <string.h>

/* The dearest paths: test_path_distances runs them by their defaults, too. */
static bool is_followed_elsewhere(const char *name)
{
    return strcmp(name, "arenstorf") == 0 || strcmp(name, "pythagorean") == 0;
}

static void test_commands(void **state)
{
    (void)state;
    for (const struct phys_scene *const *scene = phys_scenes; *scene; scene++) {
        const char *name = (*scene)->name;
        if (strcmp(name, "gas") == 0) /* its path and its check take seconds */
            continue;
        if (!is_followed_elsewhere(name))
            shell_works("$LA path %s --quiet", name);
        shell_works("$LA simulate %s --quiet", name);
        shell_works("$LA check %s --quiet", name);
    }
    shell_works("$LA quantum --quiet");
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_commands)};
    return cmocka_run_group_tests(tests, shell_setup, shell_teardown);
}
