/* E1: strings from outside reach gnuplot, terminals, JSON and compilers as text, whatever they
   contain: no command in them runs, no control character is printed, and the picture is drawn. */
#include "tests/close.h"
#include "shell.h"
#include "tests/files.h"
#include "physics/io/hdf5_file.h"
#include "physics/io/utf8.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char *const hostile[] = {
    "m\nsystem(\"touch pwned\")\n#",
    "m'\nsystem('touch pwned')\nx='",
    "m\"\nsystem('touch pwned')\nx=\"",
    "`touch pwned`",
    "\".system(\"touch pwned\").\"",
    "'.system('touch pwned').'",
    "$(touch pwned); touch pwned & touch pwned",
    "@pwned @@ @{",
    "m\\",
    "\\134\\047\\n\\\"",
    "%s%n%d%50000d",
    "{:Bold {=99999999 x^{_{",
    "^_~&{}^",
    "}}}\\}",
    "\x1b]0;pwned\a\x1b[2J\x7f\r\b\t\x01",
    "\302\23331m \xff\xfe \xc3 \xe2\x80",
    "\xe2\x80\xaegnp.5h\xe2\x81\xa6 \xd8\x9c\xe2\x80\xa8\xf3\xa0\x81\x81",
    "<touch pwned",
    "|touch pwned",
    "-e system('touch pwned')",
    "m #",
};

enum { N = sizeof hostile / sizeof *hostile };

static void assert_harmless(const char *what)
{
    if (access(shell_path("pwned"), F_OK) == 0)
        fail_msg("%s: the command ran", what);
}

/* Characters that a terminal does not obey, and ends of lines. */
static void assert_printable(const char *text, const char *what)
{
    for (const char *at = text; *at;) {
        size_t length = *at == '\n' ? 1 : phys_utf8_printable(at);
        if (length == 0 || strncmp(at, "\xe2\x80\xae", 3) == 0)
            fail_msg("%s: byte %02x in the output", what, (unsigned char)*at);
        at += length;
    }
}

/* A line in which $S may stand for hostile text. */
static void works_harmlessly(const char *line)
{
    shell_works("%s", line);
    assert_harmless(getenv("S"));
    assert_printable(shell_out(), getenv("S"));
}

static void assert_printable_picture(const char *name)
{
    size_t size;
    char *svg = files_read(shell_path(name), &size);
    for (char *tab = svg; (tab = strchr(tab, '\t'));)
        *tab = ' ';
    assert_printable(strstr(svg, "<svg"), getenv("S"));
    free(svg);
}

static bool no_gnuplot(void)
{
    if (shell("command -v gnuplot") == 0)
        return false;
    print_message("gnuplot is not installed\n");
    return true;
}

static void write_data(void)
{
    shell_works("printf 't,q,p,dqdt,dpdt\\n0,1,0,0,-2\\n1,0,1,2,0\\n2,-1,0,0,2\\n' >d.csv");
}

/* All kinds of picture that a unit of a model gets into, each text in one of two: both quote alike.
 */
static void test_units_of_models(void **state)
{
    (void)state;
    if (no_gnuplot())
        skip();
    write_data();
    for (size_t k = 0; k < N; k++) {
        setenv("S", hostile[k], 1);
        works_harmlessly(
            "$LA train d.csv --state q,p --steps 2 --hidden 4 --out m.h5 --unit \"$S\"");
        works_harmlessly(k / 2 % 2 ? "$LA rollout m.h5 --time 1 --x0 .5,0 --points 3 --plot x.svg"
                                   : "$LA field m.h5 --grid 3 --plot x.svg");
        works_harmlessly("$LA dump m.h5");
        works_harmlessly("$LA dump m.h5 --json");
        assert_printable_picture("x.svg");
    }
}

