/* Julian dates and calendar dates (Meeus, Astronomical Algorithms, chapter 7, with floor in place
   of truncation, which extends it to dates before -4712). */
#include "horizons.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct date {
    int year, month, day; /* year 0 is 1 BC */
};

static struct date date_of(double jd)
{
    const double gregorian = 2299161;         /* 1582-10-15 */
    double z = floor(jd + 0.5 + 5e-6), a = z; /* half a second is rounding, not the day before */
    if (z >= gregorian) {
        double century = floor((z - 1867216.25) / 36524.25);
        a = z + 1 + century - floor(century / 4);
    }
    double b = a + 1524, c = floor((b - 122.1) / 365.25), d = floor(365.25 * c);
    double e = floor((b - d) / 30.6001);
    int month = (int)(e < 14 ? e - 1 : e - 13);
    return (struct date){(int)c - (month > 2 ? 4716 : 4715), month,
                         (int)(b - d - floor(30.6001 * e))};
}

/* At midnight. */
static double julian_date(struct date date)
{
    bool gregorian = date.year * 10000L + date.month * 100 + date.day >= 15821015;
    double year = date.year, month = date.month;
    if (month < 3) {
        year -= 1;
        month += 12;
    }
    double century = floor(year / 100);
    double leap = gregorian ? 2 - century + floor(century / 4) : 0;
    return floor(365.25 * (year + 4716)) + floor(30.6001 * (month + 1)) + date.day + leap - 1524.5;
}

void phys_horizons_date(double jd, char *date, size_t size)
{
    if (!date)
        return;
    if (!(fabs(jd) < 1e8)) {
        snprintf(date, size, "unknown");
        return;
    }
    struct date d = date_of(jd);
    snprintf(date, size, "%s%04d-%02d-%02d", d.year < 0 ? "-" : "", abs(d.year), d.month, d.day);
}

/* Dates that the calendar does not have do not survive the way there and back. */
static bool parse_date(const char *text, double *jd)
{
    struct date d;
    int length = 0;
    if (sscanf(text, "%6d-%2d-%2d%n", &d.year, &d.month, &d.day, &length) != 3 || text[length])
        return false;
    *jd = julian_date(d);
    struct date back = date_of(*jd);
    return back.year == d.year && back.month == d.month && back.day == d.day;
}

static enum ad_status by_index(const struct phys_horizons *table, const char *from, size_t *index,
                               struct ad_error *error)
{
    unsigned long long k = strtoull(from, NULL, 10);
    if (k >= table->n)
        return ad_fail(error, AD_E_ARGUMENT, "epoch %s: the table of %s has epochs 0 to %zu", from,
                       table->target, table->n - 1);
    *index = (size_t)k;
    return AD_OK;
}

enum ad_status phys_horizons_epoch(const struct phys_horizons *table, const char *from,
                                   size_t *index, struct ad_error *error)
{
    double jd;
    if (AD_LACKS(error, table, from, index))
        return error->status;
    if (*from && from[strspn(from, "0123456789")] == '\0')
        return by_index(table, from, index, error);
    if (!parse_date(from, &jd))
        return ad_fail(error, AD_E_ARGUMENT, "epoch '%s': expected an index or a date YYYY-MM-DD",
                       from);
    for (size_t k = 0; k < table->n; k++)
        if (fabs(table->jd[k] - jd) < 1e-6) {
            *index = k;
            return AD_OK;
        }
    char last[32];
    phys_horizons_date(table->jd[table->n - 1], last, sizeof last);
    double step = table->n > 1 ? table->jd[1] - table->jd[0] : 0;
    return ad_fail(error, AD_E_ARGUMENT,
                   "epoch %s: the table of %s runs from JD %.9g, %s, to %s in steps of %.9g days",
                   from, table->target, table->jd[0], table->start_date, last, step);
}
