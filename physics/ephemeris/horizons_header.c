/* Reads the header of a Horizons table: target, centre, frame, units, GM, and the columns. Free
   text between these lines is skipped. */
#include "horizons_reader.h"
#include "physics/io/numbers.h"

#include <ctype.h>
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

/* ---- lines of the form "Key name : value {remark}" ---- */

static const struct key {
    const char *name;
    bool in_table; /* field of the table, else of the reader */
    size_t offset, size;
    const char *required; /* or the message if the line is missing */
} keys[] = {
#define TABLE(field)                                                                               \
    true, offsetof(struct phys_horizons, field), sizeof((struct phys_horizons *)0)->field
#define READER(field)                                                                              \
    false, offsetof(struct horizons_reader, field), sizeof((struct horizons_reader *)0)->field
    {"Target body name", TABLE(target), "'Target body name:'"},
    {"Center body name", TABLE(center), "'Center body name:'"},
    {"Center-site name", READER(site), NULL},
    {"Output units", TABLE(units), "'Output units:'"},
    {"Output type", READER(type), NULL},
    {"Reference frame", TABLE(frame), NULL},
    {"Coordinate systm", READER(system), NULL},
#undef TABLE
#undef READER
};
enum { KEYS = sizeof keys / sizeof *keys };

static char *key_field(struct horizons_reader *r, const struct key *key)
{
    return (key->in_table ? (char *)r->table : (char *)r) + key->offset;
}

static void trim(char *text)
{
    size_t n = strlen(text);
    while (n > 0 && isspace((unsigned char)text[n - 1]))
        n--;
    text[n] = '\0';
}

/* The value after "name :", up to a remark in braces. */
static void take_key(struct horizons_reader *r)
{
    for (size_t k = 0; k < KEYS; k++) {
        const char *end = r->text + r->length;
        if (!phys_horizons_starts(r, keys[k].name))
            continue;
        const char *p = phys_text_skip(r->text, end) + strlen(keys[k].name);
        p = phys_text_skip(p, end);
        if (*p != ':')
            return;
        p = phys_text_skip(p + 1, end);
        snprintf(key_field(r, &keys[k]), keys[k].size, "%.*s", (int)strcspn(p, "{"), p);
        trim(key_field(r, &keys[k]));
        return;
    }
}

/* "Mercury (199)" is the name and the id; other parentheses belong to the name. */
static void split_id(struct phys_horizons *table)
{
    table->id = PHYS_HORIZONS_NO_ID;
    char *open = strrchr(table->target, '('), *end;
    if (!open)
        return;
    long id = strtol(open + 1, &end, 10);
    if (end == open + 1 || strcmp(end, ")") != 0 || id <= INT_MIN || id > INT_MAX)
        return;
    table->id = (int)id;
    *open = '\0';
    trim(table->target);
}

static void join(char *text, size_t size, const char *separator, const char *more)
{
    size_t n = strlen(text);
    snprintf(text + n, size - n, "%s%s", n ? separator : "", more);
}

/* ---- GM ---- */

/* Text allowed between "GM" and "=": the unit, "(planet)", and a power of ten. Anything else, such
   as "1-sigma", means another quantity: returns false. Otherwise *power is set. */
static bool gm_unit(const char *p, const char *equals, int *power)
{
    static const char *const units[] = {"km^3/s^2", "km^3", "s^-2", "planet"};
    static const char blanks[] = " ,()";
    for (p += strspn(p, blanks); p < equals; p += strspn(p, blanks)) {
        size_t n = strcspn(p, " ,()="), k = 0;
        if (n > 3 && strncmp(p, "10^", 3) == 0) {
            *power = (int)strtol(p + 3, NULL, 10);
        } else {
            while (k < 4 && (strlen(units[k]) != n || strncmp(p, units[k], n) != 0))
                k++;
            if (k == 4)
                return false;
        }
        p += n;
    }
    return abs(*power) <= 30;
}

/* "GM (km^3/s^2) = 22031.86855", "GM, km^3/s^2 = ...", "GM (10^11 km^3/s^2) = ...", "GM= 62.6284",
   anywhere in a line; pages print two columns. The first that has a number counts. */
static void take_gm(struct horizons_reader *r)
{
    const char *end = r->text + r->length;
    for (const char *p = r->text; r->table->gm == 0 && (p = strstr(p, "GM")); p += 2) {
        const char *equals = strchr(p, '=');
        if (!equals || (p > r->text && isalnum((unsigned char)p[-1])) ||
            isalnum((unsigned char)p[2]))
            continue;
        int power = 0;
        if (!gm_unit(p + 2, equals, &power))
            continue;
        const char *q = phys_text_skip(equals + 1, end);
        double gm;
        q += *q == '~';
        if (phys_text_number(q, end, &gm) && gm > 0 && gm < 1e40)
            r->table->gm = gm * pow(10, power + 9); /* km^3 to m^3 */
    }
}

