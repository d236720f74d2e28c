/* The command `leastaction`: finds the subcommand, parses its options, runs it, prints its error.
 */
#include "autodiff/free.h"
#include "autodiff/kernels/kernels.h"
#include "command.h"
#include "quote.h"
#include "apps/ranks/ranks.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void help(void)
{
    puts("leastaction SUBCOMMAND [options]\n\n"
         "Paths of stationary action, from a Lagrangian written once.\n");
    for (size_t k = 0; commands[k]; k++)
        printf("  %-10s %s\n", commands[k]->line.name, commands[k]->line.what);
    puts("\nleastaction SUBCOMMAND --help lists its options; leastaction --version the version.\n"
         "Exit status: 0 done; 1 ran, but did not reach what was asked; 2 wrong use or bad input.");
}

/* Appends a word, quoted for a shell. */
static char *append_word(char *to, const char *word)
{
    static const char plain[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
                                "0123456789_-+=:,./@%";
    bool quote = word[0] == '\0' || word[strspn(word, plain)] != '\0';
    if (quote)
        *to++ = '\'';
    for (; *word; word++)
        if (*word == '\'')
            to = stpcpy(to, "'\\''");
        else
            *to++ = *word;
    if (quote)
        *to++ = '\'';
    *to = '\0';
    return to;
}

/* The command line as text, to be freed. */
static char *command_text(int argc, char *const argv[])
{
    size_t size = sizeof "leastaction";
    for (int k = 1; k < argc; k++)
        size += 4 * strlen(argv[k]) + 3;
    char *text = malloc(size), *end = text ? stpcpy(text, "leastaction") : NULL;
    for (int k = 1; k < argc && end; k++) {
        *end++ = ' ';
        end = append_word(end, argv[k]);
    }
    return text;
}

/* Output promised on standard output must have been written. */
static int finish(int status)
{
    if (fflush(stdout) == 0 && !ferror(stdout))
        return status;
    fputs("leastaction: standard output cannot be written\n", stderr);
    return status == DONE ? NOT_REACHED : status;
}

static bool has_many_runs(const struct common *common)
{
    return common->scan.n || common->sweep.n || common->seeds;
}

static int refuse_curves(struct ad_error *error)
{
    ad_fail(error, AD_E_ARGUMENT, "--curves needs --scan, --sweep or --seeds, runs to show");
    return command_status(error);
}

/* Ranks above 0 compute, and leave words to rank 0. All are of one version, with one command line,
   on processors that round alike. */
static enum ad_status set_ranks(const struct command *command, struct ad_ranks *ranks,
                                struct common *common, struct ad_error *error)
{
    char program[64];
    common->ranks = ranks;
    if (!ranks)
        return AD_OK;
    snprintf(program, sizeof program, "leastaction %s, %s", leastaction_version(),
             ad_kernels_for(AD_F64)->isa);
    ad_ranks_same(ranks, "program", program, error);
    ad_ranks_same(ranks, "command line", common->command, error);
    common->quiet |= ranks->rank > 0;
    if (!command->line.ranks && !has_many_runs(common))
        ad_fail(error, AD_E_ARGUMENT, "runs in one process; expected one rank, got %zu",
                ranks->count);
    return error->status;
}

static int perform(const struct command *command, struct ad_ranks *ranks, struct common *common,
                   struct ad_error *error)
{
    if (common->no_native)
        setenv("LEASTACTION_NATIVE", "0", 1);
    if (common->help)
        options_help(&command->line, stdout);
    else if (common->version)
        puts("leastaction " LEASTACTION_VERSION);
    else if (set_ranks(command, ranks, common, error) == AD_OK)
        return has_many_runs(common) ? scan_run(command, common, error)
               : !common->curves     ? command->run(common, error)
                                     : refuse_curves(error);
    return command_status(error);
}

static int run(const struct command *command, int argc, char *const argv[], struct ad_ranks *ranks,
               bool *quiet, struct ad_error *error)
{
    struct common *common = calloc(1, command->bytes);
    char *text = command_text(argc, argv);
    int status = DONE;
    if (!common || !text) {
        ad_fail(error, AD_E_MEMORY, "out of memory");
    } else {
        if (options_parse(&command->line, argc - 2, argv + 2, common, error) == AD_OK) {
            common->command = text;
            status = perform(command, ranks, common, error);
        }
        *quiet = common->quiet;
        options_free(&command->line, common);
    }
    AD_FREE(common, text);
    return status == DONE ? command_status(error) : status;
}

static void print_error(const char *subcommand, const char *message)
{
    fprintf(stderr, "leastaction%s%s: ", *subcommand ? " " : "", subcommand);
    quote_terminal_line(stderr, "", message);
}

/* Ends with the other ranks. What all failed in alike, rank 0 says; what one failed in, that one.
 */
static int leave(struct ad_ranks *ranks, const char *subcommand, bool quiet, int status,
                 const struct ad_error *error)
{
    char message[sizeof error->message + 32];
    bool failed = error->status != AD_OK, first = !ranks || ranks->rank == 0;
    if (failed && first)
        print_error(subcommand, error->message);
    status = finish(status);
    bool met = ranks_meet(ranks, failed);
    if (failed && !first && !met) {
        snprintf(message, sizeof message, "rank %zu: %s", ranks->rank, error->message);
        print_error(subcommand, message);
    }
    if (ranks && met)
        ranks_tell_waits(ranks, quiet || failed);
    ranks_end(ranks, met, status);
    return status;
}

int command_main(int argc, char *argv[])
{
    struct ad_error error = {0};
    struct ad_ranks *ranks = ranks_start(&error);
    const char *word = argc < 2 ? "" : argv[1];
    if (error.status != AD_OK)
        return leave(ranks, "", true, WRONG_USE, &error);
    if (argc < 2) {
        ad_fail(&error, AD_E_ARGUMENT, "missing subcommand; leastaction --help lists them");
        return leave(ranks, "", true, WRONG_USE, &error);
    }
    if (strcmp(word, "--help") == 0 || strcmp(word, "-h") == 0) {
        help();
        return leave(ranks, "", true, DONE, &error);
    }
    if (strcmp(word, "--version") == 0) {
        puts("leastaction " LEASTACTION_VERSION);
        return leave(ranks, "", true, DONE, &error);
    }
    const struct command *command = command_find(word, &error);
    if (!command)
        return leave(ranks, "", true, WRONG_USE, &error);
    bool quiet = false;
    int status = run(command, argc, argv, ranks, &quiet, &error);
    return leave(ranks, command->line.name, quiet, status, &error);
}
