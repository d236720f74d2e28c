/* Fuzzer of command lines: no words crash the parser of any subcommand; accepted values are in
   range, and refusals have a message. The first byte chooses the subcommand, each line of the rest
   is a word. */
#include "fuzz.h"

#include "apps/command.h"

#include <string.h>

enum { MOST_WORDS = 32 };

static size_t n_commands(void)
{
    size_t n = 0;
    while (commands[n])
        n++;
    return n;
}

/* Cuts a text at its line ends. */
static int words_of(char *text, char *words[MOST_WORDS])
{
    int n = 0;
    for (char *end; n < MOST_WORDS && *text; text = end) {
        words[n++] = text;
        end = text + strcspn(text, "\n");
        if (*end)
            *end++ = '\0';
    }
    return n;
}

static void check(const struct command_line *line, const struct common *common, const char *values)
{
    fuzz_require(common->threads >= 1 && common->n_arguments <= 2);
    for (size_t k = 0; k < options_rows(line); k++) {
        const struct option *option = options_row(line, k);
        const void *at = values + option->offset;
        if (option->kind >= OPTION_NUMBER && option->kind <= OPTION_SIZE)
            fuzz_require(!isinf(*(const double *)at));
        if (option->kind == OPTION_TEXT || option->kind == OPTION_INPUT)
            fuzz_require(!*(const char *const *)at || **(const char *const *)at);
        if (option->kind == OPTION_SETTINGS)
            for (size_t i = 0; i < ((const struct settings *)at)->n; i++)
                fuzz_require(isfinite(((const struct settings *)at)->setting[i].value));
    }
}

int fuzz_arguments(const uint8_t *data, size_t size)
{
    if (size == 0)
        return 0;
    const struct command *command = commands[data[0] % n_commands()];
    struct ad_error error = {0};
    char *words[MOST_WORDS], *text = fuzz_text(data + 1, size - 1);
    struct common *common = calloc(1, command->bytes);
    fuzz_require(common != NULL);
    int n = words_of(text, words);
    if (options_parse(&command->line, n, words, common, &error) != AD_OK)
        fuzz_require(error.status == AD_E_ARGUMENT && error.message[0]);
    else if (!common->help && !common->version)
        check(&command->line, common, (const char *)common);
    options_free(&command->line, common);
    free(common);
    free(text);
    return 0;
}