/* ---- columns ---- */

static void add_column(struct horizons_reader *r, const char *name, size_t length, bool ends_line)
{
    static const char *const values[HORIZONS_VALUES] = {"X",  "Y",  "Z",  "VX", "VY",
                                                        "VZ", "LT", "RG", "RR"};
    if (r->n_columns < HORIZONS_COLUMNS) {
        struct horizons_column *column = &r->columns[r->n_columns];
        snprintf(column->name, sizeof column->name, "%.*s", (int)length, name);
        trim(column->name);
        column->ends_line = ends_line;
        column->value = -1;
        for (int k = 0; k < HORIZONS_VALUES; k++)
            if (strcmp(column->name, values[k]) == 0)
                column->value = k;
    }
    r->n_columns++;
}

/* "JDTDB, Calendar Date (TDB), X, ..." in one line, or "JDTDB", "X Y Z", "VX VY VZ" in several. */
static void take_columns(struct horizons_reader *r)
{
    const char *end = r->text + r->length;
    if (strchr(r->text, ','))
        r->csv = true;
    for (const char *p = phys_text_skip(r->text, end); p < end;) {
        size_t n = strcspn(p, r->csv ? "," : " \t");
        const char *next = phys_text_skip(p + n + (p + n < end && r->csv), end);
        add_column(r, p, n, next == end);
        p = next;
    }
}

static bool check_columns(struct horizons_reader *r)
{
    bool found[HORIZONS_VALUES] = {false};
    if (r->n_columns == 0)
        return phys_horizons_refuse(r, NULL, "expected column names (JDTDB, X, Y, Z) before $$SOE");
    if (r->n_columns > HORIZONS_COLUMNS)
        return phys_horizons_refuse(r, NULL, "expected at most %d columns, found %zu",
                                    HORIZONS_COLUMNS, r->n_columns);
    const char *epoch = r->columns[0].name;
    if (strcmp(epoch, "JDTDB") != 0 && strcmp(epoch, "JDCT") != 0)
        return phys_horizons_refuse(r, NULL, "expected epochs in TDB (column JDTDB), found %s",
                                    epoch);
    for (size_t k = 1; k < r->n_columns; k++)
        if (r->columns[k].value >= 0)
            found[r->columns[k].value] = true;
    if (!found[0] || !found[1] || !found[2])
        return phys_horizons_refuse(r, NULL, "expected columns X, Y, Z (output formats 1 to 3)");
    r->has_velocity = found[3] && found[4] && found[5];
    return true;
}

/* ---- the whole ---- */

static bool check_units(struct horizons_reader *r)
{
    static const struct {
        const char *name;
        double metres, seconds;
    } units[] = {{"KM-S", 1e3, 1}, {"KM-D", 1e3, 86400}, {"AU-D", 149597870700.0, 86400}};
    for (size_t k = 0; k < sizeof units / sizeof *units; k++)
        if (strcmp(r->table->units, units[k].name) == 0) {
            r->metres = units[k].metres;
            r->seconds = units[k].seconds;
            return true;
        }
    return phys_horizons_refuse(r, NULL, "expected output units KM-S, KM-D or AU-D, found '%s'",
                                r->table->units);
}

static bool check_header(struct horizons_reader *r)
{
    struct phys_horizons *table = r->table;
    for (size_t k = 0; k < KEYS; k++)
        if (keys[k].required && !*key_field(r, &keys[k]))
            return phys_horizons_refuse(r, NULL, "expected a line %s before $$SOE",
                                        keys[k].required);
    if (!*table->frame && !*r->system)
        return phys_horizons_refuse(r, NULL, "expected a line 'Reference frame:' before $$SOE");
    if (*r->type && strcmp(r->type, "GEOMETRIC cartesian states") != 0)
        return phys_horizons_refuse(
            r, NULL, "expected output type 'GEOMETRIC cartesian states', found '%s'", r->type);
    split_id(table);
    if (*r->site && strcmp(r->site, "BODY CENTER") != 0)
        join(table->center, sizeof table->center, ", ", r->site);
    if (*r->system)
        join(table->frame, sizeof table->frame, ", ", r->system);
    return check_units(r) && check_columns(r);
}

bool phys_horizons_header(struct horizons_reader *r)
{
    bool in_columns = false;
    while (phys_horizons_line(r)) {
        if (phys_horizons_starts(r, "$$SOE"))
            return check_header(r);
        if (phys_horizons_starts(r, "JD")) {
            in_columns = true;
            r->csv = false;
            r->n_columns = 0;
        } else if (phys_horizons_starts(r, "***")) {
            in_columns = false;
        }
        if (in_columns) {
            take_columns(r);
        } else {
            take_key(r);
            take_gm(r);
        }
    }
    return phys_horizons_ended(r, "a Horizons vector table ($$SOE)");
}
