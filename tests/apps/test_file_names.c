/* B1: an output that is an input, under any name, is refused before anything is opened, and the
   input is unchanged; so are two outputs that are one file. */
#include "tests/close.h"
#include "tests/files.h"
#include "shell.h"
#include "apps/command.h"
#include "tests/mentions.h"

#include <stdlib.h>
#include <string.h>

/* $IN is a file of the work folder that the run reads, $OUT another name of it. */
static const struct {
    const char *input, *line;
} table[] = {
    {"d.csv", "train $IN --steps 2 --out $OUT"},
    {"d.csv", "train $IN --steps 2 --log $OUT"},
    {"b.csv", "train d.csv --test $IN --steps 2 --out $OUT"},
    {"b.csv", "train d.csv --test $IN --steps 2 --log $OUT"},
    {"m.h5", "rollout $IN --time 1 --x0 1,0 --out $OUT"},
    {"m.h5", "rollout $IN --time 1 --x0 1,0 --csv $OUT"},
    {"m.svg", "rollout $IN --time 1 --x0 1,0 --plot $OUT"},
    {"d.csv", "rollout m.h5 --truth $IN --csv $OUT"},
    {"d.csv", "rollout m.h5 --truth=$IN --out=$OUT"},
    {"n.h5", "rollout m.h5 --against $IN --time 1 --x0 1,0 --csv $OUT"},
    {"m.h5", "field $IN --csv $OUT"},
    {"m.h5", "field $IN --out $OUT"},
    {"m.svg", "field $IN --plot $OUT"},
    {"m.h5", "dump $IN --csv $OUT"},
    {"p.csv", "path pendulum --init $IN --csv $OUT"},
    {"p.csv", "path pendulum --reference $IN --out $OUT"},
    {"s.so", "path $IN --csv $OUT"},
    {"s.so", "simulate $IN --out $OUT"},
    {"s.so", "quantum --scene $IN --out $OUT"},
    {"s.c", "build $IN --out $OUT --include \"$ROOT\""},
    {"f/1.txt", "simulate ephemeris --data f --csv $OUT"},
    {"f/1.txt", "simulate ephemeris --data f --plot $OUT"},
    {"f/1.txt", "path ephemeris --data f/. --out $OUT"},
    {"f/1.png", "path pendulum --plot $OUT --data f"},
    {"f/1.txt", "train f --model pixel-hnn --out $OUT"},
    {"f/1.txt", "train . --model pixel-hnn --out $OUT"},
};

static const char setup[] =
    "mkdir f other && printf 't,q,p,dqdt,dpdt\\n0,1,0,0,-2\\n1,0,1,2,0\\n2,-1,0,0,2\\n' >d.csv && "
    "cp d.csv b.csv && cp d.csv f/1.txt && cp d.csv p.csv && cp d.csv f/1.png && "
    "$LA train d.csv --state q,p --steps 2 --hidden 4 --out m.h5 --quiet && cp m.h5 n.h5 && "
    "cp m.h5 m.svg && cp \"$ROOT/tests/apps/scenes/good.c\" s.c && "
    "cp \"$ROOT/tests/apps/scenes/mass.h\" . && $LA build s.c --include \"$ROOT\" --quiet";

static void refused(size_t k, const char *name)
{
    size_t files = shell_files();
    size_t size, size_after;
    char *before = files_read(shell_path(table[k].input), &size);
    setenv("IN", table[k].input, 1);
    setenv("OUT", name, 1);
    int status = shell("$LA %s", table[k].line);
    if (status != 2 || !strstr(shell_err(), "; expected a file ") ||
        strncmp(shell_err(), "leastaction ", 12) != 0 || strchr(shell_err(), '\n')[1] != '\0')
        fail_msg("%s as %s: exit %d, %s", table[k].line, name, status, shell_err());
    assert_string_equal(shell_out(), "");
    assert_int_equal(shell_files(), files);
    char *after = files_read(shell_path(table[k].input), &size_after);
    assert_int_equal(size_after, size);
    assert_memory_equal(after, before, size);
    free(before);
    free(after);
}

static void test_output_is_input(void **state)
{
    (void)state;
    char name[600];
    shell_works("%s", setup);
    for (size_t k = 0; k < sizeof table / sizeof *table; k++) {
        const char *in = table[k].input, *extension = strrchr(in, '.');
        refused(k, in);
        snprintf(name, sizeof name, "./%s", in);
        refused(k, name);
        snprintf(name, sizeof name, "other/../%s", in);
        refused(k, name);
        snprintf(name, sizeof name, "%s", shell_path(in));
        refused(k, name);
        shell_works("ln -s \"$PWD/%s\" other/soft%s", in, extension);
        snprintf(name, sizeof name, "other/soft%s", extension);
        refused(k, name);
        shell_works("rm other/soft%s && ln %s other/hard%s", extension, in, extension);
        snprintf(name, sizeof name, "other/hard%s", extension);
        refused(k, name);
        shell_works("rm other/hard%s", extension);
    }
}

