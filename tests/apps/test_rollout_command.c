/* The commands `leastaction rollout` and `leastaction field`: what they compute, write and refuse.
 */
#include "shell.h"
#include "tests/close.h"
#include "tests/mentions.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/inotify.h>
#include <unistd.h>

#define TRAIN                                                                                      \
    "$LA train spring.csv --hidden 24 --lr 1e-2 --steps 600 --weight-decay 0 --precision f64 "     \
    "--quiet "

/* The spring H = p^2 + q^2, seen up to a radius of 1.2. */
static void write_data(void)
{
    FILE *out = fopen(shell_path("spring.csv"), "w");
    assert_non_null(out);
    fputs("q,p,dqdt,dpdt\n", out);
    for (int k = 0; k < 300; k++) {
        double r = 1.2 * sqrt((k + 0.5) / 300), angle = 2.399963 * k;
        double q = r * cos(angle), p = r * sin(angle);
        fprintf(out, "%.12g,%.12g,%.12g,%.12g\n", q, p, 2 * p, -2 * q);
    }
    fclose(out);
}

static int setup(void **state)
{
    (void)state;
    shell_clean();
    write_data();
    return shell(TRAIN "--out hnn.h5 && " TRAIN "--model baseline --out base.h5");
}

static void test_against_truth(void **state)
{
    (void)state;
    assert_int_equal(shell("$LA rollout hnn.h5 --truth spring --x0 0.9,0 --against base.h5 --json"),
                     0);
    assert_true(shell_number("energy_mse") < 1e-4 && shell_number("energy_mse_model") < 1e-4);
    assert_true(shell_number("coordinate_mse") < 0.2 && shell_number("conserved_drift") < 1e-6);
    assert_true(shell_number("evaluations") > 100 && shell_number("seconds") > 0);
    assert_true(isnan(shell_number("reversal_error")) && isnan(shell_number("outside_from")));
    assert_true(shell_number_in("against", "energy_mse") > shell_number("energy_mse"));
    assert_true(isnan(shell_number_in("against", "conserved_drift")));
}

static void test_reversal(void **state)
{
    (void)state;
    assert_int_equal(shell("$LA rollout hnn.h5 --x0 0.9,0 --time 10 --reverse --json"), 0);
    assert_true(shell_number("reversal_error") < 1e-7);
    assert_int_equal(shell("$LA rollout hnn.h5 --x0 0.9,0 --time 10 --reverse --json "
                           "--integrator implicit-midpoint --dt 0.05"),
                     0);
    assert_true(shell_number("reversal_error") < 1e-12);
}

/* Column `column` (from 1) of a row of a CSV file (the header is row 0), as text. */
static double cell(const char *file, int row, int column)
{
    assert_int_equal(shell("sed -n %dp %s | cut -d, -f%d", row + 1, file, column), 0);
    return strtod(shell_out(), NULL);
}

/* H rises by 0.4 where asked, and the motion says where it leaves what was seen. */
static void test_added_energy(void **state)
{
    (void)state;
    assert_int_equal(shell("$LA rollout hnn.h5 --x0 0.9,0 --time 4 --points 5 --add-energy 0.4 "
                           "--at 2 --csv path.csv --json"),
                     0);
    assert_true(shell_number("conserved_drift") < 1e-6 && isnan(shell_number("outside_from")));
    double start = cell("path.csv", 1, 4);
    assert_close(cell("path.csv", 3, 4), start, 0, 1e-6);
    assert_close(cell("path.csv", 4, 4), start + 0.4, 0, 1e-6);
    assert_close(cell("path.csv", 5, 4), start + 0.4, 0, 1e-6);
    assert_int_equal(shell("$LA rollout hnn.h5 --x0 0.9,0 --time 4 --points 5 --add-energy 2 "
                           "--at 2 --json"),
                     0);
    assert_close(shell_number("outside_from"), 3, 1e-15, 0);
    assert_non_null(strstr(shell_last_line(), "\"outside\": \"H = "));
    assert_int_equal(shell("$LA rollout hnn.h5 --x0 3,0 --time 1"), 0);
    assert_non_null(strstr(shell_out(), "t = 0 on: H = "));
}

static void test_starts(void **state)
{
    (void)state;
    assert_int_equal(shell("$LA rollout hnn.h5 --truth spring --starts 4 --time 5 --json"), 0);
    double energy = shell_number("energy_mse"), published = shell_number("energy_mse_published");
    assert_true(energy > 0 && energy < 1e-3 && published > 0 && published != energy);
    assert_int_equal(shell("$LA rollout hnn.h5 --truth spring --starts 4 --time 5 --json --seed 2"),
                     0);
    assert_true(shell_number("energy_mse") != energy);
}

/* As published a spring's model has 1.09 times as long; the true energy does not change. */
static void test_published_of_one_start(void **state)
{
    (void)state;
    assert_int_equal(shell("$LA rollout hnn.h5 --truth spring --x0 0.7,0.1 --time 5 --json"), 0);
    double energy = shell_number("energy_mse"), published = shell_number("energy_mse_published");
    assert_int_equal(shell("$LA rollout hnn.h5 --truth spring --x0 0.7,0.1 --time 5.45 --json"), 0);
    assert_close(published, shell_number("energy_mse"), 1e-5, 0);
    assert_true(published != energy);
}