static void test_names_of_files(void **state)
{
    (void)state;
    if (no_gnuplot())
        skip();
    for (size_t k = 0; k < N; k++) {
        setenv("S", hostile[k], 1);
        shell_works("mkdir -- \"$S\"");
        works_harmlessly(
            "$LA path pendulum --slices 5 --steps 2 --solver adam --plot=\"$S/$S.svg\" "
            "--csv=\"$S.csv\" --out=\"$S.h5\" --json");
        shell_works("test -s \"./$S/$S.svg\" && test -s \"./$S.csv\" && test -s \"./$S.h5\"");
        assert_int_equal(shell("$LA path pendulum --init \"$S/missing\""), 2);
        assert_printable(shell_err(), hostile[k]);
        assert_int_equal(shell("$LA simulate pendulum --event \"$S\""), 2);
        assert_printable(shell_err(), hostile[k]);
        assert_int_equal(shell("$LA simulate \"$S\" --json"), 2);
        assert_printable(shell_err(), hostile[k]);
        assert_harmless(hostile[k]);
    }
}

/* Names of models and of outputs stand in reports, too. */
static void test_reports(void **state)
{
    (void)state;
    setenv("S", hostile[14], 1);
    write_data();
    shell_works(
        "mkdir -- \"$S\" && $LA train d.csv --state q,p --steps 2 --hidden 4 --out \"$S/m.h5\"");
    assert_printable(shell_out(), "train");
    shell_works("$LA rollout \"$S/m.h5\" --against \"$S/m.h5\" --truth spring --x0 5,0 --time 1 "
                "--points 3 --csv \"$S/r.csv\" --out \"$S/r.h5\" 2>&1");
    assert_printable(shell_out(), "rollout");
    shell_works(
        "$LA simulate pendulum --time 1 --samples 3 --csv \"$S/s.csv\" --out \"$S/s.h5\" 2>&1");
    assert_printable(shell_out(), "simulate");
    shell_works("$LA quantum --points 64 --steps 2 --no-reference --force --csv \"$S/q.csv\" --out "
                "\"$S/q.h5\" 2>&1");
    assert_printable(shell_out(), "quantum");
}

/* What is kept where gnuplot is missing is drawn later, in the folder and by the name given. */
static void test_kept_scripts(void **state)
{
    (void)state;
    if (no_gnuplot())
        skip();
    for (size_t k = 0; k < 4; k++) {
        setenv("S", hostile[k], 1);
        shell_works("mkdir -p none && PATH=$PWD/none $LA path pendulum --slices 5 --steps 2 "
                    "--solver adam --plot \"$S.svg\" --quiet");
        assert_printable(shell_err(), hostile[k]);
        shell_works("gnuplot \"$S.svg.gp\" && test -s \"$S.svg\"");
        assert_harmless(hostile[k]);
    }
}

static void write_literal(FILE *out, const char *text)
{
    fputc('"', out);
    for (; *text; text++)
        fprintf(out, "\\%03o", (unsigned char)*text);
    fputc('"', out);
}

/* A scene whose every string is hostile. */
static void write_scene(const char *text)
{
    const char *const members[] = {"NAME", "WHAT", "UNIT", "TIME", "ENERGY"};
    FILE *out = fopen(shell_path("hostile.c"), "w");
    assert_non_null(out);
    for (size_t m = 0; m < sizeof members / sizeof *members; m++) {
        fprintf(out, "#define HOSTILE_%s ", members[m]);
        write_literal(out, text);
        fputc('\n', out);
    }
    fputs("#include \"tests/apps/scenes/hostile.h\"\n", out);
    assert_int_equal(fclose(out), 0);
}

