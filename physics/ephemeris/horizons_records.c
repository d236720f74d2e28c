/* Records of a Horizons table between $$SOE and $$EOE (horizons_reader.h). A record is one line of
   values separated by commas, or a line with the epoch followed by lines of values, labelled or
   bare; what the header calls the columns says which. */
#include "horizons_reader.h"
#include "physics/io/grow.h"
#include "physics/io/numbers.h"

#include <ctype.h>
#include <math.h>
#include <string.h>

struct record {
    double jd;
    double values[HORIZONS_VALUES];
};

static bool read_number(struct horizons_reader *r, const char **p, const char *name, double *value)
{
    const char *end = r->text + r->length;
    *p = phys_text_skip(*p, end);
    const char *stop = phys_text_number(*p, end, value);
    if (!stop)
        return phys_horizons_refuse(r, *p, "expected a number for %s, found %s", name,
                                    phys_text_quote(*p, end).text);
    if (!isfinite(*value))
        return phys_horizons_refuse(r, *p, "expected a finite number for %s, found %s", name,
                                    phys_text_quote(*p, end).text);
    *p = phys_text_skip(stop, end);
    return true;
}

/* Epochs are printed with nine decimals: steps are equal to that. */
static bool read_epoch(struct horizons_reader *r, const char **p, struct record *record)
{
    const struct phys_horizons *table = r->table;
    const char *at = phys_text_skip(*p, r->text + r->length);
    size_t n = table->n;
    if (!read_number(r, p, "the epoch", &record->jd))
        return false;
    if (!(fabs(record->jd) < 1e8))
        return phys_horizons_refuse(r, at, "expected a Julian date, found %g", record->jd);
    if (n > 0 && !(record->jd > table->jd[n - 1]))
        return phys_horizons_refuse(r, at, "expected an epoch after %.9f, found %.9f",
                                    table->jd[n - 1], record->jd);
    if (n < 2)
        return true;
    double first = table->jd[1] - table->jd[0], step = record->jd - table->jd[n - 1];
    return fabs(step - first) <= 1e-8 ||
           phys_horizons_refuse(r, at, "expected a step of %.9g days as before, found %.9g", first,
                                step);
}

static bool expect(struct horizons_reader *r, const char *p, char c, const char *name)
{
    return *p == c || phys_horizons_refuse(r, p, "expected '%c' after %s, found %s", c, name,
                                           phys_text_quote(p, r->text + r->length).text);
}

/* ---- CSV ---- */

/* A column that is not needed (calendar date, delta-T, uncertainties) may hold anything. */
static bool csv_field(struct horizons_reader *r, const char **p, size_t k, struct record *record)
{
    const struct horizons_column *column = &r->columns[k];
    if (k == 0) {
        if (!read_epoch(r, p, record))
            return false;
    } else if (column->value < 0) {
        *p += strcspn(*p, ",");
    } else if (!read_number(r, p, column->name, &record->values[column->value])) {
        return false;
    }
    if (k + 1 == r->n_columns && *p == r->text + r->length) /* the last comma may be missing */
        return true;
    if (!expect(r, *p, ',', k ? column->name : "the epoch"))
        return false;
    ++*p;
    return true;
}

static bool csv_record(struct horizons_reader *r, struct record *record)
{
    const char *p = r->text;
    for (size_t k = 0; k < r->n_columns; k++)
        if (!csv_field(r, &p, k, record))
            return false;
    p = phys_text_skip(p, r->text + r->length);
    return !*p || phys_horizons_refuse(r, p, "expected the end of the record after %zu columns",
                                       r->n_columns);
}

/* ---- labelled or bare ---- */

