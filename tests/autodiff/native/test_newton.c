/* What machine code and the kernels for AVX-512 compute otherwise than C does, against libm in 80
   bits: reciprocals and square roots by Newton's method, sine and cosine together. Errors in ulp,
   special values as C gives them, on each instruction set. By hand: test_newton 10000000. */
#include "autodiff/kernels/kernels.h"
#include "tests/native.h"
#include "tests/autodiff/support.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>

enum { COLUMNS = 4099, MOST = 6 }; /* no whole number of vectors */

static size_t blocks = 8;
static bool native;
static uint64_t seed;

static uint64_t bits(void)
{
    seed += 0x9e3779b97f4a7c15;
    uint64_t z = (seed ^ seed >> 30) * 0xbf58476d1ce4e5b9;
    z = (z ^ z >> 27) * 0x94d049bb133111eb;
    return z ^ z >> 31;
}

static double of_bits(uint64_t b)
{
    double x;
    memcpy(&x, &b, sizeof x);
    return x;
}

/* A number of any exponent in the range, and of either sign. */
static double number(int least, int most)
{
    double fraction = 1 + (double)(bits() >> 12) * 0x1p-52;
    return ldexp(bits() & 1 ? fraction : -fraction,
                 least + (int)(bits() % (uint64_t)(most - least)));
}

static const double special[] = {0,
                                 -0.0,
                                 INFINITY,
                                 -INFINITY,
                                 NAN,
                                 DBL_MIN,
                                 -DBL_MIN,
                                 DBL_TRUE_MIN,
                                 0x1.8p-1060,
                                 DBL_MAX,
                                 0x1p-1023,
                                 -0x1p-1024,
                                 0x1p1022,
                                 0x1.0000000000001p1022,
                                 0x1.fffffffffffffp1021,
                                 0x1p1023,
                                 -0x1.8p1023,
                                 0x1p-900,
                                 0x1.fffffffffffffp-901,
                                 0x1p1000,
                                 1,
                                 0x1.fffffffffffffp-1,
                                 0x1.0000000000001p0,
                                 4,
                                 -4,
                                 1e5,
                                 -1e5,
                                 1e300,
                                 1e-300};

static void any_argument(double x[COLUMNS])
{
    for (size_t k = 0; k < COLUMNS; k++)
        x[k] = k % 16 == 0  ? special[bits() % LENGTH(special)]
               : k % 4 == 0 ? of_bits(bits())
                            : number(-30, 30);
}

/* A vector without a special argument takes another way than one with it. */
static void tame_argument(double x[COLUMNS])
{
    for (size_t k = 0; k < COLUMNS; k++)
        x[k] = fabs(k % 2 ? number(-899, 999) : number(0, 2));
}

static void near_multiples(double x[COLUMNS])
{
    for (size_t k = 0; k < COLUMNS; k++) {
        double n = (double)(bits() % 63661),
               at = (double)((long double)n * 1.57079632679489661923L);
        x[k] = k % 3 ? nextafter(at, bits() & 1 ? 1e9 : -1e9) : at;
        x[k] = bits() & 1 ? x[k] : -x[k];
    }
}

static void below_1e5(double x[COLUMNS])
{
    for (size_t k = 0; k < COLUMNS; k++)
        x[k] = k % 2 ? number(-40, 16) : (double)(int64_t)bits() * 0x1p-63 * 1e5;
}

/* ---- functions ---- */

static long double recip(double x) { return 1 / (long double)x; }
static long double recip0(double x) { return x == 0 ? 0 : 1 / (long double)x; }
static long double root(double x) { return sqrtl(x); }
static bool joint_roots(void) { return native && strcmp(getenv("LEASTACTION_ISA"), "avx512") == 0; }
/* Of the root itself where both are computed together, else of the root as rounded. */
static long double recip_root(double x)
{
    return 1 / (joint_roots() ? sqrtl(x) : (long double)sqrt(x));
}
static long double recip0_root(double x) { return x == 0 ? 0 : recip_root(x); }
static long double sine(double x) { return sinl(x); }
static long double cosine(double x) { return cosl(x); }

static ad_var take_recip(ad_var x) { return ad_recip(x); }
static ad_var take_recip0(ad_var x) { return ad_recip0(x); }
static ad_var take_root(ad_var x) { return ad_sqrt(x); }
static ad_var take_recip_root(ad_var x) { return ad_recip(ad_sqrt(x)); }
static ad_var take_recip0_root(ad_var x) { return ad_recip0(ad_sqrt(x)); }
static ad_var take_sine(ad_var x) { return ad_sin(x); }
static ad_var take_cosine(ad_var x) { return ad_cos(x); }

/* Functions that are computed in one program: what shares its work comes together. */
struct function {
    const char *name;
    ad_var (*take)(ad_var x);
    long double (*right)(double x);
};
static const struct function reciprocal[] = {{"recip", take_recip, recip}};
static const struct function reciprocal0[] = {{"recip0", take_recip0, recip0}};
static const struct function roots[] = {{"sqrt", take_root, root},
                                        {"recip of sqrt", take_recip_root, recip_root}};
static const struct function roots0[] = {{"sqrt", take_root, root},
                                         {"recip0 of sqrt", take_recip0_root, recip0_root}};
static const struct function circle[] = {{"sin", take_sine, sine}, {"cos", take_cosine, cosine}};

