/* Assignment of columns to coordinates, momenta and rates by their names. */
#include "datasets.h"
#include "physics/io/hdf5_file.h"
#include "tests/close.h"
#include "tests/files.h"

#include <stdio.h>
#include <string.h>

/* ---- A21: pairs by name ---- */

static const struct {
    const char *header, *time, *state; /* state NULL: refused */
} headers[] = {
    {"q1,p1,q2,p2", "t", "q1,q2,p1,p2"},
    {"p2,q1,q2,p1", "t", "q1,q2,p1,p2"},
    {"q1,p1,q2,p2", NULL, "q1,q2,p1,p2"}, /* with rates */
    {"p,q", NULL, "q,p"},
    {"x,px,y,py", NULL, "x,y,px,py"},
    {"x,y,px,py", NULL, "x,y,px,py"},
    {"theta,p_theta,phi,p_phi", NULL, "theta,phi,p_theta,p_phi"},
    {"ptheta,theta", NULL, "theta,ptheta"},
    {"r,theta,p_r,p_theta", "t", "r,theta,p_r,p_theta"},
    {"x1,v1,x2,v2", "t", "x1,x2,v1,v2"},
    {"x1,y1,x2,y2,vx1,vy1,vx2,vy2", "t", "x1,y1,x2,y2,vx1,vy1,vx2,vy2"},
    {"theta1,omega1,theta2,omega2", "t", "theta1,theta2,omega1,omega2"},
    {"pos_a,mom_a,pos_b,mom_b", "t", "pos_a,pos_b,mom_a,mom_b"},
    {"a_pos,a_vel,b_pos,b_vel", "t", "a_pos,b_pos,a_vel,b_vel"},
    {"x,x_dot,y,y_dot", "t", "x,y,x_dot,y_dot"},
    {"Q1,P1,Q2,P2", "t", "Q1,Q2,P1,P2"},
    {"q1x,q2x,q1y,q2y,p1x,p2x,p1y,p2y", NULL, "q1x,q2x,q1y,q2y,p1x,p2x,p1y,p2y"},
    {"q1 [m],p1 [kg m/s],q2 [m],p2 [kg m/s]", "t", "q1 [m],q2 [m],p1 [kg m/s],p2 [kg m/s]"},
    {"a,b", "t", "a,b"},
    {"a,b", NULL, "a,b"},
    {"a,b,c,d", "t", NULL},
    {"a,b,c,d", NULL, NULL},
    {"q1,p1,q2,pp", "t", NULL},
    {"x,v,p,y", "t", NULL},    /* two momenta of x */
    {"x,vx,pvx,y", "t", NULL}, /* vx is a momentum and has one */
    {"q1,q2,q3,p1", NULL, NULL},
    {"q1,p1,q2", "t", NULL},
    {"p1,p2,p3,p4", "t", NULL},
};

/* Rows of distinct numbers, "d%sdt" for every name where there is no time. */
static struct path write_columns(const char *header, const char *time)
{
    struct path file = files_temporary("names.csv");
    FILE *out = fopen(file.text, "w");
    size_t n = 1;
    for (const char *c = header; *c; c++)
        n += *c == ',';
    fprintf(out, "%s%s", time ? "t," : "", header);
    char copy[256];
    snprintf(copy, sizeof copy, "%s", header);
    for (char *name = strtok(copy, ","); name && !time; name = strtok(NULL, ","))
        fprintf(out, ",d%sdt", name);
    for (size_t i = 0; i < 4; i++) {
        fputc('\n', out);
        if (time)
            fprintf(out, "%zu,", i);
        for (size_t k = 0; k < (time ? n : 2 * n); k++)
            fprintf(out, "%s%.3f", k ? "," : "", (double)(10 * k + i) + 0.125);
    }
    fclose(out);
    return file;
}

static void test_pairs(void **state)
{
    (void)state;
    for (size_t k = 0; k < LENGTH(headers); k++) {
        struct path file = write_columns(headers[k].header, headers[k].time);
        struct hnn_dataset_settings s = {
            .size = sizeof s, .file = file.text, .time = headers[k].time};
        struct hnn_dataset d;
        struct ad_error error = {0};
        enum ad_status status = hnn_dataset_read(&s, &d, &error);
        if (!headers[k].state) {
            if (status != AD_E_INPUT || !strstr(error.message, "expected"))
                fail_msg("%s: %d '%s' '%s'", headers[k].header, status, error.message,
                         d.state_names ? d.state_names : "");
        } else if (status != AD_OK || strcmp(d.state_names, headers[k].state) != 0) {
            fail_msg("%s: %s%s", headers[k].header, error.message, status ? "" : d.state_names);
        } else if (!headers[k].time) {
            /* the rate of a component is 10 times the number of components above it */
            for (size_t c = 0; c < 2 * d.dof; c++)
                assert_close(d.train.target[c * 4] - d.train.x[c * 4], 20 * (double)d.dof, 1e-12,
                             0);
        }
        hnn_dataset_free(&d);
    }
}

/* The halves, and names with commas in them, which can be chosen again as they are told. */
static void test_names_are_told(void **state)
{
    (void)state;
    struct path file =
        files_write_text("said.csv", "\"p, kg\",\"the \"\"q\"\"\",a,b\n1,2,3,4\n5,6,7,9\n");
    struct hnn_dataset_settings s = {
        .size = sizeof s, .file = file.text, .state = "\"the \"\"q\"\"\",\"p, kg\"", .rate = "a,b"};
    struct hnn_dataset d = dataset_of(&s);
    assert_string_equal(d.coordinates, "\"the \"\"q\"\"\"");
    assert_string_equal(d.momenta, "\"p, kg\"");
    assert_string_equal(d.rate_names, "a,b");
    s.state = d.state_names;
    struct hnn_dataset again = dataset_of(&s);
    assert_memory_equal(again.train.x, d.train.x, 4 * sizeof(double));
    hnn_dataset_free(&again);
    hnn_dataset_free(&d);
}