static void test_scenes(void **state)
{
    (void)state;
    if (no_gnuplot())
        skip();
    for (size_t k = 0; k < N; k += 3) {
        write_scene(hostile[k]);
        int status = shell("$LA build hostile.c --include \"$ROOT\" --quiet");
        assert_harmless(hostile[k]);
        assert_printable(shell_err(), hostile[k]);
        assert_int_equal(status, phys_utf8_is_printable(hostile[k]) ? 0 : 2);
        if (status != 0)
            continue;
        shell_works("$LA path hostile.so --slices 5 --steps 2 --solver adam --plot x.svg --json && "
                    "$LA simulate hostile.so --time 1 --samples 3 --plot y.svg --json && "
                    "$LA quantum --scene ./hostile.so --box=-3,3 --points 65 --dt .1 --steps 2 "
                    "--plot z.svg --force --json");
        assert_printable(shell_out(), hostile[k]);
        assert_harmless(hostile[k]);
        shell_works("cat x.svg y.svg z.svg | tr -d '\\t'");
        assert_printable(strstr(shell_out(), "<svg"), hostile[k]);
    }
}

/* Sources and folders that a compiler might take for options or files of options. */
static void test_build(void **state)
{
    (void)state;
    for (size_t k = 1; k < N; k += 3) {
        setenv("S", hostile[k], 1);
        shell_works(
            "mkdir -- \"$S\" && cp -- \"$ROOT/tests/apps/scenes/good.c\" "
            "\"$ROOT/tests/apps/scenes/mass.h\" \"$S\" && "
            "$LA build \"./$S/good.c\" --include \"$ROOT\" --quiet && test -s \"./$S/good.so\"");
        assert_harmless(hostile[k]);
    }
    shell_works("cp \"$ROOT/tests/apps/scenes/good.c\" @plain.c && "
                "cp \"$ROOT/tests/apps/scenes/mass.h\" . && "
                "$LA build @plain.c --include \"$ROOT\" --quiet && test -s @plain.so");
}

/* A run file from elsewhere: names of folders, of attributes, and texts. */
static void test_dump(void **state)
{
    (void)state;
    struct ad_error error = {0};
    phys_hdf5 *file;
    const size_t one = 1;
    const double value = 7;
    assert_int_equal(phys_hdf5_create(shell_path("n.h5"), &file, &error), AD_OK);
    for (size_t k = 0; k < N; k++)
        if (!strchr(hostile[k], '/')) {
            phys_hdf5_write(file, hostile[k], AD_F64, 1, &one, &value);
            phys_hdf5_text(file, hostile[k], hostile[k], hostile[k]);
            phys_hdf5_number(file, hostile[k], "number", 2, hostile[k]);
        }
    assert_int_equal(phys_hdf5_commit(file, &error), AD_OK);
    static const char *const forms[] = {"", "--json", "--csv -", "--dataset \"$S\" --json"};
    setenv("S", hostile[0], 1);
    for (size_t k = 0; k < sizeof forms / sizeof *forms; k++) {
        shell_works("$LA dump n.h5 %s | tr -d '\\t\\r'", forms[k]);
        assert_printable(shell_out(), forms[k]);
    }
}

/* Longer than any buffer: the picture shows the start of it. */
static void test_long(void **state)
{
    (void)state;
    if (no_gnuplot())
        skip();
    write_data();
    shell_works(
        "S=$(head -c 50000 /dev/zero | tr '\\0' 'y'); $LA train d.csv --state q,p --steps 2 "
        "--hidden 4 --out m.h5 --unit \"$S\" --quiet && "
        "$LA rollout m.h5 --time 1 --x0 .5,0 --points 3 --plot x.svg --quiet");
    shell_works("grep -c yyyyyyyyyyyyyyyyyyyy x.svg");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(test_units_of_models, shell_empty),
        cmocka_unit_test_teardown(test_names_of_files, shell_empty),
        cmocka_unit_test_teardown(test_reports, shell_empty),
        cmocka_unit_test_teardown(test_kept_scripts, shell_empty),
        cmocka_unit_test_teardown(test_scenes, shell_empty),
        cmocka_unit_test_teardown(test_build, shell_empty),
        cmocka_unit_test_teardown(test_dump, shell_empty),
        cmocka_unit_test_teardown(test_long, shell_empty),
    };
    return cmocka_run_group_tests(tests, shell_setup, shell_teardown);
}
