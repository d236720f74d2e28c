/* Pictures: gnuplot draws them, is missing, or leaves a partial file. */
#include "tests/close.h"
#include "picture_text.h"
#include "shell.h"
#include "tests/mentions.h"

#include <stdio.h>
#include <stdlib.h>
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

/* Between slices the path is what its rule has there: a circle, not its chords. */
static void test_curves_of_high_order(void **state)
{
    (void)state;
    shell_works("mkdir empty && PATH=$PWD/empty $LA path kepler --set e=0 --slices 9 --dt "
                "0.39269908169872414 --rule gauss6 --plot fig.svg --quiet");
    shell_works("awk '/^# found/ { f = 1; next } /^$/ { f = 0 } f { n++; r = sqrt($2^2 + $3^2) } f "
                "&& (r < .9999 || r > 1.0001) { bad = 1 } END { exit !(n > 300 && !bad) }' "
                "fig.svg.dat");
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
        shell_works("$LA path kepler --solver adam --steps 3 --slices 12 --plot \"%s\" --quiet",
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
        "grep -c '^# solution' all.svg.dat; grep -o 'title \"E = [0-9.]* J[,a-z ]*\"' all.svg.gp | "
        "wc -l; grep -c '^plot' all.svg.gp");
    assert_string_equal(shell_out(), "3\n3\n1\n");
}

/* Titles of vertical axes that the script sets and the picture lacks: gnuplot leaves out, silently,
   what does not fit. A view in space turns its titles otherwise. */
static void assert_titles_are_drawn(void)
{
    shell_works("if grep -q '^splot' script.gp; then echo 0; else "
                "grep -cE '^set (y|y2|cb)label \"[^\"]' script.gp; fi");
    const long set = strtol(shell_out(), NULL, 10);
    shell("grep -A1 'rotate(270)' x.svg | grep -c '<text><tspan'");
    assert_true(strtol(shell_out(), NULL, 10) >= set);
}

/* D: no text of any kind of picture lies on another or leaves the picture, or is left out. */
static void test_texts_are_apart(void **state)
{
    (void)state;
    static const char *const commands[] = {
        "path pendulum",                            /* Newton's gradient over few steps */
        "path pendulum --preset paper --steps 60",  /* S, T, V over the steps of a descent */
        "path pendulum --all",                      /* several paths */
        "path threebody --slices 40",               /* bodies by name, another reference */
        "path dimer --slices 20",                   /* two bodies */
        "path ephemeris --preset paper --steps 20", /* five bodies, powers of ten */
        "path brachistochrone",                     /* several coordinates, odd units */
        "path ./chain.so --set masses=12 --slices 11 --init ode", /* a map of site and time */
        "modes dblpend",
        "simulate pendulum --time 9 --scan theta0=0.1:3:5",
        "simulate pendulum --time 2 --scan theta0=0.1:3:4:log --scan l=-1:1:3", /* gaps */
        "simulate pendulum --set theta0=1e-4 --set rate0=-.12345 --time .01",   /* wide numbers */
        "modes dimer",
        "simulate kepler --time 20",                               /* a centre */
        "simulate pendulum --event theta=0 --event 'v_theta>0.1'", /* events */
        "simulate kepler --time 50 --section y=0 --section-axes t,v_y",
        "simulate pythagorean --time 5",
        "simulate arenstorf",
        "simulate ./chain.so --set masses=8 --time 5",
        "simulate ephemeris --data $ROOT/tests/data/horizons --days 20", /* space */
        "simulate gas --set bodies=20 --time 1",
        "quantum", /* few samples: a curve each */
        "quantum --scene harmonic --steps 40",
        "quantum --scene double-slit --points 170",
        "quantum --preset paper --scale 0.25",
        "rollout hnn.h5 --against baseline.h5 --truth pendulum --x0 1,0 --time 4",
        "rollout hnn.h5 --x0 1,0 --time 4",
        "field hnn.h5",
        "rollout pixels.h5 --truth pixels --time 9",
        "fit pendulum motion.csv --free l",
        "train p.h5 --hidden 4 --steps 40 --test-fraction .2 --out t.h5",
        "train f.h5 --model pixel-hnn --hidden 4 --steps 2 --batch 10 --out t.h5",
    };
    static const char training[] = "--hidden 4 --steps 2 --batch 10 --quiet";
    if (shell("command -v gnuplot") != 0)
        skip();
    shell_works("cp $ROOT/docs/examples/chain.c . && $LA build chain.c --quiet && "
                "$LA dataset pendulum --trials 6 --points 9 --quiet --out p.h5 && "
                "$LA dataset pixels --trials 6 --points 5 --size 8 --quiet --out f.h5 && "
                "$LA train p.h5 --model hnn %s --out hnn.h5 && "
                "$LA train p.h5 --model baseline %s --out baseline.h5 && "
                "$LA train f.h5 --model pixel-hnn %s --out pixels.h5 && "
                "$LA simulate pendulum --set theta0=.5 --samples 20 --csv motion.csv --quiet",
                training, training, training);
    shell_works("mkdir bin && printf '#!/bin/sh\\ncp \"$1\" script.gp\\nexec %%s \"$@\"\\n' "
                "\"$(command -v gnuplot)\" >bin/gnuplot && chmod +x bin/gnuplot");
    for (size_t k = 0; k < sizeof commands / sizeof *commands; k++) {
        print_message("%s\n", commands[k]);
        shell("PATH=$PWD/bin:$PATH $LA %s --quiet --plot x.svg", commands[k]);
        assert_true(picture_text_is_apart("x.svg") > 10);
        assert_titles_are_drawn();
        assert_int_equal(remove(shell_path("x.svg")), 0);
    }
}

