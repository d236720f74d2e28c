/* Results do not depend on the number of threads, to the last bit: elementwise, sums, pair laws,
   matmul, and gradients of them, large enough to be split. */
#define _DEFAULT_SOURCE /* syscall */
#include "support.h"
#include "autodiff/exec/pool.h"
#include "tests/mentions.h"

#include <cblas.h>
#include <dirent.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

enum { MAX_OUT = 8 };

/* A value, its parts worth comparing, and the inputs, all recorded for one job. */
struct job {
    ad_tape *tape;
    size_t n_in, n_out;
    ad_var in[2], out[MAX_OUT];
};

static void add_gradient(struct job *j, ad_var y)
{
    ad_var g[2];
    assert_int_equal(ad_grad(y, j->n_in, j->in, g), AD_OK);
    for (size_t k = 0; k < j->n_in; k++)
        j->out[j->n_out++] = g[k];
}

static void elementwise(struct job *j)
{
    ad_var x = j->in[0] = ad_input(j->tape, 3, 100003, NULL);
    ad_var w = j->in[1] = ad_input(j->tape, 1, 100003, NULL);
    j->n_in = 2;
    ad_var y = ad_mul(ad_sin(ad_mul(x, w)), ad_exp(ad_neg(ad_square(x))));
    j->out[j->n_out++] = y;
    add_gradient(j, ad_sum(y));
}

static void sums(struct job *j)
{
    ad_var x = j->in[0] = ad_input(j->tape, 37, 20011, NULL);
    j->n_in = 1;
    ad_var y = ad_tanh(x);
    j->out[j->n_out++] = ad_sum(y);
    j->out[j->n_out++] = ad_mean(x);
    j->out[j->n_out++] = ad_sum_rows(y);
    j->out[j->n_out++] = ad_sum_cols(y);
    j->out[j->n_out++] = ad_sum_cols(ad_row(x, 5));
    j->out[j->n_out++] = ad_dot(x, ad_row(y, 1));
    add_gradient(j, ad_dot(ad_sum_cols(y), ad_sin(ad_sum_cols(x))));
}

static void pair_law(struct job *j)
{
    enum { BODIES = 40, PAIRS = BODIES * (BODIES - 1) / 2 };
    uint32_t first[PAIRS], second[PAIRS];
    size_t n = 0;
    for (uint32_t i = 0; i < BODIES; i++)
        for (uint32_t k = i + 1; k < BODIES; k++) {
            first[n] = i;
            second[n++] = k;
        }
    ad_var x = j->in[0] = ad_input(j->tape, BODIES, 301, NULL);
    j->n_in = 1;
    ad_var d = ad_sub(ad_gather_rows(x, PAIRS, first), ad_gather_rows(x, PAIRS, second));
    ad_var law = ad_recip(ad_add(ad_square(d), 0.1));
    j->out[j->n_out++] = ad_sum_rows(law);
    j->out[j->n_out++] = ad_scatter_rows(ad_mul(law, d), second, BODIES);
    add_gradient(j, ad_sum(law));
}

static void matmul(struct job *j)
{
    ad_var a = j->in[0] = ad_input(j->tape, 211, 307, NULL);
    ad_var b = j->in[1] = ad_input(j->tape, 307, 503, NULL);
    j->n_in = 2;
    ad_var y = ad_tanh(ad_mul(0.1, ad_matmul(a, false, b, false)));
    j->out[j->n_out++] = y;
    j->out[j->n_out++] = ad_transpose(y);
    add_gradient(j, ad_sum(ad_square(y)));
}

static void time_differences(struct job *j)
{
    ad_var x = j->in[0] = ad_input(j->tape, 6, 50021, NULL);
    j->n_in = 1;
    ad_var v = ad_diff(x, 4, true);
    j->out[j->n_out++] = v;
    j->out[j->n_out++] = ad_concat_cols(2, (ad_var[]){ad_slice_cols(v, 100, 40000), ad_sin(x)});
    add_gradient(j, ad_mul(0.5, ad_sum(ad_square(v))));
}