/* A run that has two outputs, or whose default output is the input. */
static void test_outputs(void **state)
{
    (void)state;
    static const char *const lines[] = {
        "path pendulum --out a --csv ./a",
        "path pendulum --csv other/../a.svg --plot a.svg",
        "path pendulum --csv a.svg.dat --plot a.svg",
        "simulate pendulum --out a.h5 --csv other/../other/../a.h5",
        "train d.csv --out a.csv --log $PWD/a.csv",
        "train model.h5 --steps 1",
        "build x.so",
        "simulate pendulum --csv said >said",
        "simulate pendulum --out said 2>said",
        "chart ephemeris --data f --out other/../f",
    };
    shell_works("%s && cp m.h5 model.h5 && cp s.c x.so", setup);
    size_t files = shell_files();
    for (size_t k = 0; k < sizeof lines / sizeof *lines; k++) {
        int status = shell("$LA %s; status=$?; rm -f said; exit $status", lines[k]);
        if (status != 2)
            fail_msg("%s: exit %d", lines[k], status);
        assert_int_equal(shell_files(), files);
    }
    shell_works("cmp m.h5 model.h5 && cmp s.c x.so");
}

/* Outputs are regular files: what else has the name stays as it is. */
static void test_other_than_files(void **state)
{
    (void)state;
    static const char *const names[] = {"folder", "fifo", "/dev/full", "to-folder", "to-fifo"};
    static const char *const lines[] = {"path pendulum --slices 5 --csv", "simulate pendulum --out",
                                        "path pendulum --slices 5 --plot",
                                        "dataset spring --trials 2 --points 5 --out"};
    shell_works("mkdir folder && mkfifo fifo && ln -s folder to-folder && ln -s fifo to-fifo");
    for (size_t n = 0; n < sizeof names / sizeof *names; n++)
        for (size_t k = 0; k < sizeof lines / sizeof *lines; k++) {
            int status = shell("timeout 20 $LA %s %s --quiet", lines[k], names[n]);
            if (status != 2 || !mentions(shell_err(), names[n]))
                fail_msg("%s %s: exit %d, %s", lines[k], names[n], status, shell_err());
        }
    shell_works("test -d folder && test -p fifo && test -L to-folder && test -L to-fifo && "
                "test -z \"$(ls -A folder)\"");
    assert_int_equal(shell_files(), 4);
}

/* Links by the names that temporary files have, put there to be followed or removed: neither. */
static void test_planted_links(void **state)
{
    (void)state;
    shell_works("mkdir in && echo kept >in/file && k=0; while [ $k -lt 16 ]; do "
                "ln -s $PWD/in/file .leastaction.$(printf %%016x $k).csv; "
                "ln -s $PWD/in/file .leastaction.$(printf %%016x $k).h5; k=$((k + 1)); done; "
                "ln -s in/file a.csv.tmp; ln -s in/file a.csv~");
    shell_works("$LA path pendulum --slices 5 --csv a.csv --out a.h5 --quiet && test -s a.csv");
    shell_works("test \"$(cat in/file)\" = kept && test $(ls -A in | wc -l) = 1 && "
                "test $(find . -type l | wc -l) = 34");
}

/* What is allowed: an output of the same name elsewhere, standard output, a second run. */
static void test_apart(void **state)
{
    (void)state;
    shell_works("%s && cd other && for k in 1 2; do $LA train ../d.csv --state q,p --steps 2 "
                "--hidden 4 --out d.csv --log - && $LA dump ../m.h5 --csv - >m.h5 && "
                "$LA train ../d.csv --state q,p --steps 2 --hidden 4 --out r.h5 --resume --quiet; "
                "done && $LA dataset spring --trials 2 --points 5 --out spring && "
                "$LA dataset spring --trials 2 --points 5 --out spring",
                setup);
}

/* Whatever takes the name of a file says which way it goes. */
static void test_tables(void **state)
{
    (void)state;
    for (size_t c = 0; commands[c]; c++)
        for (size_t k = 0; k < options_rows(&commands[c]->line); k++) {
            const struct option *option = options_row(&commands[c]->line, k);
            const char *placeholder = option->placeholder ? option->placeholder : "";
            if ((strstr(placeholder, "FILE") || strstr(placeholder, "DIR")) &&
                (option->kind < OPTION_INPUT || option->kind > OPTION_PICTURE))
                fail_msg("%s --%s %s", commands[c]->line.name, option->name, placeholder);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(test_output_is_input, shell_empty),
        cmocka_unit_test_teardown(test_outputs, shell_empty),
        cmocka_unit_test_teardown(test_other_than_files, shell_empty),
        cmocka_unit_test_teardown(test_planted_links, shell_empty),
        cmocka_unit_test_teardown(test_apart, shell_empty),
        cmocka_unit_test(test_tables),
    };
    return cmocka_run_group_tests(tests, shell_setup, shell_teardown);
}
