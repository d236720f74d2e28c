/* Runs the command in a child process whose file system calls fail on request: a full disk or a
   lost device at any moment of a run. */
#ifndef TESTS_APPS_INJECT_H
#define TESTS_APPS_INJECT_H

#include <stdbool.h>
#include <stddef.h>

enum { INJECT_WORDS = 40 };

/* Words of a command line of which spaces are the only punctuation, after "leastaction". */
struct words {
    int n;
    char *word[INJECT_WORDS + 1], text[1024];
};
void inject_words(struct words *words, const char *line);

/* From one fault that is tried to the next, of `all` in a run: 3 are tried, or FAULTS of the
   environment. The first: others by each build, which FUZZ_SHARE, 0 to 2, numbers. */
size_t inject_step(size_t all);
size_t inject_first(size_t step);

/* Which calls fail. Counted are those that open for writing, write, sync, truncate, rename, and
   close what was open for writing, in the work folder, in the child and its children. */
struct inject {
    size_t first;     /* the first that fails, from 1; 0: none */
    bool and_after;   /* ... and every one after it that needs space: a disk that stays full, as it
                         does where a program that the command started is the first to find it so */
    size_t calls;     /* out: how many there were */
    const char *what; /* out: the call that failed first, "write" */
};

/* Exit status of the command line, or 128 + the signal; -1 where the kernel cannot inject. */
int inject_run(const struct words *words, struct inject *inject);

/* The same as whoever runs the tests or, were that root, who may write anywhere, as nobody. */
int inject_without_rights(const struct words *words);

#endif
