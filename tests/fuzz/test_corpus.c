/* Runs every fuzzer on its corpus, regressions included, and on copies with bytes changed, removed
   and inserted, the same for every run. A fuzzer that finds a fault aborts. */
#include "tests/close.h"
#include "tests/files.h"
#include "fuzz.h"

#include <dirent.h>

enum { COPIES = 15, ROOM = 1 << 14 };

/* xorshift64. */
static uint64_t draw(uint64_t *state, uint64_t below)
{
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    return *state % below;
}

/* One change; returns the new size. */
static size_t change(uint64_t *state, uint8_t *bytes, size_t size)
{
    size_t at = size ? draw(state, size) : 0, length = size ? 1 + draw(state, size - at) : 0;
    switch (draw(state, 4)) {
    case 0: /* a bit */
        bytes[at] ^= (uint8_t)(1u << draw(state, 8));
        return size;
    case 1: /* a byte that means something somewhere */
        bytes[at] = (uint8_t) ",=\n \"0-\xff"[draw(state, 8)];
        return size;
    case 2:
        memmove(bytes + at, bytes + at + length, size - at - length);
        return size - length;
    default: /* twice */
        if (size + length > ROOM)
            return size;
        memmove(bytes + at + length, bytes + at, size - at);
        return size + length;
    }
}

static void try_file(int (*fuzz)(const uint8_t *, size_t), const char *name)
{
    static uint8_t bytes[ROOM];
    size_t size = 0, whole;
    uint64_t state = 0x9e3779b97f4a7c15;
    char *text = files_read(name, &whole);
    assert_in_range(whole, 0, ROOM);
    for (int k = 0; k <= COPIES; k++) {
        if (k % 4 <= 1) /* as it is; then changes add up, and start anew */
            memcpy(bytes, text, size = whole);
        if (k > 0)
            size = change(&state, bytes, size);
        fuzz(bytes, size);
    }
    free(text);
}

static void try_all(int (*fuzz)(const uint8_t *, size_t), const char *target)
{
    char name[512];
    size_t n = 0;
    snprintf(name, sizeof name, "tests/fuzz/corpus/%s", target);
    DIR *folder = opendir(name);
    assert_non_null(folder);
    for (struct dirent *entry; (entry = readdir(folder));)
        if (entry->d_name[0] != '.') {
            snprintf(name, sizeof name, "tests/fuzz/corpus/%s/%s", target, entry->d_name);
            try_file(fuzz, name);
            n++;
        }
    closedir(folder);
    assert_true(n > 1);
}

#define TEST(name)                                                                                 \
    static void test_##name(void **state)                                                          \
    {                                                                                              \
        (void)state;                                                                               \
        try_all(fuzz_##name, #name);                                                               \
    }
FUZZERS(TEST)

int main(void)
{
#define ENTRY(name) cmocka_unit_test(test_##name),
    const struct CMUnitTest tests[] = {FUZZERS(ENTRY)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