/* ---- rates ---- */

static void test_rates_by_name(void **state)
{
    (void)state;
    struct path file = files_write_text("rates.csv", "q,p,dqdt,dpdt,f\n1,2,3,4,5\n2,1,5,7,8\n");
    struct hnn_dataset_settings s = {
        .size = sizeof s, .file = file.text, .state = "q,p", .rate = "dpdt,dqdt"};
    struct hnn_dataset d = dataset_of(&s);
    assert_string_equal(d.rate_names, "dqdt,dpdt");
    assert_close(d.train.target[0], 3, 0, 0);
    hnn_dataset_free(&d);
    s.rate = "dqdt,f"; /* in its place by name, the other unknown */
    d = dataset_of(&s);
    assert_string_equal(d.rate_names, "dqdt,f");
    hnn_dataset_free(&d);
    s.rate = "f,dqdt";
    dataset_refused(&s, AD_E_INPUT, "'dqdt' 'q' rate");
    s.rate = "dqdt,dqdt";
    dataset_refused(&s, AD_E_ARGUMENT, "column 3 twice");
    files_write_text("rates.csv", "q,p,dqdt,q\n1,2,3,4\n"); /* equal names apart */
    s.state = s.rate = NULL;
    dataset_refused(&s, AD_E_INPUT, "'q' differ number");
}

/* ---- C7: arrays of HDF5, which have no order ---- */

static void write_array(phys_hdf5 *file, const char *name, size_t cols, double first)
{
    double values[12];
    for (size_t i = 0; i < 3; i++)
        for (size_t k = 0; k < cols; k++)
            values[i * cols + k] = first + (double)(10 * k + i);
    phys_hdf5_write(file, name, AD_F64, cols > 1 ? 2 : 1, (size_t[]){3, cols}, values);
}

static struct path write_arrays(size_t n, const char *const names[], size_t cols)
{
    struct path path = files_temporary("arrays.h5");
    struct ad_error error = {0};
    phys_hdf5 *file;
    assert_int_equal(phys_hdf5_create(path.text, &file, &error), AD_OK);
    if (strchr(names[0], '/'))
        phys_hdf5_folder(file, "run");
    for (size_t k = 0; k < n; k++)
        write_array(file, names[k], cols, 100 * (double)k);
    assert_int_equal(phys_hdf5_commit(file, &error), AD_OK);
    return path;
}

static void test_arrays(void **state)
{
    (void)state;
    static const char *const plain[] = {"p", "q", "dpdt", "dqdt"};
    static const char *const folder[] = {"run/q", "run/p", "run/dqdt", "run/dpdt"};
    static const char *const other[] = {"a", "b", "dadt", "dbdt"};
    const struct {
        const char *const *names;
        size_t cols;
        const char *state;
        double q, p, dq, dp; /* first row of the first */
    } cases[] = {{plain, 1, "q,p", 100, 0, 300, 200},
                 {plain, 2, "q.1,q.2,p.1,p.2", 100, 0, 300, 200},
                 {folder, 1, "run/q,run/p", 0, 100, 200, 300},
                 {folder, 2, "run/q.1,run/q.2,run/p.1,run/p.2", 0, 100, 200, 300},
                 {other, 1, NULL, 0, 0, 0, 0}};
    for (size_t k = 0; k < LENGTH(cases); k++) {
        struct path file = write_arrays(4, cases[k].names, cases[k].cols);
        struct hnn_dataset_settings s = {.size = sizeof s, .file = file.text};
        if (!cases[k].state) {
            dataset_refused(&s, AD_E_INPUT, "order");
            continue;
        }
        struct hnn_dataset d = dataset_of(&s);
        size_t half = d.dof * d.train.n;
        assert_string_equal(d.state_names, cases[k].state);
        assert_close(d.train.x[0], cases[k].q, 0, 0);
        assert_close(d.train.x[half], cases[k].p, 0, 0);
        assert_close(d.train.target[0], cases[k].dq, 0, 0);
        assert_close(d.train.target[half], cases[k].dp, 0, 0);
        hnn_dataset_free(&d);
    }
}

/* Neighbours of a lattice are neighbours in the file: q10 follows q9, not q1. */
static void test_numbered_arrays(void **state)
{
    (void)state;
    enum { SITES = 11 };
    static const char *const kinds[] = {"q%zu", "p%zu", "dq%zudt", "dp%zudt"};
    char text[4 * SITES][16];
    const char *names[4 * SITES];
    for (size_t k = 0; k < LENGTH(names); k++) {
        snprintf(text[k], sizeof text[k], kinds[k / SITES], k % SITES + 1);
        names[k] = text[k];
    }
    struct path file = write_arrays(LENGTH(names), names, 1);
    struct hnn_dataset_settings s = {.size = sizeof s, .file = file.text};
    struct hnn_dataset d = dataset_of(&s);
    assert_int_equal(d.dof, SITES);
    for (size_t k = 0; k < 2 * SITES; k++) {
        assert_close(d.train.x[k * d.train.n], 100 * (double)k, 0, 0);
        assert_close(d.train.target[k * d.train.n], 100 * (double)(2 * SITES + k), 0, 0);
    }
    hnn_dataset_free(&d);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_pairs),           cmocka_unit_test(test_names_are_told),
        cmocka_unit_test(test_rates_by_name),   cmocka_unit_test(test_arrays),
        cmocka_unit_test(test_numbered_arrays),
    };
    return cmocka_run_group_tests_name("names of columns", tests, files_setup, files_teardown);
}
