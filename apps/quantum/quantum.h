/* The parts of `leastaction quantum`: setup and run (quantum_setup), output
   (quantum_write, quantum_picture); the published variant beside the correct one (quantum_paper),
   and two dimensions (quantum_slit). */
#ifndef APPS_QUANTUM_QUANTUM_H
#define APPS_QUANTUM_QUANTUM_H

#include "apps/options.h"
#include "apps/output/outputs.h"
#include "apps/output/progress.h"
#include "apps/output/report.h"
#include "hnn/hnn.h"
#include "quantum/published.h"
#include "quantum/run.h"
#include "quantum/slit.h"

struct quantum_options {
    struct common common;
    const char *scene, *box, *method, *rule, *walls, *preset;
    struct texts packets;
    double hbar, dt, absorb, scale, tolerance;
    size_t points, steps, every, power;
    bool normalise, force, no_reference;
};

/* A run made definite. */
struct quantum_run {
    const struct quantum_options *options;
    const char *name; /* of the scene, as asked for */
    struct phys_system system;
    struct qm_slice slice;
    struct qm_run_settings settings; /* its packets are owned */
    struct qm_aliasing aliasing;
    struct qm_run_result result;
    struct progress progress;
};

/* Scene, parameters, packets, slice; aliasing looked at, memory and time foreseen. Ends with
   quantum_free, whatever it returned. */
enum ad_status quantum_setup(const struct quantum_options *options, struct quantum_run *run,
                             struct ad_error *error);
void quantum_free(struct quantum_run *run);

/* Of a struct quantum_run: runs and measures, and what is written. The CSV has a row a sample and
   packet: t, packet, norm, mean, width, where a particle would be; the run file the parameters of
   the scene, samples, psi at the end. */
enum ad_status quantum_run(void *run, struct ad_error *error);
extern const struct output_kind quantum_outputs;
void quantum_write_csv(const void *run, FILE *out);
enum ad_status quantum_file(const void *run, phys_hdf5 *file, struct ad_error *error);
enum ad_status quantum_picture(const void *run, struct plot *plot, struct ad_error *error);

/* Of pictures: a block t x density, a scan a sample; and over it the mean and, where it is there,
   the particle, columns of block `motion`. */
void quantum_density(size_t frames, size_t n, const double *t, const double *density, double low,
                     double dx, FILE *out);
struct figure;
void quantum_carpet(struct figure *figure, int density, int motion, bool particle);

/* ---- runs of another kind; they return the exit status ---- */

int quantum_paper(const struct quantum_options *options, struct ad_error *error);
int quantum_slit(const struct quantum_options *options, struct ad_error *error);

/* The published variant beside the same scene with a correct kernel: run (quantum_paper.c), picture
   (quantum_paper_picture.c). */
struct paper {
    struct qm_published old;
    struct quantum_run run; /* done right */
};

enum ad_status paper_picture(const void *paper, struct plot *plot, struct ad_error *error);

/* The double slit as a command: run (quantum_slit.c), picture (quantum_slit_picture.c). */
struct slit_run {
    const struct quantum_options *options;
    struct qm_slit slit;
    double seconds, setup_seconds;
    bool interrupted;
};

enum ad_status slit_picture(const void *run, struct plot *plot, struct ad_error *error);

#endif
