/* Loops as they run: one step is a program, run over and over. The way back is the program of its
   adjoint, on states that are stored or computed again from stored ones (checkpoints.c). */
#ifndef AUTODIFF_SCAN_SCAN_H
#define AUTODIFF_SCAN_SCAN_H

#include "autodiff/internal.h"

/* A matrix in memory: bytes from row to row; a row is contiguous. */
struct matrix_at {
    const char *start;
    size_t step;
};

/* A loop and its states; NULL, with an error, when the body does not compile. */
struct scan *ad_scan_new(const struct loop *loop, struct ad_error *error);
/* Room for states that scans store from now on; false when out of memory. */
bool ad_scan_keep(struct scan *scan);
/* Runs the loop on operands z (as in the node); result: its value, or NULL. `checked`: every value
   of every step is looked at. */
void ad_scan_run(struct scan *scan, const struct matrix_at z[], char *result, bool checked);

/* The way back, for the operands that are wanted. */
struct scan_adjoint *ad_scan_adjoint_new(const struct loop *loop, const uint8_t wanted[],
                                         struct ad_error *error);
/* Runs it on the operands that the scan ran on last; result: the wanted adjoints. States that other
   ways back have used up are computed anew. */
void ad_scan_adjoint_run(struct scan_adjoint *adjoint, struct scan *scan,
                         const struct matrix_at z[], const char *seed, char *result, bool checked);

/* What was wrong with the last run: the step is named. */
const struct ad_error *ad_scan_error(const struct scan *scan);
const struct ad_error *ad_scan_adjoint_error(const struct scan_adjoint *adjoint);
/* The programs, for threads and machine code. */
ad_program *ad_scan_program(struct scan *scan);
size_t ad_scan_steps(const struct scan *scan);
ad_program *ad_scan_adjoint_program(struct scan_adjoint *adjoint);
/* Bytes beside the program; all but states and sums are small. */
size_t ad_scan_bytes(const struct scan *scan);
size_t ad_scan_adjoint_bytes(const struct scan_adjoint *adjoint);

/* ---- checkpoints ---- */

/* How far to go from a stored state, with `slots` more to store, until the next is stored: so that
   all of `steps` states, from the last to the first, take the fewest steps forward. */
size_t ad_checkpoint_after(size_t steps, size_t slots);

#endif
