/* Pairs columns by their names: a momentum with its coordinate, a rate with its column. */
#include "data_table.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* ---- coordinates and momenta ---- */

/* Names that differ in one of these words alone: q1 and p1, x_a and v_a, /pos.2 and /mom.2. */
static const struct {
    const char *coordinate, *momentum;
} words[] = {
    {"q", "p"},
    {"x", "p"},
    {"x", "v"},
    {"q", "v"},
    {"o", "v"},
    {"theta", "omega"},
    {"phi", "omega"},
    {"angle", "omega"},
    {"θ", "ω"},
    {"φ", "ω"},
    {"pos", "mom"},
    {"pos", "vel"},
    {"position", "momentum"},
    {"position", "velocity"},
    {"angle", "momentum"},
    {"angle", "velocity"},
    {"r", "v"},
    {"theta", "p"},
    {"phi", "p"},
    {"coordinate", "momentum"},
};

/* Said before or behind the coordinate's name: px, p_theta, v.x, x_dot. */
static const char *const before[] = {"p", "v", "mom", "momentum", "vel", "velocity"};
static const char *const behind[] = {"p", "v", "mom", "momentum", "vel", "velocity", "dot"};

/* A unit behind a blank is no part of the name: "q1 [m]". */
static size_t length_of(const char *name)
{
    const char *unit = strstr(name, " [");
    if (!unit)
        unit = strstr(name, " (");
    return unit ? (size_t)(unit - name) : strlen(name);
}

static bool same(const char *a, size_t n, const char *b, size_t m)
{
    return n == m && strncasecmp(a, b, n) == 0;
}

static size_t separator(char c) { return c == '_' || c == '.' || c == ' ' || c == '-'; }

/* "p", then perhaps a separator, then the coordinate. */
static bool said_before(const char *q, size_t nq, const char *p, size_t np)
{
    for (size_t k = 0; k < LENGTH(before); k++) {
        size_t n = strlen(before[k]);
        if (np <= n || strncasecmp(p, before[k], n) != 0)
            continue;
        n += separator(p[n]);
        if (same(p + n, np - n, q, nq))
            return true;
    }
    return false;
}

/* The coordinate, a separator, "p"; "dot" needs none. */
static bool said_behind(const char *q, size_t nq, const char *p, size_t np)
{
    if (np <= nq || strncasecmp(q, p, nq) != 0)
        return false;
    size_t at = nq + separator(p[nq]);
    for (size_t k = 0; k < LENGTH(behind); k++)
        if (same(p + at, np - at, behind[k], strlen(behind[k])) &&
            (at > nq || strcmp(behind[k], "dot") == 0))
            return true;
    return false;
}

/* The common beginning and end of both names are removed; a word begins the name or follows a
   character that is no letter. */
static bool said_instead(const char *q, size_t nq, const char *p, size_t np)
{
    for (size_t k = 0; k < LENGTH(words); k++) {
        size_t cq = strlen(words[k].coordinate), cp = strlen(words[k].momentum);
        if (nq < cq || np != nq - cq + cp)
            continue;
        for (size_t at = 0; at + cq <= nq; at++) {
            bool begins = at == 0 || separator(q[at - 1]) || q[at - 1] == '/' ||
                          (q[at - 1] >= '0' && q[at - 1] <= '9');
            if (begins && strncasecmp(q, p, at) == 0 &&
                strncasecmp(q + at, words[k].coordinate, cq) == 0 &&
                strncasecmp(p + at, words[k].momentum, cp) == 0 &&
                strncasecmp(q + at + cq, p + at + cp, nq - at - cq) == 0)
                return true;
        }
    }
    return false;
}

static bool is_momentum(const char *q, const char *p)
{
    size_t nq = length_of(q), np = length_of(p);
    return said_before(q, nq, p, np) || said_behind(q, nq, p, np) || said_instead(q, nq, p, np);
}

/* The one momentum among n columns of column k; n: none; n + 1: several. */
static size_t momentum_of(const struct hnn_source *s, size_t n, const size_t *column, size_t k)
{
    size_t found = n;
    for (size_t j = 0; j < n; j++)
        if (j != k && is_momentum(s->name[column[k]], s->name[column[j]])) {
            if (found < n)
                return n + 1;
            found = j;
        }
    return found;
}