/* That the measurement sees what it is for. */
static void test_texts_that_are_not_apart(void **state)
{
    (void)state;
#define TEXT(x, y, anchor, turn, text)                                                             \
    "<g transform=\"translate(" x "," y ")" turn "\" font-size=\"13.00\" text-anchor=\"" anchor    \
    "\"><text><tspan>" text "</tspan></text></g>"
    static const struct {
        const char *svg;
        size_t faults;
    } cases[] = {
        {TEXT("50", "50", "start", "", "one") TEXT("80", "50", "start", "", "two"), 0},
        {TEXT("50", "50", "start", "", "one") TEXT("65", "50", "start", "", "two"), 1},
        {TEXT("50", "50", "end", "", "one") TEXT("60", "50", "start", "", "two"), 0},
        {TEXT("50", "50", "middle", "", "wider") TEXT("60", "56", "start", "", "two"), 1},
        {TEXT("50", "50", "middle", " rotate(270)", "wider") TEXT("60", "50", "start", "", "a"), 0},
        {TEXT("50", "50", "middle", " rotate(270)", "wider") TEXT("40", "40", "start", "", "a"), 1},
        {TEXT("10", "50", "end", "", "leaves"), 1},
        {TEXT("190", "50", "start", "", "leaves"), 1},
        {TEXT("50", "4", "start", "", "leaves"), 1},
    };
#undef TEXT
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        char svg[600], what[400];
        size_t texts;
        snprintf(svg, sizeof svg, "<svg viewBox=\"0 0 200 100\">%s</svg>", cases[k].svg);
        assert_int_equal(picture_text_faults(svg, what, &texts), cases[k].faults);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(test_picture_without_gnuplot, shell_empty),
        cmocka_unit_test_teardown(test_curves_of_high_order, shell_empty),
        cmocka_unit_test_teardown(test_half_a_picture, shell_empty),
        cmocka_unit_test_teardown(test_pictures, shell_empty),
        cmocka_unit_test_teardown(test_picture_of_all_paths, shell_empty),
        cmocka_unit_test_teardown(test_texts_are_apart, shell_empty),
        cmocka_unit_test(test_texts_that_are_not_apart),
    };
    return cmocka_run_group_tests(tests, shell_setup, shell_teardown);
}
