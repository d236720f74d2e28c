/* Functions that report no error take NULL, and numbers of nothing: they return, with NaN, NULL or
 * 0. */
#include "tests/close.h"
#include "autodiff/optim.h"
#include "autodiff/series.h"
#include "physics/ephemeris/models.h"
#include "physics/fit/fit.h"
#include "physics/motion/checks.h"
#include "physics/path/path.h"
#include "physics/stability/family.h"
#include "hnn/pixels/pixels.h"
#include "quantum/slit.h"

#include <math.h>
#include <stdint.h>

static void test_defaults(void **state)
{
    (void)state;
    ad_optimiser_defaults_to(NULL, AD_ADAM);
    phys_path_defaults_to(NULL, NULL);
    hnn_defaults_to(NULL, HNN_HAMILTONIAN, 1);
    hnn_training_defaults_to(NULL);
    hnn_video_published_to(NULL);
    qm_slit_defaults_to(NULL);
}

static void test_series(void **state)
{
    double number[AD_SERIES_POINTS] = {0.25};
    (void)state;
    assert_false(ad_points_put(NULL, 0, NULL));
    assert_null(ad_points_input(NULL, 0, 0));
    assert_null(ad_points_output(NULL, 0, 0));
    ad_points_flow_cut(NULL, 1, number);
    ad_series_rates_cut(NULL, 1, number, number, number);
    ad_points_sum(NULL, NULL, 1);
    ad_points_norm(NULL, NULL, 1);
    ad_points_radius(NULL, NULL, 1, 1);
    assert_true(number[0] == 0.25);
}

static void test_words_and_paths(void **state)
{
    double path[3] = {0.25, 7, 1.5};
    char name[8] = "before";
    (void)state;
    assert_null(phys_ephemeris_planet(PHYS_EPHEMERIS_PLANETS));
    assert_null(phys_periodic_word((enum phys_periodic_kind)4));
    assert_null(phys_family_mark_word((enum phys_family_mark)8));
    assert_string_equal(phys_time_name(NULL), "t");
    assert_int_equal(phys_grid_of(NULL).slices, 0);
    assert_true(isnan(phys_grid_time(NULL, 3)));
    phys_path_line(1, 3, NULL, path);
    phys_path_bend(1, 3, NULL, path);
    phys_path_line(1, 3, path, NULL);
    assert_true(path[1] == 7);
    phys_check_row_name(NULL, 1, name, sizeof name);
    assert_string_equal(name, "");
    phys_check_row_name(NULL, 1, NULL, 8);
    name[0] = 'x';
    phys_fit_name(NULL, NULL, NULL, 1, name, sizeof name);
    assert_string_equal(name, "");
    phys_fit_name(NULL, NULL, NULL, SIZE_MAX, NULL, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_defaults),
        cmocka_unit_test(test_series),
        cmocka_unit_test(test_words_and_paths),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
