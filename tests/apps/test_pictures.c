/* Pictures: gnuplot draws them, is missing, or leaves a partial file. */
#include "tests/close.h"
#include "shell.h"
#include "tests/mentions.h"

#include <string.h>

static void test_picture_without_gnuplot(void **state)
{
    (void)state;
    shell_works("mkdir empty && PATH=$PWD/empty $LA path pendulum --solver adam --steps 20 --plot "
                "fig.svg --quiet");
    assert_string_equal(shell_err(),
                        "gnuplot is not installed: wrote fig.svg.dat and fig.svg.gp; draw with: "
                        "gnuplot fig.svg.gp\n");
    assert_int_equal(shell_files(), 3);
    shell_works("head -n 2 fig.svg.gp");
    assert_string_equal(shell_out(), "data = \"./fig.svg.dat\"\npicture = \"./fig.svg\"\n");
}

/* As gnuplot does on a full disk: half a picture, and exit status 0. */
static void test_half_a_picture(void **state)
{
    (void)state;
    shell_works(
        "mkdir half && printf '%%s\\n' '#!/bin/sh' "
        "'eval \"$(sed -n \"s/^picture = /picture=/p\" \"$1\")\"' "
        "'printf \"<?xml?><svg><g>\" >\"$picture\"' >half/gnuplot && chmod +x half/gnuplot && "
        "echo old >fig.svg");
    assert_int_equal(shell("PATH=$PWD/half:$PATH $LA path pendulum --solver adam --steps 3 --plot "
                           "fig.svg --quiet"),
                     2);
    assert_mentions(shell_err(), "fig.svg gnuplot");
    shell_works("cat fig.svg");
    assert_string_equal(shell_out(), "old\n");
    assert_int_equal(shell_files(), 2);
}

static void test_pictures(void **state)
{
    (void)state;
    static const struct {
        const char *name, *magic;
    } cases[] = {{"it''s.svg", "<?xml"}, {"a b.png", "\x89PNG"}, {"a.gif", "GIF89a"}};
    if (shell("command -v gnuplot") != 0) {
        print_message("gnuplot is not installed\n");
        skip();
    }
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        shell_works("$LA path kepler --solver adam --steps 20 --plot \"%s\" --quiet",
                    cases[k].name);
        assert_string_equal(shell_err(), "");
        shell_works("cat \"%s\"", cases[k].name);
        assert_memory_equal(shell_out(), cases[k].magic, strlen(cases[k].magic));
    }
    assert_int_equal(shell_files(), 3);
}

/* Every path that was found is a curve with its energy, and there is no panel without one. */
static void test_picture_of_all_paths(void **state)
{
    (void)state;
    shell_works("mkdir none && PATH=$PWD/none $LA path pendulum --all --plot all.svg --quiet");
    shell_works(
        "grep -c '^# solution' all.svg.dat; grep -o 'title \"E = [0-9.]*\"' all.svg.gp | wc -l; "
        "grep -c '^plot' all.svg.gp");
    assert_string_equal(shell_out(), "3\n3\n1\n");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(test_picture_without_gnuplot, shell_empty),
        cmocka_unit_test_teardown(test_half_a_picture, shell_empty),
        cmocka_unit_test_teardown(test_pictures, shell_empty),
        cmocka_unit_test_teardown(test_picture_of_all_paths, shell_empty),
    };
    return cmocka_run_group_tests(tests, shell_setup, shell_teardown);
}