/* All outputs, one after another. */
static char *run(ad_program *p, const struct job *j, size_t threads, size_t *bytes)
{
    size_t element = 8, size = 0;
    for (size_t k = 0; k < j->n_out; k++)
        size += ad_rows(j->out[k]) * ad_cols(j->out[k]) * element;
    char *result = malloc(size);
    assert_non_null(result);
    ad_set_threads(p, threads);
    ad_run(p);
    *bytes = 0;
    for (size_t k = 0; k < j->n_out; k++) {
        assert_int_equal(ad_get(p, j->out[k], (double *)(void *)(result + *bytes)), AD_OK);
        *bytes += ad_rows(j->out[k]) * ad_cols(j->out[k]) * element;
    }
    return result;
}

static void assert_bitwise(void (*record)(struct job *), enum ad_type type)
{
    struct job j = {.tape = ad_tape_new(type)};
    record(&j);
    uint64_t state = 3;
    ad_program *p = compile(j.tape, j.n_out, j.out);
    for (size_t k = 0; k < j.n_in; k++) {
        double *v = random_values(&state, ad_rows(j.in[k]) * ad_cols(j.in[k]), -1, 1);
        assert_int_equal(ad_set(p, j.in[k], v), AD_OK);
        free(v);
    }
    size_t bytes;
    char *one = run(p, &j, 1, &bytes);
    const double *first = (const double *)(const void *)one;
    assert_true(isfinite(first[0]) && first[0] != 0);
    static const size_t threads[] = {2, 3, 4, 7, 1};
    for (size_t k = 0; k < sizeof threads / sizeof threads[0]; k++) {
        char *many = run(p, &j, threads[k], &bytes);
        if (memcmp(one, many, bytes) != 0)
            fail_msg("%zu threads give other bits than one", threads[k]);
        free(many);
    }
    free(one);
    ad_program_free(p);
    ad_tape_free(j.tape);
}

static void both(void (*record)(struct job *))
{
    assert_bitwise(record, AD_F64);
    assert_bitwise(record, AD_F32);
}

static void test_elementwise(void **state)
{
    (void)state;
    both(elementwise);
}

static void test_sums(void **state)
{
    (void)state;
    both(sums);
}

static void test_pair_law(void **state)
{
    (void)state;
    both(pair_law);
}

static void test_matmul(void **state)
{
    (void)state;
    both(matmul);
}

static void test_time_differences(void **state)
{
    (void)state;
    both(time_differences);
}

/* The report of the check mode does not depend on them either. */
static void test_check_mode(void **state)
{
    (void)state;
    enum { N = 200000 };
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 1, N, NULL), y = ad_sum(ad_log(ad_label(ad_sqrt(x), "root")));
    double *v = malloc(N * sizeof *v);
    assert_non_null(v);
    for (size_t i = 0; i < N; i++)
        v[i] = i % 50000 == 49999 ? -1 : 1;
    ad_program *p = compile(t, 1, &y);
    ad_set(p, x, v);
    struct ad_error first = {0};
    assert_int_equal(ad_run_checked(p, &first), AD_E_NONFINITE);
    assert_mentions(first.message, "column 49999");
    for (size_t threads = 2; threads < 5; threads++) {
        struct ad_error e = {0};
        ad_set_threads(p, threads);
        assert_int_equal(ad_run_checked(p, &e), AD_E_NONFINITE);
        assert_string_equal(e.message, first.message);
    }
    free(v);
    ad_program_free(p);
    ad_tape_free(t);
}