/* A circle measured every 0.1: x0 and times come from the file. */
static void test_measured(void **state)
{
    (void)state;
    FILE *out = fopen(shell_path("measured.csv"), "w");
    assert_non_null(out);
    fputs("clock,q,p\n", out);
    for (int k = 0; k <= 40; k++)
        fprintf(out, "%.17g,%.17g,%.17g\n", 3 + 0.1 * k, 0.7 * cos(0.2 * k), -0.7 * sin(0.2 * k));
    fclose(out);
    assert_int_equal(shell("$LA rollout hnn.h5 --truth measured.csv --time-column clock --from 4 "
                           "--energy spring --json --csv out.csv"),
                     0);
    assert_close(shell_number("time"), 3, 1e-12, 0);
    assert_close(shell_number("points"), 31, 0, 0);
    assert_true(shell_number("coordinate_mse") < 0.01 && shell_number("energy_mse") < 1e-4);
    assert_true(shell_number("energy_mse_published") == shell_number("energy_mse"));
    assert_close(cell("out.csv", 1, 1), 4, 1e-15, 0);
    assert_close(cell("out.csv", 1, 2), 0.7 * cos(2), 1e-12, 0);
    assert_close(cell("out.csv", 31, 9), 0.49, 1e-12, 0); /* true energy of the truth */
}

/* A scene's Lagrangian as the truth, in q and p: of `cubic` E = (q^2 + p^2)/2 + q^3/3. */
static void test_scene(void **state)
{
    (void)state;
    assert_int_equal(shell("$LA rollout hnn.h5 --truth cubic --x0 0.3,0.1 --time 7 --points 8 "
                           "--json --csv scene.csv"),
                     0);
    assert_true(shell_number("energy_mse") > 0 && isnan(shell_number("energy_mse_published")));
    assert_close(cell("scene.csv", 1, 9), 0.059, 1e-14, 0);
    assert_close(cell("scene.csv", 8, 9), 0.059, 1e-10, 0);
    assert_int_equal(shell("$LA rollout hnn.h5 --truth cubic --time 2 --json"), 0);
    assert_int_equal(shell("$LA rollout hnn.h5 --truth kepler"), 2);
    assert_mentions(shell_err(), "kepler 4 2");
    assert_int_equal(shell("$LA rollout hnn.h5 --truth keplr"), 2);
    assert_mentions(shell_err(), "'keplr' 'kepler'");
    assert_int_equal(shell("$LA rollout hnn.h5 --truth spring --set m=2"), 2);
    assert_mentions(shell_err(), "--set --truth");
}

static void test_files(void **state)
{
    (void)state;
    size_t before = shell_files();
    assert_int_equal(shell("$LA rollout hnn.h5 --truth spring --against base.h5 --out run.h5 "
                           "--plot figure.svg --csv run.csv --quiet"),
                     0);
    assert_int_equal(shell_files(), before + 3);
    assert_int_equal(shell("head -n 1 run.csv; grep -c '<svg' figure.svg"), 0);
    assert_string_equal(shell_out(), "t,q,p,H,energy,against_q,against_p,against_H,against_energy,"
                                     "truth_q,truth_p,truth_H,truth_energy\n1\n");
    assert_int_equal(shell("$LA dump run.h5"), 0);
    assert_non_null(strstr(shell_out(), "truth_state"));
}

/* The field of the spring on a grid, from what was seen; and what h5py sees of it. */
static void test_field(void **state)
{
    (void)state;
    assert_int_equal(shell("$LA field hnn.h5 --across -1,1 --up -0.5,0.5 --grid 5 --csv f.csv "
                           "--out f.h5 --plot f.svg --json"),
                     0);
    assert_close(shell_number("points"), 25, 0, 0);
    assert_int_equal(shell("head -n 1 f.csv; wc -l <f.csv; grep -c '<svg' f.svg"), 0);
    assert_string_equal(shell_out(), "q,p,dqdt,dpdt,H\n26\n1\n");
    assert_close(cell("f.csv", 1, 1), -1, 0, 0); /* corner: q = -1, p = -1/2 */
    assert_close(cell("f.csv", 1, 3), -1, 0, 0.1);
    assert_close(cell("f.csv", 1, 4), 2, 0, 0.1);
    assert_int_equal(shell("$LA dump f.h5"), 0);
    assert_non_null(strstr(shell_out(), "rate"));
    assert_int_equal(shell("$LA field base.h5 --grid 3 --csv b.csv --quiet"), 0);
    assert_close(cell("b.csv", 9, 1), 1.2, 0, 0.05); /* edge of what was seen */
}

