/* Assertions for cmocka tests of a Lagrangian or of a program on the tape. A failed check prints
   the report of all, with the worst entry of each, and fails the test at the line of the assertion.
   One that passes prints it where L has a kink, or an L_vv that is not positive definite.

       assert_lagrangian(&scene);           phys_check_all along the scene's own motion
       assert_lagrangian_at(&scene, &points);   ... at the caller's points
       assert_gradient(y, n, x, at);        ad_check_all of the scalar y at x[k] = at[k]

   Installed as leastaction/cmocka.h. */
#ifndef PHYSICS_CMOCKA_H
#define PHYSICS_CMOCKA_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "autodiff/autodiff.h"
#include "physics/motion/checks.h"

/* Arguments may be compound literals, whose commas a macro of fixed arguments would count. */
#define assert_lagrangian(...) phys_assert_lagrangian(__FILE__, __LINE__, __VA_ARGS__, NULL)
#define assert_lagrangian_at(...) phys_assert_lagrangian(__FILE__, __LINE__, __VA_ARGS__)
#define assert_gradient(...) ad_assert_gradient(__FILE__, __LINE__, __VA_ARGS__)

enum { AD_CHECKS_TEXT = 4096 };

static inline void phys_assert_lagrangian(const char *file, int line,
                                          const struct phys_scene *scene,
                                          const struct phys_points *points)
{
    char text[AD_CHECKS_TEXT] = "";
    struct phys_system system;
    struct phys_checks checks;
    struct ad_error error = {AD_OK, ""};
    bool passed = phys_system_make(scene, &system, &error) == AD_OK &&
                  phys_check_all(&system, points, 0, &checks, &error) == AD_OK && checks.passed;
    bool remark = passed && (checks.kink || checks.negative_most);
    if (error.status == AD_OK && (!passed || remark))
        phys_checks_text(&system, &checks, text, sizeof text);
    phys_system_close(&system);
    if (remark)
        print_message("%s", text);
    if (passed)
        return;
    print_error("%s%s\n", text, error.message);
    _fail(file, line);
}

static inline void ad_assert_gradient(const char *file, int line, ad_var y, size_t n,
                                      const ad_var x[], const double *const at[])
{
    char text[AD_CHECKS_TEXT] = "";
    struct ad_checks checks;
    enum ad_status status = ad_check_all(y, n, x, at, 0, &checks);
    if (status == AD_OK && checks.passed)
        return;
    if (status == AD_OK)
        ad_checks_text(&checks, n, x, text, sizeof text);
    print_error("%s%s\n", text, status == AD_OK ? "" : ad_tape_error(y.tape)->message);
    _fail(file, line);
}

#endif