/* "VX= 1.5", "X =-1.5" or "1.5". */
static bool labelled_value(struct horizons_reader *r, const char **p,
                           const struct horizons_column *column, struct record *record)
{
    double value;
    *p = phys_text_skip(*p, r->text + r->length);
    if (isalpha((unsigned char)**p)) {
        size_t n = strlen(column->name);
        if (strncmp(*p, column->name, n) != 0 || isalnum((unsigned char)(*p)[n]))
            return phys_horizons_refuse(r, *p, "expected %s, found %s", column->name,
                                        phys_text_quote(*p, r->text + r->length).text);
        *p = phys_text_skip(*p + n, r->text + r->length);
        if (!expect(r, *p, '=', column->name))
            return false;
        ++*p;
    }
    if (!read_number(r, p, column->name, &value))
        return false;
    if (column->value >= 0)
        record->values[column->value] = value;
    return !column->ends_line || !**p ||
           phys_horizons_refuse(r, *p, "expected the end of the line after %s", column->name);
}

static bool next_line_of_record(struct horizons_reader *r, const char *expected)
{
    if (!phys_horizons_line(r))
        return phys_horizons_ended(r, expected);
    return !r->cut || phys_horizons_refuse(r, NULL, "expected at most %d characters per line",
                                           HORIZONS_LINE - 1);
}

static bool labelled_record(struct horizons_reader *r, struct record *record)
{
    const char *p = r->text;
    if (!read_epoch(r, &p, record) || !expect(r, p, '=', "the epoch"))
        return false;
    for (size_t k = 1; k < r->n_columns; k++) {
        if (r->columns[k - 1].ends_line) {
            if (!next_line_of_record(r, r->columns[k].name))
                return false;
            p = r->text;
        }
        if (!labelled_value(r, &p, &r->columns[k], record))
            return false;
    }
    return true;
}

/* ---- the table ---- */

static bool append(struct horizons_reader *r, const struct record *record)
{
    struct phys_horizons *table = r->table;
    size_t n = table->n;
    if (!phys_grow(&table->jd, n, sizeof *table->jd) ||
        !phys_grow(&table->position, n, 3 * sizeof *table->position) ||
        (r->has_velocity && !phys_grow(&table->velocity, n, 3 * sizeof *table->velocity)))
        return HORIZONS_FAIL(r, AD_E_MEMORY, "%s: out of memory", r->file);
    table->n++;
    table->jd[n] = record->jd;
    for (size_t k = 0; k < 3; k++) {
        double x = record->values[HORIZONS_POSITION + k] * r->metres;
        double v =
            r->has_velocity ? record->values[HORIZONS_VELOCITY + k] * (r->metres / r->seconds) : 0;
        if (!isfinite(x) || !isfinite(v))
            return phys_horizons_refuse(r, NULL, "expected coordinates below 1e308 m");
        table->position[3 * n + k] = x;
        if (r->has_velocity)
            table->velocity[3 * n + k] = v;
    }
    return true;
}

static bool read_records(struct horizons_reader *r)
{
    while (next_line_of_record(r, "an epoch or $$EOE")) {
        struct record record = {0};
        if (phys_horizons_starts(r, "$$EOE"))
            return true;
        if (!r->length)
            continue;
        if (!(r->csv ? csv_record : labelled_record)(r, &record) || !append(r, &record))
            return false;
    }
    return false;
}

/* Explanations follow the table, unless several tables are in one file. Reading to the end also
   lets the writer of a pipe finish. */
static bool read_rest(struct horizons_reader *r)
{
    while (phys_horizons_line(r))
        if (phys_horizons_starts(r, "$$SOE"))
            return phys_horizons_refuse(r, NULL,
                                        "expected one table per file, found a second $$SOE");
    return r->status == AD_OK;
}

bool phys_horizons_rows(struct horizons_reader *r)
{
    if (!read_records(r))
        return false;
    if (r->table->n == 0)
        return phys_horizons_refuse(r, NULL,
                                    "expected records between $$SOE and $$EOE, found none");
    phys_horizons_date(r->table->jd[0], r->table->start_date, sizeof r->table->start_date);
    return read_rest(r);
}