/* As README says: weights in two lines of Python. */
static void test_weights_in_python(void **state)
{
    (void)state;
    const char *python = "python3"; /* the first in PATH, else the system's, which has packages */
    if (shell("%s -c 'import h5py'", python) != 0)
        python = "/usr/bin/python3";
    if (shell("%s -c 'import h5py'", python) != 0) {
        print_message("skipped: python3 has no h5py\n");
        skip();
    }
    assert_int_equal(shell("%s -c 'import h5py\n"
                           "print(h5py.File(\"hnn.h5\")[\"linear1.weight\"][:].shape)'",
                           python),
                     0);
    assert_string_equal(shell_out(), "(24, 2)\n");
}

/* How often a command opens hnn.h5; reads between keep two of them apart. */
static size_t opens(const char *line)
{
    char events[1 << 16];
    struct inotify_event event;
    size_t n = 0;
    int watch = inotify_init1(IN_NONBLOCK);
    assert_true(inotify_add_watch(watch, shell_path("hnn.h5"), IN_OPEN | IN_ACCESS | IN_CLOSE) >=
                0);
    shell_works("$LA %s --quiet", line);
    const ssize_t bytes = read(watch, events, sizeof events);
    close(watch);
    for (ssize_t at = 0; at < bytes; at += (ssize_t)(sizeof event + event.len)) {
        memcpy(&event, events + at, sizeof event);
        n += (event.mask & IN_OPEN) != 0;
    }
    return n;
}

/* In units of what it takes to list what is in it. */
static void test_a_model_is_read_once(void **state)
{
    static const struct {
        const char *line;
        size_t times;
    } rows[] = {{"rollout hnn.h5 --x0 .9,0", 2}, /* and whether it is a table of models */
                {"rollout base.h5 --truth spring --against hnn.h5", 1},
                {"field hnn.h5", 1},
                {"train spring.csv --from hnn.h5 --steps 1", 1}};
    (void)state;
    const size_t once = opens("dump hnn.h5");
    assert_true(once > 0);
    for (size_t k = 0; k < LENGTH(rows); k++)
        assert_int_equal(opens(rows[k].line), rows[k].times * once);
}

static void refused(const char *line, const char *why)
{
    size_t before = shell_files();
    assert_int_equal(shell("$LA %s", line), 2);
    assert_mentions(shell_err(), why);
    assert_int_equal(shell_files(), before);
}

static void test_refusals(void **state)
{
    (void)state;
    refused("rollout hnn.h5", "missing --x0");
    refused("rollout spring.csv --x0 1,0", "spring.csv");
    refused("rollout hnn.h5 --x0 1", "--x0 momenta 2");
    refused("rollout hnn.h5 --x0 1,b", "found 'b'");
    refused("rollout hnn.h5 --truth sprint", "did you mean 'spring'");
    refused("rollout hnn.h5 --truth twobody", "8 2");
    refused("rollout hnn.h5 --truth spring.csv", "--time-column");
    refused("rollout hnn.h5 --x0 1,0 --integrator verlet --dt 0.1", "verlet gauss2");
    refused("rollout hnn.h5 --x0 1,0 --integrator variational-left --dt 0.1", "Lagrangian");
    refused("rollout hnn.h5 --x0 1,0 --integrator gauss2", "needs --dt");
    refused("rollout hnn.h5 --x0 1,0 --dt 0.1", "--dt needs --integrator");
    refused("rollout hnn.h5 --x0 1,0 --add-energy 1", "--at T");
    refused("rollout hnn.h5 --x0 1,0 --add-energy 1 --at 30", "time 0 20");
    refused("rollout base.h5 --x0 1,0 --add-energy 1 --at 3", "symplectic");
    refused("rollout hnn.h5 --starts 3", "--starts needs --truth");
    refused("rollout hnn.h5 --truth spring --starts 3 --csv -", "no --x0");
    refused("rollout hnn.h5 --x0 1,0 --points 1", "--points 2");
    refused("rollout hnn.h5 --x0 1,0 --out /nonexistent/a.h5", "/nonexistent");
    refused("rollout hnn.h5 --truth spring --from 3", "--from FILE");
    refused("rollout hnn.h5 --truth kepler --trial 1", "--trial FILE");
    refused("rollout hnn.h5 --truth spring.csv --time-column t --strength 2", "--strength TASK");
    refused("rollout hnn.h5 --truth spring.csv --time-column t --points 7", "--points FILE");
    refused("field hnn.h5 --axes 1,1", "--axes two");
    refused("field hnn.h5 --axes 1,3", "--axes 2");
    refused("field hnn.h5 --across 1,-1", "--across smaller");
    refused("field hnn.h5 --grid 1", "expected 2 to 4096");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_against_truth, setup),
        cmocka_unit_test(test_reversal),
        cmocka_unit_test(test_added_energy),
        cmocka_unit_test(test_starts),
        cmocka_unit_test(test_published_of_one_start),
        cmocka_unit_test(test_measured),
        cmocka_unit_test(test_scene),
        cmocka_unit_test(test_files),
        cmocka_unit_test(test_field),
        cmocka_unit_test(test_weights_in_python),
        cmocka_unit_test(test_a_model_is_read_once),
        cmocka_unit_test(test_refusals),
    };
    return cmocka_run_group_tests(tests, shell_setup, shell_teardown);
}
