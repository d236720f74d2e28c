/* Two processes that write the same files at once: both succeed, each file is a complete one of
   either, and nothing else remains. */
#include "tests/close.h"
#include "shell.h"

#include <stdio.h>

enum { TIMES = 5 };

static const struct {
    const char *line, *outputs; /* for two seeds */
} table[] = {
    {"path threebody --solver adam --steps 3 --noise 0.01 --out a.h5 --csv a.csv --quiet",
     "a.h5 a.csv"},
    {"dataset spring --trials 2 --out a.csv --quiet", "a.csv"},
    {"train data.csv --hidden 4 --steps 3 --out a.h5 --quiet", "a.h5"},
};

static void works(const char *line)
{
    if (shell("%s", line) != 0)
        fail_msg("%s: %s", line, shell_err());
}

static void test_at_once(void **state)
{
    (void)state;
    char line[1024];
    for (size_t k = 0; k < sizeof table / sizeof *table; k++) {
        snprintf(line, sizeof line,
                 "for s in 1 2; do mkdir -p alone$s && $LA %s --seed $s && mv %s alone$s || exit; "
                 "done; for f in %s; do ! cmp -s alone1/$f alone2/$f || exit; done",
                 table[k].line, table[k].outputs, table[k].outputs);
        works(line);
        snprintf(line, sizeof line,
                 "$LA %s --seed 1 & first=$!; $LA %s --seed 2 && wait $first && for f in %s; do "
                 "cmp -s $f alone1/$f || cmp -s $f alone2/$f || exit; done",
                 table[k].line, table[k].line, table[k].outputs);
        for (int i = 0; i < TIMES; i++)
            works(line);
        works("rm -r a.* alone? && test \"$(ls -A)\" = data.csv");
    }
}

static int setup(void **state)
{
    return shell_setup(state) || shell("$LA dataset spring --trials 5 --out data.csv --quiet");
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_at_once)};
    return cmocka_run_group_tests(tests, setup, shell_teardown);
}