/* The child of a process that has computed by threads has none of them, and computes the same. */
static void test_after_fork(void **state)
{
    (void)state;
    enum { N = 400000, THREADS = 4 };
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 1, N, NULL), y = ad_sum(ad_sin(ad_exp(x)));
    ad_program *p = compile(t, 1, &y);
    double *v = malloc(N * sizeof *v), before, after;
    assert_non_null(v);
    for (size_t i = 0; i < N; i++)
        v[i] = (double)(i % 1000) / 1000;
    ad_set(p, x, v);
    ad_set_threads(p, THREADS);
    for (int k = 0; k < 20; k++)
        ad_run(p);
    ad_get(p, y, &before);
    pid_t child = fork();
    if (child == 0) {
        for (int k = 0; k < 20; k++)
            ad_run(p);
        ad_get(p, y, &after);
        _exit(after == before ? 0 : 1);
    }
    int status;
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_int_equal(status, 0);
    ad_run(p);
    ad_get(p, y, &after);
    assert_memory_equal(&after, &before, sizeof after);
    free(v);
    ad_program_free(p);
    ad_tape_free(t);
}

enum { PARTS = 1000 };

static void count_part(void *context, size_t thread, size_t k)
{
    int *times = context;
    (void)thread;
    times[k]++;
}

static void count_again(void *context, size_t thread, size_t k)
{
    int *times = context;
    (void)thread;
    ad_parallel(8, PARTS, count_part, times + k * PARTS);
}

/* Also where a part is a job itself. */
static void test_each_part_once(void **state)
{
    (void)state;
    enum { OUTER = 50 };
    static int times[OUTER * PARTS];
    for (int job = 1; job <= 20; job++) {
        ad_parallel((size_t)job, OUTER, count_again, times);
        for (size_t k = 0; k < OUTER * PARTS; k++)
            assert_int_equal(times[k], job);
    }
}

/* All threads but this one are asleep, by /proc; true where that cannot be read. */
static bool others_sleep(void)
{
    DIR *tasks = opendir("/proc/self/task");
    bool asleep = true;
    for (struct dirent *task; tasks && (task = readdir(tasks));) {
        char name[300], state;
        snprintf(name, sizeof name, "/proc/self/task/%s/stat", task->d_name);
        const int thread = atoi(task->d_name); /* 0 for . and .. */
        FILE *in = thread == 0 || thread == (int)syscall(SYS_gettid) ? NULL : fopen(name, "r");
        if (in && fscanf(in, "%*d (%*[^)]) %c", &state) == 1)
            asleep = asleep && state != 'R';
        if (in)
            fclose(in);
    }
    if (tasks)
        closedir(tasks);
    return asleep;
}

/* One part is all of the work, and lasts until the other threads sleep. */
static void wait_for_sleep(void *context, size_t thread, size_t k)
{
    bool *asleep = context;
    (void)thread;
    for (int i = 0; k == 0 && i < 1000000 && !*asleep; i++)
        *asleep = others_sleep();
}

static void test_waiting_is_asleep(void **state)
{
    (void)state;
    for (int try = 0; try < 10; try++) {
        bool asleep = false;
        ad_parallel(2, 2, wait_for_sleep, &asleep);
        assert_true(asleep);
    }
}

/* G10: OpenBLAS has one number of threads for the process; a run leaves the one it found. */
static void test_threads_of_openblas(void **state)
{
    (void)state;
    int before = openblas_get_num_threads();
    ad_tape *t = ad_tape_new(AD_F64);
    ad_var x = ad_input(t, 40, 40, NULL), y = ad_matmul(x, false, x, true);
    ad_program *p = compile(t, 1, &y);
    for (int n = 1; n <= 2; n++) {
        openblas_set_num_threads(n);
        const int found = openblas_get_num_threads(); /* a build may have one only */
        ad_run(p);
        assert_int_equal(openblas_get_num_threads(), found);
    }
    openblas_set_num_threads(before);
    ad_program_free(p);
    ad_tape_free(t);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_threads_of_openblas),
        cmocka_unit_test(test_after_fork),
        cmocka_unit_test(test_each_part_once),
        cmocka_unit_test(test_waiting_is_asleep),
        cmocka_unit_test(test_elementwise),
        cmocka_unit_test(test_sums),
        cmocka_unit_test(test_pair_law),
        cmocka_unit_test(test_matmul),
        cmocka_unit_test(test_check_mode),
        cmocka_unit_test(test_time_differences),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
