/* Internals shared by the files of quantum/. */
#ifndef QUANTUM_INTERNAL_H
#define QUANTUM_INTERNAL_H

#include "physics/system/internal.h"
#include "quantum.h"

/* Straight paths of one slice on a tape, a column a path. The start x_b is seen at s x_b + c: s =
   1, c = 0 for the path itself, others for its mirror images and windings. */
struct qm_paths {
    ad_tape *tape;
    ad_var xa, xb;        /* inputs [1 x n] */
    ad_var s, c;          /* inputs [1 x 1] */
    ad_var action, mixed; /* S, and D = -d2S / dx_a dx_b, [1 x n] or [1 x 1] */
    ad_var distance;      /* x_a - (s x_b + c) */
};
enum ad_status qm_paths_record(const struct qm_slice *slice, size_t n, struct qm_paths *paths,
                               struct ad_error *error);
void qm_paths_free(struct qm_paths *paths);

/* What every computation asks of a slice: AD_E_ARGUMENT. */
enum ad_status qm_slice_check(const struct qm_slice *slice, struct ad_error *error);

/* The rule of a slice: its own, or trapezoid. */
const struct phys_rule *qm_rule(const struct qm_slice *slice, struct ad_error *error);

/* Actions [n] and mixed derivatives [n] of the paths from xb [n] to xa [n], not those of images. */
enum ad_status qm_actions(const struct qm_slice *slice, size_t n, const double *xa,
                          const double *xb, double *action, double *mixed, struct ad_error *error);
/* Rows first ... first + rows - 1 of K [rows x n], absorbing layers left out. */
enum ad_status qm_kernel_rows(const struct qm_slice *slice, size_t first, size_t rows,
                              qm_complex *K, struct ad_error *error);

/* AD_E_ARGUMENT where L(q, -v) is not L(q, v): a path and its mirror image differ in action then.
 */
enum ad_status qm_check_mirror(const struct qm_slice *slice, struct ad_error *error);

/* qm_packet on a grid in the box of a slice; around a ring the packet is wound, with norm 1:
   AD_E_ARGUMENT where its turns cancel or are too many to add. */
enum ad_status qm_packet_wound(const struct qm_slice *slice, const struct qm_grid *grid,
                               const struct qm_gaussian *packet, size_t packets, size_t column,
                               qm_complex *psi, struct ad_error *error);

/* The grid that a propagator was made for. */
const struct qm_grid *qm_propagator_grid(const qm_propagator *propagator);

/* psi [n], elements `stride` apart, becomes NaN: what a function without a status leaves of
   arguments that make no sense. Takes NULL. */
void qm_unknown(size_t n, size_t stride, qm_complex *psi);

/* mask [n]: what the absorbing layers leave of a wave in a slice. */
void qm_absorber(const struct qm_slice *slice, double *mask);

#endif
