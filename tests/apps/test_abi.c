/* G8: a public struct that changes its size needs another soname (scripts/check-abi). */
#include "tests/close.h"

#include <stdio.h>
#include <stdlib.h>
#include <sys/wait.h>

/* Status of the check of the tree's headers after an edit by sed. */
static int check_after(const char *edit)
{
    char command[1024];
    snprintf(command, sizeof command,
             "d=$(mktemp -d) && tar -cf - $(find autodiff physics hnn quantum -name '*.h' -o "
             "-name '*.def') | tar -xf - -C $d && sed -i '%s' $d/physics/path/path.h && "
             "scripts/check-abi $d >/dev/null; s=$?; rm -rf $d; exit $s",
             edit);
    return WEXITSTATUS(system(command));
}

static void a_size_that_changes_is_noticed(void **state)
{
    (void)state;
    assert_int_equal(check_after("s/^struct phys_path_settings {/& /"), 0);
    assert_int_equal(check_after("s/^struct phys_path_settings {/& char more[64];/"), 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(a_size_that_changes_is_noticed)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
