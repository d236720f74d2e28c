/* Helpers for tests of machine code (native.h). */
#include "native.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>

struct path native_cache;

int native_open_cache(void **state)
{
    if (files_setup(state) != 0)
        return -1;
    native_cache = files_temporary("cache");
    return setenv("XDG_CACHE_HOME", native_cache.text, 1);
}

void native_quick_compiler(void)
{
    const char *cc = getenv("CC");
    struct path name = files_temporary("quick-cc");
    FILE *script = fopen(name.text, "w");
    assert_non_null(script);
    fprintf(script, "#!/bin/sh\nexec %s \"$@\" -O0\n", cc && *cc ? cc : "cc");
    fclose(script);
    assert_int_equal(chmod(name.text, 0700), 0);
    setenv("CC", name.text, 1);
}

int native_open_quick(void **state)
{
    if (native_open_cache(state) != 0)
        return -1;
    native_quick_compiler();
    return 0;
}

int native_share_cache(void **state)
{
    return getenv("TEST_CACHE") ? files_setup(state) : native_open_cache(state);
}

int native_remove_cache(void **state) { return files_teardown(state); }

void native_need_compiler(void)
{
    if (system("${CC:-cc} --version >/dev/null 2>&1") == 0)
        return;
    print_message("no C compiler (CC, or cc): programs stay interpreted\n");
    skip();
}

void native_make(ad_program *program)
{
    struct ad_error note = {0};
    if (!ad_native(program, INFINITY, &note))
        fail_msg("not compiled: %s", note.message);
}

static bool same(double a, double b, double difference)
{
    return fabs(a - b) <= difference || a == b || (isnan(a) && isnan(b));
}

void assert_same_values(const ad_program *interpreted, const ad_program *compiled, ad_var x,
                        double tolerance, const char *name)
{
    size_t size = ad_rows(x) * ad_cols(x);
    double *a = malloc(2 * size * sizeof *a), *b = a + size, largest = 0;
    assert_non_null(a);
    assert_int_equal(ad_get(interpreted, x, a), AD_OK);
    assert_int_equal(ad_get(compiled, x, b), AD_OK);
    for (size_t i = 0; i < size; i++)
        largest = isfinite(a[i]) ? fmax(largest, fabs(a[i])) : largest;
    for (size_t i = 0; i < size; i++)
        if (!same(a[i], b[i], tolerance * largest))
            fail_msg("%s: element %zu of %zu x %zu: interpreted %.17g, compiled %.17g", name, i,
                     ad_rows(x), ad_cols(x), a[i], b[i]);
    free(a);
}
