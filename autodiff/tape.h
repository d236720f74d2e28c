/* Tapes, and the values recorded on them. See autodiff.h, also for threads. Lifetime: what *_new
   makes lives until its *_free. */
#ifndef AUTODIFF_TAPE_H
#define AUTODIFF_TAPE_H

#include "status.h"

AD_HEADER_BEGIN

enum ad_type { AD_F32, AD_F64 }; /* element type of a tape and of the programs compiled from it */

typedef struct ad_tape ad_tape;
typedef struct ad_program ad_program;

/* Handle of one value on a tape, passed by value. Valid until its tape is reset or freed; then
   operations refuse it with AD_E_TAPE, those on a freed tape and its variables until 64 more tapes
   are freed. They also refuse {0}, which was never recorded. */
typedef struct ad_var {
    ad_tape *tape;
    uint32_t id;
    uint32_t recording; /* number of the recording; each reset starts another */
} ad_var;

/* New empty tape; NULL when memory is exhausted. */
ad_tape *ad_tape_new(enum ad_type type);
/* Clears the recording and its error, and keeps the memory for the next one. */
void ad_tape_reset(ad_tape *tape);
void ad_tape_free(ad_tape *tape); /* takes NULL; its programs stay valid */
/* The first error of the recording (status AD_OK if none). Lives as long as the tape. For NULL the
   error is that memory was exhausted. */
const struct ad_error *ad_tape_error(const ad_tape *tape);
/* Records an error in the tape, as operations do: for callbacks that cannot record their value.
   Returns a handle that later operations pass on. */
ad_var ad_refuse(ad_tape *tape, enum ad_status status, const char *format, ...)
#if defined(__GNUC__)
    __attribute__((format(printf, 3, 4)))
#endif
    ;
/* Whether two tapes hold the same recording: operations, shapes and constants. */
bool ad_tape_same(const ad_tape *a, const ad_tape *b);
/* Number of values recorded so far. */
size_t ad_tape_size(const ad_tape *tape);
/* Bytes held by the tape (nodes, constants, labels, index lists, memory of direct evaluation). */
size_t ad_tape_bytes(const ad_tape *tape);

/* Shape of a value; 0 x 0 for a handle without a tape or of an earlier recording. */
size_t ad_rows(ad_var x);
size_t ad_cols(ad_var x);

/* Records an input: a value set before each run, zero until set. The label (may be NULL) is copied.
 */
ad_var ad_input(ad_tape *tape, size_t rows, size_t cols, const char *label);
/* Marks an input as held: ad_rerun skips what depends on held inputs alone. Returns it. */
ad_var ad_hold(ad_var input);
/* A constant matrix: values [rows*cols], row-major, copied. */
ad_var ad_const(ad_tape *tape, size_t rows, size_t cols, const double *values);
/* A constant scalar. */
ad_var ad_scalar(ad_tape *tape, double value);
/* The value [1] of a constant scalar; false, and *value stays, for anything else. */
bool ad_constant_value(ad_var x, double *value);
/* Names a value in error messages; returns it. The label is copied. */
ad_var ad_label(ad_var x, const char *label);

AD_HEADER_END
#endif