/* Into order [n], coordinates first; `of` [n] is whose momentum each column is, n: none's. */
static bool pair(const struct hnn_source *s, size_t n, const size_t *column, size_t *order,
                 size_t *of)
{
    size_t pairs = 0;
    for (size_t k = 0; k < n; k++)
        of[k] = n;
    for (size_t k = 0; k < n; k++) {
        size_t p = momentum_of(s, n, column, k);
        if (p == n)
            continue;
        if (p > n || of[p] < n || pairs == n / 2)
            return false;
        of[p] = k;
        order[pairs] = column[k];
        order[n / 2 + pairs++] = column[p];
    }
    for (size_t k = 0; k < n; k++) /* none is both */
        if (of[k] < n && momentum_of(s, n, column, k) < n)
            return false;
    return pairs == n / 2;
}

enum ad_status hnn_pairs_order(const struct hnn_source *s, size_t n, size_t *column, bool *paired,
                               struct ad_error *error)
{
    *paired = s->name && n % 2 == 0;
    for (size_t k = 0; k < n && *paired; k++)
        *paired = s->name[column[k]] != NULL;
    size_t *order = *paired ? malloc((2 * n + 1) * sizeof *order) : NULL;
    if (*paired && !order)
        return ad_fail(error, AD_E_MEMORY, "%s: out of memory", s->file);
    *paired = *paired && pair(s, n, column, order, order + n);
    if (*paired)
        memcpy(column, order, n * sizeof *column);
    free(order);
    return AD_OK;
}

/* ---- rates ---- */

size_t hnn_column_named(const struct hnn_source *s, const char *name)
{
    for (size_t k = 0; s->name && k < s->columns; k++)
        if (s->name[k] && strcmp(s->name[k], name) == 0)
            return k;
    return HNN_NO_COLUMN;
}

/* "dqdt" of "q". */
static bool is_rate(const char *rate, const char *end, const char *name, const char *name_end)
{
    size_t n = (size_t)(name_end - name);
    return (size_t)(end - rate) == n + 3 && rate[0] == 'd' && memcmp(rate + 1, name, n) == 0 &&
           memcmp(end - 2, "dt", 2) == 0;
}

/* Of columns of arrays in folders the name proper alone: "q" of "run/q.2". */
static const char *name_proper(const char *name, const char **end)
{
    const char *slash = strrchr(name, '/'), *base = slash ? slash + 1 : name;
    const char *dot = strrchr(base, '.');
    *end = dot ? dot : base + strlen(base);
    return base;
}

static bool is_rate_in_folder(const char *rate, const char *name)
{
    const char *rate_end, *name_end;
    const char *base = name_proper(name, &name_end), *rate_base = name_proper(rate, &rate_end);
    return base - name == rate_base - rate && strncmp(name, rate, (size_t)(base - name)) == 0 &&
           strcmp(name_end, rate_end) == 0 && is_rate(rate_base, rate_end, base, name_end);
}

size_t hnn_rate_of(const struct hnn_source *s, size_t column)
{
    const char *name = s->name ? s->name[column] : NULL;
    size_t found = HNN_NO_COLUMN;
    for (size_t k = 0; name && k < s->columns; k++) {
        const char *rate = s->name[k];
        if (rate && is_rate(rate, rate + strlen(rate), name, name + strlen(name)))
            return k;
        if (rate && is_rate_in_folder(rate, name))
            found = k;
    }
    return found;
}

bool hnn_named_as_rate(const struct hnn_source *s, size_t column)
{
    const char *end, *base = s->name && s->name[column] ? name_proper(s->name[column], &end) : NULL;
    return base && end - base > 3 && *base == 'd' && strncmp(end - 2, "dt", 2) == 0;
}

/* Puts rates where their states stand, if their names say which is whose. AD_E_INPUT where a rate
   is by its name that of another state, and not all are. */
enum ad_status hnn_rates_match(const struct hnn_source *s, size_t n, const size_t *state,
                               size_t *rate, struct ad_error *error)
{
    size_t matched = 0, moved = n;
    for (size_t k = 0; k < n; k++) {
        size_t own = hnn_rate_of(s, state[k]);
        for (size_t j = 0; j < n && own != HNN_NO_COLUMN; j++)
            if (rate[j] == own) {
                matched++;
                moved = j != k ? k : moved;
            }
    }
    if (moved == n)
        return AD_OK;
    if (matched < n)
        return ad_fail(error, AD_E_INPUT,
                       "%s: rate: '%s' is the rate of '%s' by name, but in another position; "
                       "expected rates in the order of the state",
                       s->file, s->name[hnn_rate_of(s, state[moved])], s->name[state[moved]]);
    for (size_t k = 0; k < n; k++)
        rate[k] = hnn_rate_of(s, state[k]);
    return AD_OK;
}
