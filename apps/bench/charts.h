/* Charts: measurements that leave their data and pictures in a folder and print a table. One
   function, one file each; the table of cmd_chart.c names them. */
#ifndef APPS_CHARTS_H
#define APPS_CHARTS_H

#include "apps/output/plot.h"
#include "apps/output/result.h"

struct chart_settings {
    const char *folder;      /* created where missing */
    const char *format;      /* of the pictures: svg or png */
    bool quick;              /* fewer repetitions, a smaller range */
    bool json, quiet;        /* a JSON object as last line; no table */
    const char *data, *from; /* ephemeris: the folder of tables, and the first day */
    size_t days;
};

/* Gradient of the action, and its Hessian times a vector, by the tape and by hand: gradients.csv
   and its picture; path and derivatives themselves in gradients-values.csv. Returns the exit
   status: NOT_REACHED where tape and hand differ. */
int chart_gradients(const struct chart_settings *settings, struct ad_error *error);
/* Time and memory of a gradient over slices and over pairs: linear.csv and its picture; what a
   second thread buys, threads.csv. NOT_REACHED where it changes a bit. */
int chart_linear(const struct chart_settings *settings, struct ad_error *error);
/* Every integrator on problems with known answers: error against work, in integrators.csv and a
   picture a problem; energy over many periods at equal work, in drift.csv and its picture. */
int chart_integrators(const struct chart_settings *settings, struct ad_error *error);
/* Paths: rules against slices in rules.csv, solvers against time in paths.csv, and their pictures.
 */
int chart_paths(const struct chart_settings *settings, struct ad_error *error);
/* Whole jobs, paths, networks and a packet, with the published settings and with ours: jobs.csv and
   its picture. */
int chart_jobs(const struct chart_settings *settings, struct ad_error *error);
/* Models of the inner planets against Horizons tables, from the published one on: ephemeris.csv and
   its picture. */
int chart_ephemeris(const struct chart_settings *settings, struct ad_error *error);
/* Seconds a step of the gas against its bodies, with all and with near pairs, in gas.csv; order
   against temperature in gas-order.csv; one picture of both. */
int chart_gas(const struct chart_settings *settings, struct ad_error *error);
/* Hamiltonian networks and baselines: a step of training beside its floor, hnn-steps.csv; the
   losses of the first steps, for peers, hnn-losses.csv; what is learned against seconds,
   hnn-learning.csv; rollouts by every integrator, the field in f64 and in f32, hnn-rollouts.csv;
   pictures of the latter two. */
int chart_hnn(const struct chart_settings *settings, struct ad_error *error);

/* Wave packets by kernel, Fourier transforms and Crank-Nicolson: error against seconds in
   quantum.csv and its picture; a slice beside the product of matrices that it is in
   quantum-slices.csv. */
int chart_quantum(const struct chart_settings *settings, struct ad_error *error);

/* ---- files of a chart (chart_files.c) ---- */

/* Makes the folder and begins NAME.csv in it, under lines that say on what machine, when and with
   which versions; before anything is measured, so that a folder that cannot be written is found at
   once. */
enum ad_status chart_csv(const struct chart_settings *settings, const char *name,
                         struct result *csv, struct ad_error *error);
/* Begins the picture NAME.svg (or .png) in the folder; a line of small print says the same. */
enum ad_status chart_picture(const struct chart_settings *settings, const char *name,
                             struct plot *plot, struct ad_error *error);
/* Both in place, or where there is an error neither; its status. Takes those that never began. */
enum ad_status chart_end(struct plot *plot, struct result *csv, struct ad_error *error);

#endif