/* The error in units of the last place of the right value; infinite where one is special and the
   other is not that. */
static double error_of(double y, long double right)
{
    double rounded = (double)right;
    if (isnan(rounded) || isnan(y))
        return isnan(rounded) && isnan(y) ? 0 : INFINITY;
    if (isinf(rounded) || rounded == 0)
        return y == rounded && signbit(y) == signbit(rounded) ? 0 : INFINITY;
    int exponent;
    frexp(rounded, &exponent);
    double unit =
        ldexp(1, exponent < DBL_MIN_EXP ? DBL_MIN_EXP - DBL_MANT_DIG : exponent - DBL_MANT_DIG);
    return (double)(fabsl((long double)y - right) / unit);
}

static void measure(size_t n, const struct function f[], void (*arguments)(double *), double bound)
{
    double x[COLUMNS], y[COLUMNS], worst[MOST] = {0};
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var in = ad_input(tape, 1, COLUMNS, "x"), out[MOST];
    ad_program *program;
    for (size_t i = 0; i < n; i++)
        out[i] = f[i].take(in);
    assert_int_equal(ad_compile(tape, n, out, &program), AD_OK);
    if (native)
        native_make(program);
    for (size_t b = 0; b < blocks; b++) {
        arguments(x);
        assert_int_equal(ad_set(program, in, x), AD_OK);
        ad_run(program);
        for (size_t i = 0; i < n; i++) {
            assert_int_equal(ad_get(program, out[i], y), AD_OK);
            for (size_t k = 0; k < COLUMNS; k++) {
                double error = error_of(y[k], f[i].right(x[k]));
                if (!(error < bound))
                    fail_msg("%s: %s(%a) = %a, %.3g ulp off", getenv("LEASTACTION_ISA"), f[i].name,
                             x[k], y[k], error);
                worst[i] = fmax(worst[i], error);
            }
        }
    }
    for (size_t i = 0; i < n && blocks > 1000; i++)
        print_message("%s%s: %s: %.4f ulp\n", getenv("LEASTACTION_ISA"),
                      native ? ", machine code" : "", f[i].name, worst[i]);
    ad_program_free(program);
    ad_tape_free(tape);
}

/* A special argument changes no bit of the values beside it, or these would depend on where vectors
   begin, which threads decide. */
static void compare_neighbours(size_t n, const struct function f[], void (*arguments)(double *))
{
    double x[COLUMNS], alone[MOST][COLUMNS], beside[COLUMNS];
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var in = ad_input(tape, 1, COLUMNS, "x"), out[MOST];
    ad_program *program;
    for (size_t i = 0; i < n; i++)
        out[i] = f[i].take(in);
    assert_int_equal(ad_compile(tape, n, out, &program), AD_OK);
    if (native)
        native_make(program);
    arguments(x);
    assert_int_equal(ad_set(program, in, x), AD_OK);
    ad_run(program);
    for (size_t i = 0; i < n; i++)
        assert_int_equal(ad_get(program, out[i], alone[i]), AD_OK);
    for (size_t k = 0; k < COLUMNS; k += 5)
        x[k] = special[k % LENGTH(special)];
    assert_int_equal(ad_set(program, in, x), AD_OK);
    ad_run(program);
    for (size_t i = 0; i < n; i++) {
        assert_int_equal(ad_get(program, out[i], beside), AD_OK);
        for (size_t k = 0; k < COLUMNS; k++)
            if (k % 5 && beside[k] != alone[i][k])
                fail_msg("%s: %s(%a) = %a beside a special argument, else %a",
                         getenv("LEASTACTION_ISA"), f[i].name, x[k], beside[k], alone[i][k]);
    }
    ad_program_free(program);
    ad_tape_free(tape);
}

static void all_functions(void)
{
    /* libmvec's */
    bool joint = native || strcmp(ad_kernels_for(AD_F64)->isa, "avx512") == 0;
    double near = joint ? 1 : 4;
    measure(1, reciprocal, any_argument, 1);
    measure(1, reciprocal, tame_argument, 1);
    measure(1, reciprocal0, any_argument, 1);
    measure(1, reciprocal0, tame_argument, 1);
    measure(2, roots, any_argument, 1);
    measure(2, roots, tame_argument, 1);
    measure(2, roots0, any_argument, 1);
    measure(2, roots0, tame_argument, 1);
    measure(2, circle, below_1e5, near);
    measure(2, circle, near_multiples, near);
    measure(2, circle, any_argument, 4); /* libmvec's, beyond 1e5 */
    measure(1, circle, below_1e5, 4);
    measure(1, circle + 1, any_argument, 4);
    compare_neighbours(1, reciprocal, tame_argument);
    compare_neighbours(1, reciprocal0, tame_argument);
    compare_neighbours(2, roots, tame_argument);
    compare_neighbours(2, roots0, tame_argument);
    compare_neighbours(2, circle, below_1e5);
}

static void all_on_this_isa(void)
{
    native = false;
    all_functions();
    native = true;
    all_functions();
}

static void test_errors(void **state)
{
    (void)state;
    native_need_compiler();
    for_each_isa(all_on_this_isa);
}

int main(int argc, char **argv)
{
    if (argc > 1)
        blocks = strtoul(argv[1], NULL, 10) / COLUMNS;
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_errors)};
    return cmocka_run_group_tests(tests, native_share_cache, native_remove_cache);
}
