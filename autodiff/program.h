/* Programs compiled from a tape. See autodiff.h, also for errors and threads. Errors: the tape's.
   Shapes: values are rows*cols doubles, row-major. Lifetime: storage of values is the program's. */
#ifndef AUTODIFF_PROGRAM_H
#define AUTODIFF_PROGRAM_H

#include "tape.h"

AD_HEADER_BEGIN

/* Compiles what the outputs need into a program, freed by the caller; it outlives the tape, whose
   variables name its inputs and outputs. On failure *program is NULL; the status is returned and
   kept in the tape. */
enum ad_status ad_compile(ad_tape *tape, size_t n_out, const ad_var out[], ad_program **program);
void ad_program_free(ad_program *program); /* takes NULL */

/* Sets an input from rows*cols doubles (converted for f32). AD_E_TAPE if x is not an input of the
   program, or of another tape or recording. Every input recorded before compiling is one, whether
   an output needs it or not. */
enum ad_status ad_set(ad_program *program, ad_var x, const double *values);
/* Copies an input or output to rows*cols doubles; AD_E_TAPE as above. */
enum ad_status ad_get(const ad_program *program, ad_var x, double *values);
/* The storage of an input or output: rows*cols contiguous elements of the tape's type, at an
   address fixed for the life of the program; NULL if the program has no such input or output. */
void *ad_data(ad_program *program, ad_var x);
/* Runs the program; allocates nothing, except where ad_native_lazy compiles. */
void ad_run(ad_program *program);
/* As ad_run, but keeps the values that depend on held inputs alone from the last ad_run.
   AD_E_ARGUMENT, and nothing runs, before the first ad_run and after a held input was set
   (ad_program_error names it), and after an interrupted run. Writes through ad_data are not
   detected. */
enum ad_status ad_rerun(ad_program *program);
/* The error of the last run: a refused ad_rerun, an interrupted loop, a singular column or an
   ad_custom that failed; status AD_OK if none. Lives as long as the program. */
const struct ad_error *ad_program_error(const ad_program *program);
/* The largest condition number of the regular matrices of ad_solve, ad_inverse and ad_logdet in the
   last run, scaled as above: an estimate from below, mostly within a factor of 3. Times 2e-16 (f32:
   1e-7) it is the relative error to expect of the largest unknown. 0 if all are certainly below
   5e11 (f32: 1.5e5), which leaves a quarter of the digits; INFINITY if the scales exceed the range
   of numbers. */
double ad_program_condition(const ad_program *program);
/* As ad_run; returns the seconds spent in matrix products, inside OpenBLAS. */
double ad_run_timed(ad_program *program);

/* Compiles the program to machine code by the system's C compiler (CC, or cc), cached in the user's
   cache folder ($XDG_CACHE_HOME/leastaction, or ~/.cache/leastaction). `runs` is roughly how often
   ad_run will be called: the program is compiled only if that saves more time than compiling takes,
   0.15 s and 6.5 s for a megabyte of source, 2.5 ms for a loop, 2 ms for a sine; INFINITY compiles
   in any case (up to 65536 instructions). Returns true if the program now runs as machine code.
   False if it stays interpreted, with the reason in `note` (may be NULL): compiling does not pay,
   there is no compiler or no safe folder, or LEASTACTION_NATIVE=0 is in the environment. Values
   agree to rounding.

   The first run of new machine code times it and the interpreter in turn (but for INFINITY). Where
   it is slower, as long segments may be whose values do not fit registers, the program goes back to
   the interpreter, ad_native_note says so, and the cache keeps it for later programs. */
bool ad_native(ad_program *program, double runs, struct ad_error *note);

/* As ad_native, for an unknown number of runs: ad_run or ad_rerun compiles the program first once
   the earlier runs would have saved as much time as compiling takes. The moment depends on the
   program and on what the cache knows of its machine code alone, so that the same work gives the
   same bits. */
void ad_native_lazy(ad_program *program);
/* As ad_native, on all ranks (ranks.h) or on none, as rank 0 decides for the same program: machine
   code rounds otherwise than the interpreter, so that results are the same bits on any number of
   ranks only where `runs` does not depend on a rank's share. Before the first ad_run; where it may
   be machine code, rank 0 runs it once, with whatever its inputs are. */
struct ad_ranks;
enum ad_status ad_native_ranks(struct ad_ranks *ranks, ad_program *program, double runs,
                               struct ad_error *error);
/* For the handler of a signal that ends the process: removes the files of unfinished compilations.
 */
void ad_native_abandon(void);
/* Why the program is interpreted; "" if it is not. Lives as long as the program. */
const char *ad_native_note(const ad_program *program);

/* Number of threads for large segments (default 1). Results are the same to the last bit. */
void ad_set_threads(ad_program *program, size_t threads);

/* As ad_run, and checks every value: AD_E_NONFINITE with operation, label and position of the first
   node, in the order of recording, that is not finite. */
enum ad_status ad_run_checked(ad_program *program, struct ad_error *error);

/* Sizes of a compiled program. */
struct ad_program_info {
    size_t nodes;        /* after removing dead nodes and sharing equal ones */
    size_t constants;    /* of these, computed once at compile time */
    size_t instructions; /* executed in each run */
    size_t segments;     /* passes over memory in each run */
    size_t value_bytes;  /* values in memory: inputs, outputs, values that cross segments, tiles */
    size_t bytes;        /* everything else the program holds */
};
struct ad_program_info ad_program_info(const ad_program *program);

AD_HEADER_END
#endif
