/* The parts of `leastaction quantum`: what is asked made definite (quantum_setup), run and measured
   (quantum_run), written and drawn (quantum_write, quantum_picture); the published
   variant beside the right one (quantum_paper) and two dimensions (quantum_slit). */
#ifndef APPS_QUANTUM_H
#define APPS_QUANTUM_H

#include "apps/options.h"
#include "apps/output/outputs.h"
#include "apps/output/report.h"
#include "quantum/quantum.h"

struct quantum_options {
    struct common common;
    const char *scene, *box, *method, *rule, *walls, *preset;
    struct texts packets;
    double hbar, dt, absorb, scale, tolerance;
    size_t points, steps, every, power;
    bool normalise, force, no_reference;
    struct settings set;
};

/* A run made definite. */
struct quantum_run {
    const struct quantum_options *options;
    const char *name; /* of the scene, as asked for */
    struct phys_system system;
    struct qm_slice slice;
    const struct qm_method *method;
    struct qm_aliasing aliasing;
    size_t steps, every;
    size_t n_packets;
    struct qm_gaussian *packet; /* [n_packets] */
};

/* Scene, parameters, packets, slice; aliasing looked at, memory and time foreseen. Ends with
   quantum_free, whatever it returned. */
enum ad_status quantum_setup(const struct quantum_options *options, struct quantum_run *run,
                             struct ad_error *error);
void quantum_free(struct quantum_run *run);

struct quantum_result {
    size_t n; /* samples: the start, every so many slices, the end */
    double *t;
    struct qm_moments *moments; /* [n x packets] */
    double *density;            /* [n x points] |psi|^2 of the first packet */
    double *classical; /* [n] where a particle would be; NaN from where that is not known */
    qm_complex *psi;   /* [points x packets] at the end */
    double error;      /* the packets' largest sqrt(int |psi - truth|^2); NaN: not asked for */
    const char *truth; /* what the error is against */
    double seconds, setup_seconds; /* of moving; of building what moves */
    bool interrupted;
};

/* Runs and measures. Ends with quantum_result_free, whatever it returned. */
enum ad_status quantum_run(const struct quantum_run *run, struct quantum_result *result,
                           struct ad_error *error);
void quantum_result_free(struct quantum_result *result);

/* ---- writing ---- */

void quantum_report(const struct quantum_run *run, const struct quantum_result *result,
                    struct report *report);
/* A row a sample and packet: t, packet, norm, mean, width, where a particle would be. */
void quantum_write_csv(const struct quantum_run *run, const struct quantum_result *result,
                       FILE *out);
/* The report as attributes, parameters of the scene, samples, psi at the end. */
enum ad_status quantum_file(const struct quantum_run *run, const struct quantum_result *result,
                            const struct report *report, phys_runfile *file,
                            struct ad_error *error);
enum ad_status quantum_picture(const struct quantum_run *run, const struct quantum_result *result,
                               struct plot *plot, struct ad_error *error);

/* ---- runs of another kind; they return the exit status ---- */

int quantum_paper(const struct quantum_options *options, struct ad_error *error);
int quantum_slit(const struct quantum_options *options, struct ad_error *error);

#endif
