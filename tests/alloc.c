/* Failing allocations (alloc.h). */
#include "alloc.h"
#include "autodiff/internal.h"

#include <malloc.h>

struct alloc alloc;

void *__real_malloc(size_t size);
void *__real_calloc(size_t n, size_t size);
void *__real_realloc(void *old, size_t size);
void *__real_aligned_alloc(size_t alignment, size_t size);
char *__real_strdup(const char *text);
char *__real_strndup(const char *text, size_t most);
void __real_free(void *block);
void *__wrap_malloc(size_t size);
void *__wrap_calloc(size_t n, size_t size);
void *__wrap_realloc(void *old, size_t size);
void *__wrap_aligned_alloc(size_t alignment, size_t size);
char *__wrap_strdup(const char *text);
char *__wrap_strndup(const char *text, size_t most);
void __wrap_free(void *block);

static bool fails(void)
{
    alloc.calls++;
    return alloc.failing &&
           (alloc.calls == alloc.failing || (alloc.all_after && alloc.calls > alloc.failing));
}

/* What is freed has no trace of the number, so that no place is counted twice. */
static void look_for_marked(double *number, size_t n)
{
    for (size_t k = 0; k < n; k++)
        if (number[k] == alloc.marked) {
            alloc.places++;
            number[k] = 0;
        }
}

static void hold(long bytes)
{
    alloc.held += bytes;
    if (alloc.held > alloc.most)
        alloc.most = alloc.held;
}

static void *count(void *block)
{
    alloc.given += block != NULL;
    hold((long)malloc_usable_size(block));
    return block;
}

void *__wrap_malloc(size_t size) { return fails() ? NULL : count(__real_malloc(size)); }

void *__wrap_calloc(size_t n, size_t size)
{
    return fails() ? NULL : count(__real_calloc(n, size));
}

void *__wrap_realloc(void *old, size_t size)
{
    if (fails())
        return NULL;
    long before = (long)malloc_usable_size(old);
    void *block = __real_realloc(old, size);
    alloc.given += !old && block;
    if (block)
        hold((long)malloc_usable_size(block) - before);
    return block;
}

void *__wrap_aligned_alloc(size_t alignment, size_t size)
{
    return fails() ? NULL : count(__real_aligned_alloc(alignment, size));
}

char *__wrap_strdup(const char *text) { return fails() ? NULL : count(__real_strdup(text)); }

char *__wrap_strndup(const char *text, size_t most)
{
    return fails() ? NULL : count(__real_strndup(text, most));
}

void __wrap_free(void *block)
{
    alloc.taken += block != NULL;
    hold(-(long)malloc_usable_size(block));
    if (alloc.marked != 0)
        look_for_marked(block, malloc_usable_size(block) / sizeof(double));
    __real_free(block);
}

/* From then on each tape that is freed gives back an earlier one. */
__attribute__((constructor)) static void fill_freed_tapes(void)
{
    for (int k = 0; k < AD_FREED_TAPES; k++)
        ad_tape_free(ad_tape_new(AD_F64));
    alloc = (struct alloc){0};
}
