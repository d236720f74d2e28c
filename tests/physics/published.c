/* results.json and the paths beside it, for every test that needs them. */
#include "published.h"
#include "physics/io/csv.h"
#include "tests/close.h"
#include "tests/files.h"

#include <stdio.h>
#include <stdlib.h>

const struct published published[N_PUBLISHED] = {
    {"freebody", 9.540104166666666, 23.354166666666668, -13.814062500000002, 8.835124069983726,
     22.823188059361854, -13.988063989378128, 629.6591367438381, 0.3413511545904644},
    {"pendulum", 81.90450145562875, 98.24311532304586, -16.33861386741711, 81.70051157978466,
     98.00518945034811, -16.304677870563452, 0.1184489453018781, 0.012026460890992423},
    {"dblpend", 1.5791820080976313, -1.0116185558267268, 2.590800563924358, 1.5531180581519797,
     -1.041573023984462, 2.5946910821364417, 0.1696114315249217, 0.003197451669921092},
    {"threebody", 0.0002480689645546746, -0.00044614782706382296, 0.0006942167916184975,
     0.0002508045761792892, -0.0004470792235781488, 0.0006978837997574381, 0.009735116282444846,
     5.66518428148181e-06},
    {"gas", 0.00011106502585008808, 3.299190884042319e-05, 7.807311700966489e-05,
     0.0001184171228748051, 4.132307559067941e-05, 7.709404728412569e-05, 3.085949488053097e-05,
     2.7885420261898284e-06},
    {"ephemeris", 1.2817408397602043e+33, -2.4771797544812632e+33, 3.7589205942414676e+33,
     1.2627271718747088e+33, -2.48719993133504e+33, 3.7499271032097485e+33, 1.4992017158390622e+20,
     7.079922595936901e+17},
};

void assert_no_error(const struct ad_error *error)
{
    if (error->status != AD_OK)
        fail_msg("%s", error->message);
}

struct phys_system published_system(const char *scene)
{
    struct phys_system system;
    struct ad_error error = {0};
    phys_system_open(scene, &system, &error);
    assert_no_error(&error);
    const struct phys_preset *paper = system.scene->paper;
    for (size_t k = 0; k < paper->n_set; k++)
        phys_system_set(&system, paper->set[k].name, paper->set[k].value, &error);
    assert_no_error(&error);
    return system;
}

double *published_path(const struct phys_system *system, const char *kind)
{
    char name[128];
    snprintf(name, sizeof name, "ncf/%s_%s.csv", system->scene->name, kind);
    struct path file = files_data(name);
    double *table;
    size_t rows, cols;
    struct ad_error error = {0};
    phys_table_read(file.text, &rows, &cols, &table, &error);
    assert_no_error(&error);
    assert_int_equal(rows, system->scene->paper->slices);
    assert_int_equal(cols, system->dof);
    double *path = malloc(rows * cols * sizeof *path);
    for (size_t i = 0; i < rows; i++)
        for (size_t k = 0; k < cols; k++)
            path[k * rows + i] = table[i * cols + k];
    free(table);
    return path;
}

double mean_square_distance(size_t n, const double *a, const double *b)
{
    double sum = 0;
    for (size_t k = 0; k < n; k++)
        sum += (a[k] - b[k]) * (a[k] - b[k]);
    return sum / (double)n;
}
