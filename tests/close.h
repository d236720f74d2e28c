/* assert_close(a, b, rtol, atol), the comparison of doubles in all tests: |a - b| <= atol + rtol
   |b|, where b is the expected value. NaN is close to nothing, an infinity only to itself. A
   failure prints both values with all digits, and their difference. LENGTH(a) is the number of
   elements of an array. */
#ifndef TESTS_CLOSE_H
#define TESTS_CLOSE_H

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#define LENGTH(a) (sizeof(a) / sizeof(a)[0])

static inline bool is_close(double a, double b, double rtol, double atol)
{
    return a == b || (isfinite(b) && fabs(a - b) <= atol + rtol * fabs(b));
}

static inline void assert_close_at(double a, double b, double rtol, double atol, const char *text,
                                   const char *file, int line)
{
    if (is_close(a, b, rtol, atol))
        return;
    print_error("%s\n  %.17g is not close to\n  %.17g: difference %.3g, relative %.3g; allowed "
                "%.3g + %.3g relative\n",
                text, a, b, fabs(a - b), fabs((a - b) / b), atol, rtol);
    _fail(file, line);
}

#define assert_close(a, b, rtol, atol)                                                             \
    assert_close_at((a), (b), (rtol), (atol), #a " ~ " #b, __FILE__, __LINE__)

#endif
