/* Manual pages and completion come from the tables of options: every subcommand and option is
   included, and no line of a page looks like a troff request. */
#include "tests/close.h"
#include "apps/command.h"
#include "shell.h"
#include "tests/mentions.h"

#include <stdio.h>
#include <string.h>

/* An option as its page writes it: every dash is one to copy into a shell. */
static void in_troff(const char *name, size_t size, char *to)
{
    size_t n = (size_t)snprintf(to, size, ".TP\n\\fB\\-\\-");
    for (; *name && n + 3 < size; name++) {
        if (*name == '-')
            to[n++] = '\\';
        to[n++] = *name;
    }
    snprintf(to + n, size - n, "\\fR");
}

static void assert_requests(const char *page)
{
    static const char *const known[] = {".TH ", ".SH ", ".TP\n", ".B ",
                                        ".BR ", ".I ",  ".nf\n", ".fi\n"};
    for (const char *line = page; line; line = strchr(line, '\n')) {
        bool right = false;
        line += *line == '\n';
        for (size_t k = 0; k < sizeof known / sizeof *known; k++)
            right |= strncmp(line, known[k], strlen(known[k])) == 0;
        if ((*line == '.' || *line == '\'') && !right)
            fail_msg("not a request: %.40s", line);
        if (*line == '\0')
            return;
    }
}

static void test_pages(void **state)
{
    (void)state;
    assert_int_equal(shell("$LA manual"), 0);
    assert_requests(shell_out());
    for (size_t c = 0; commands[c]; c++) {
        const struct command_line *line = &commands[c]->line;
        assert_int_equal(shell("$LA manual %s", line->name), 0);
        assert_requests(shell_out());
        for (size_t k = 0; k < options_rows(line); k++) {
            char heading[80];
            in_troff(options_row(line, k)->name, sizeof heading, heading);
            if (!strstr(shell_out(), heading))
                fail_msg("the page of %s lacks --%s", line->name, options_row(line, k)->name);
        }
    }
}

static void test_completion(void **state)
{
    (void)state;
    assert_int_equal(shell("$LA completion > completion; bash -c '. ./completion; "
                           "COMP_WORDS=(leastaction path x) COMP_CWORD=2; "
                           "_leastaction leastaction --ene; echo \"${COMPREPLY[*]}\"; "
                           "_leastaction leastaction fig; echo \"${COMPREPLY[*]}\"'"),
                     0);
    assert_string_equal(shell_out(), "--energy --energy-loss --energy-weight\nfigure8\n");
}

static void test_unknown_page(void **state)
{
    (void)state;
    assert_int_equal(shell("$LA manual pth"), 2);
    assert_mentions(shell_err(), "'pth' 'path'");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_pages),
        cmocka_unit_test(test_completion),
        cmocka_unit_test(test_unknown_page),
    };
    return cmocka_run_group_tests(tests, shell_setup, shell_teardown);
}
