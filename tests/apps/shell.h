/* Runs the command under test as a user would: by a shell, in an empty folder. */
#ifndef TESTS_APPS_SHELL_H
#define TESTS_APPS_SHELL_H

#include <stddef.h>

/* Makes a folder with an empty subfolder `work`, where commands run, and finds the command:
   LEASTACTION, else in the folder LEASTACTION_BUILD, else build/. For cmocka's group setup and
   teardown. */
int shell_setup(void **state);
int shell_teardown(void **state);

/* Empties the work folder; for cmocka's setup of a test. */
int shell_empty(void **state);

/* Runs a shell command line, in which $LA is the command and $ROOT the repository; returns the exit
   status, or 128 + the signal. A line of nothing but $LA and its words runs command_main in a child
   of this process. */
int shell(const char *format, ...)
#if defined(__GNUC__)
    __attribute__((format(printf, 1, 2)))
#endif
    ;
/* The same; fails the test, and prints what it said, unless the status is 0. */
void shell_works(const char *format, ...)
#if defined(__GNUC__)
    __attribute__((format(printf, 1, 2)))
#endif
    ;
/* What the last one printed. */
const char *shell_out(void);
const char *shell_err(void);
/* Reads both again, where a process other than a shell's wrote ../out and ../err. */
void shell_read(void);
/* The last line of its standard output, without the newline. */
const char *shell_last_line(void);
/* The number of a key in the JSON on it, of an object in that; NaN for null. Fails the test where
   there is none. */
double shell_number(const char *key);
double shell_number_in(const char *object, const char *key);
/* Entries of the work folder, hidden ones too. */
size_t shell_files(void);
/* For a child of the test that is to run command_main: in the work folder, output where shell_read
   finds it, signals as they were before cmocka. */
void shell_enter(void);
/* Empties the work folder. */
void shell_clean(void);
/* Path of a file in the work folder (valid until the next call). */
const char *shell_path(const char *name);

/* Shell commands that interrupt the process $pid once it has computed for a fifth of a second of
   its own time, however long that takes, and return its status. */
#define SHELL_INTERRUPT                                                                            \
    "until read -r stat </proc/$pid/stat && set -- $stat && [ ${14} -ge 20 ]; do :; done; "        \
    "kill -INT $pid; wait $pid"

#if defined(__has_feature)
#if __has_feature(address_sanitizer)
#define SANITIZED true
#endif
#endif
#ifndef SANITIZED
#define SANITIZED false
#endif

#endif
