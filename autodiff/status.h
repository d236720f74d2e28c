/* Status, error and the check of arguments of all libraries. Threads: an error belongs to one. */
#ifndef AUTODIFF_STATUS_H
#define AUTODIFF_STATUS_H

#include "version.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

/* Around the declarations of every header. */
#ifdef __cplusplus
#define AD_HEADER_BEGIN                                                                            \
    extern "C" {                                                                                   \
    _Pragma("GCC diagnostic push") /* C has a struct and a function of one name */                 \
        _Pragma("GCC diagnostic ignored \"-Wshadow\"")
#define AD_HEADER_END                                                                              \
    _Pragma("GCC diagnostic pop")                                                                  \
    }
#else
#define AD_HEADER_BEGIN
#define AD_HEADER_END
#endif

AD_HEADER_BEGIN

enum ad_status {
    AD_OK = 0,
    AD_E_MEMORY = -1,    /* an allocation failed */
    AD_E_SHAPE = -2,     /* shapes do not fit the operation */
    AD_E_TAPE = -3,      /* variables of two tapes, or a variable unknown to the program */
    AD_E_ARGUMENT = -4,  /* an argument outside its range */
    AD_E_NONFINITE = -5, /* a value is infinite or not a number */
    AD_E_INPUT = -6,     /* unusable data from outside; the message names file and line */
    AD_E_IO = -7,        /* a file could not be read or written */
    AD_E_ACCURACY = -8   /* the accuracy asked for is out of reach, or the run was interrupted */
};

/* An error, its message of one line; all zero: no error. An argument `error` is never NULL. In
   every header: a function that is handed an error already there does nothing, but for clearing the
   result that it would make, and returns that status (NULL, NaN, 0 or false where it returns no
   status). So calls can follow each other, and the error be looked at once. */
struct ad_error {
    enum ad_status status;
    char message[312];
};

/* Keeps the first error: does nothing when `e` already holds one. Returns e->status. */
enum ad_status ad_fail(struct ad_error *e, enum ad_status status, const char *format, ...)
#if defined(__GNUC__)
    __attribute__((format(printf, 3, 4)))
#endif
    ;

/* True if *error holds one already; or, with AD_E_ARGUMENT in it, if one of the arguments, up to 8,
   is NULL; the message names it and the function. Each is looked at only if those before it are not
   NULL, so that (m, m->ode) is safe. */
#define AD_LACKS(error, ...)                                                                       \
    ((error)->status != AD_OK ||                                                                   \
     AD_LACKS_OF(__VA_ARGS__, AD_LACKS_8, AD_LACKS_7, AD_LACKS_6, AD_LACKS_5, AD_LACKS_4,          \
                 AD_LACKS_3, AD_LACKS_2, AD_LACKS_1, )(error, __VA_ARGS__))
#define AD_LACKS_OF(a, b, c, d, e, f, g, h, choice, ...) choice
#define AD_LACKS_1(e, a) (!(a) && ad_lacks(__func__, #a, e))
#define AD_LACKS_2(e, a, ...) (AD_LACKS_1(e, a) || AD_LACKS_1(e, __VA_ARGS__))
#define AD_LACKS_3(e, a, ...) (AD_LACKS_1(e, a) || AD_LACKS_2(e, __VA_ARGS__))
#define AD_LACKS_4(e, a, ...) (AD_LACKS_1(e, a) || AD_LACKS_3(e, __VA_ARGS__))
#define AD_LACKS_5(e, a, ...) (AD_LACKS_1(e, a) || AD_LACKS_4(e, __VA_ARGS__))
#define AD_LACKS_6(e, a, ...) (AD_LACKS_1(e, a) || AD_LACKS_5(e, __VA_ARGS__))
#define AD_LACKS_7(e, a, ...) (AD_LACKS_1(e, a) || AD_LACKS_6(e, __VA_ARGS__))
#define AD_LACKS_8(e, a, ...) (AD_LACKS_1(e, a) || AD_LACKS_7(e, __VA_ARGS__))
bool ad_lacks(const char *function, const char *argument, struct ad_error *error); /* true */
/* The same for a result, of which *out is set to zero if it is there, whatever *error holds. */
#define AD_LACKS_RESULT(error, out)                                                                \
    (AD_LACKS_1(error, out) || (memset(out, 0, sizeof *(out)), (error)->status != AD_OK))

AD_HEADER_END
#endif
