/* leastaction path --relate: linear relations between the coordinates of both ends (path.h). */
#include "path.h"

#include <stdlib.h>
#include <string.h>

/* Where the term at `text` ends: at a sign that is not one of an exponent. */
static const char *term_end(const char *text)
{
    const char *at = text + (*text == '+' || *text == '-');
    for (; *at; at++)
        if (strchr("+-", *at) &&
            !(at > text + 1 && strchr("eE", at[-1]) && strchr("0123456789.", at[-2])))
            break;
    return at;
}

/* Adds a term, as in -0.5*x(T) or pi/2, to row [2 dof + 1]. */
static enum ad_status read_term(struct path_run *run, const char *relation, const char *text,
                                size_t length, double share, double *row, struct ad_error *error)
{
    const size_t dof = run->system.dof;
    char term[80];
    snprintf(term, sizeof term, "%.*s", (int)length, text);
    double factor = *term == '-' ? -share : share, number = 1;
    char *name = term + (*term == '+' || *term == '-'), *times = strrchr(name, '*'),
         *bracket = strchr(name, '(');
    const bool last = bracket && strcmp(bracket, "(T)") == 0;
    const bool whole = length < sizeof term;
    if (whole && !bracket && options_number(name, &number)) {
        row[2 * dof] -= factor * number;
        return AD_OK;
    }
    if (times)
        *times = '\0';
    if (!whole || !(last || (bracket && strcmp(bracket, "(0)") == 0)) ||
        (times && !options_number(name, &number)))
        return ad_fail(error, AD_E_ARGUMENT,
                       "--relate: expected terms as in 'x(T)=-0.5*x(0)+pi/2', got '%.*s' in '%s'",
                       (int)length, text, relation);
    *bracket = '\0';
    const size_t k = path_coordinate(run, times ? times + 1 : name, error);
    if (error->status == AD_OK)
        row[k + (last ? dof : 0)] += factor * number;
    return error->status;
}

/* Both sides of a relation: left less right. */
static enum ad_status read_relation(struct path_run *run, const char *text, double *row,
                                    struct ad_error *error)
{
    const char *equals = strchr(text, '=');
    if (!equals || strchr(equals + 1, '=') || equals == text || !equals[1])
        return ad_fail(error, AD_E_ARGUMENT,
                       "--relate: expected one equation, as in 'x(T)=-x(0)+1', got '%s'", text);
    for (const char *at = text, *end; error->status == AD_OK && *at; at = end) {
        end = term_end(at);
        if (at <= equals && end > equals)
            end = equals;
        read_term(run, text, at, (size_t)(end - at), at < equals ? 1 : -1, row, error);
        end += end == equals;
    }
    return error->status;
}

enum ad_status path_relations(struct path_run *run, struct ad_error *error)
{
    const char *text = run->options->relate;
    const size_t columns = 2 * run->system.dof + 1;
    size_t n = 1;
    if (!text)
        return AD_OK;
    for (const char *at = text; (at = strchr(at, ',')); at++)
        n++;
    char *copy = strdup(text), *word = copy;
    run->relation = calloc(n * columns, sizeof *run->relation);
    if (!copy || !run->relation)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    for (size_t k = 0; k < n && error->status == AD_OK; k++) {
        char *comma = strchr(word, ',');
        if (comma)
            *comma = '\0';
        read_relation(run, word, run->relation + k * columns, error);
        word = comma ? comma + 1 : word;
    }
    free(copy);
    run->ends.n_relations = n;
    run->ends.relation = run->relation;
    return error->status;
}
