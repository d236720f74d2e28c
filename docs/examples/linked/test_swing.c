/* The Lagrangian of ../elastic.c under a user's cmocka test:

       cc test_swing.c ../elastic.c $(pkg-config --cflags --libs leastaction cmocka) -o test_swing
 */
#include <leastaction/cmocka.h>

extern const struct phys_scene leastaction_scene;

static void test_swing(void **state)
{
    (void)state;
    assert_lagrangian(&leastaction_scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_swing)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
