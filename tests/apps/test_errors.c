/* Runs every command of docs/errors.md, the catalogue of messages; each must print exactly the
   message given there, with the exit status of its section. H5: `path brachistochrone --all` is
   among them. */
#include "tests/close.h"
#include "shell.h"
#include "apps/command.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char document[] = "docs/errors.md", prompt[] = "$ ", name[] = "leastaction";

enum block { TEXT, FILES, CONSOLE };

/* One command line of the document, and what it says there. */
struct entry {
    char command[512], says[1024];
    int status;
};

static struct entry entries[512];
static size_t n_entries;
static char files[4096]; /* commands that make the files which the entries name */

static enum block block_after(enum block block, const char *line)
{
    if (strncmp(line, "```", 3) != 0)
        return block;
    return block != TEXT                        ? TEXT
           : strcmp(line, "```console\n") == 0  ? CONSOLE
           : strcmp(line, "```sh files\n") == 0 ? FILES
                                                : TEXT;
}

static void append(char *text, size_t size, const char *line)
{
    size_t used = strlen(text);
    assert_true(used + strlen(line) < size);
    strcpy(text + used, line);
}

static void keep(const char *line, int status)
{
    if (strncmp(line, prompt, strlen(prompt)) == 0) {
        assert_true(n_entries < sizeof entries / sizeof *entries);
        struct entry *e = &entries[n_entries++];
        snprintf(e->command, sizeof e->command, "%.*s", (int)strcspn(line + 2, "\n"), line + 2);
        e->status = status;
    } else {
        assert_true(n_entries > 0);
        append(entries[n_entries - 1].says, sizeof entries->says, line);
    }
}

static int read_document(void **state)
{
    FILE *in = fopen(document, "r");
    static char line[1024];
    enum block block = TEXT;
    int status = WRONG_USE;
    if (!in || shell_setup(state) != 0)
        return -1;
    while (fgets(line, sizeof line, in)) {
        enum block before = block;
        block = block_after(block, line);
        if (strncmp(line, "## ", 3) == 0 && strstr(line, "exit status 1"))
            status = NOT_REACHED;
        if (block == FILES && before == FILES)
            append(files, sizeof files, line);
        if (block == CONSOLE && before == CONSOLE)
            keep(line, status);
    }
    return fclose(in);
}

static bool right(const struct entry *e)
{
    size_t start = strlen(name);
    bool plain = strncmp(e->command, name, start) == 0 && e->command[start] == ' ';
    int status = plain ? shell("$LA %s", e->command + start + 1)
                       : shell("leastaction() { \"$LA\" \"$@\"; }; %s", e->command);
    if (status == e->status && strcmp(shell_err(), e->says) == 0)
        return true;
    print_error("%s: %s\n  expected exit %d, %s  got exit %d, %s", document, e->command, e->status,
                e->says, status, shell_err());
    return false;
}

static void test_every_message(void **state)
{
    (void)state;
    size_t wrong = 0;
    shell_clean();
    assert_int_equal(shell("leastaction() { \"$LA\" \"$@\"; }; %s:", files), 0);
    size_t before = shell_files();
    for (size_t k = 0; k < n_entries; k++) {
        wrong += !right(&entries[k]);
        if (entries[k].status == WRONG_USE) {
            assert_string_equal(shell_out(), "");
            assert_int_equal(shell_files(), before);
        }
    }
    assert_int_equal(wrong, 0);
    assert_true(n_entries >= 300);
}

static void test_every_subcommand_is_there(void **state)
{
    (void)state;
    for (size_t c = 0; commands[c]; c++) {
        char start[64];
        int n = snprintf(start, sizeof start, "%s %s ", name, commands[c]->line.name);
        size_t k = 0;
        while (k < n_entries && strncmp(entries[k].command, start, (size_t)n) != 0)
            k++;
        if (k == n_entries)
            fail_msg("%s has no wrong use of %s", document, commands[c]->line.name);
    }
}

/* One line that begins with the subcommand, and holds more than what is wrong. */
static void test_form(void **state)
{
    (void)state;
    for (size_t k = 0; k < n_entries; k++) {
        const char *newline = strchr(entries[k].says, '\n');
        assert_int_equal(strncmp(entries[k].says, name, strlen(name)), 0);
        assert_true(newline && newline[1] == '\0');
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_message),
        cmocka_unit_test(test_every_subcommand_is_there),
        cmocka_unit_test(test_form),
    };
    return cmocka_run_group_tests(tests, read_document, shell_teardown);
}
