/* Files of a chart: CSV, pictures, JSON (chart.h). */
#include "chart.h"

#include <assert.h>
#include <errno.h>
#include <gnu/libc-version.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>

enum { NAME_ROOM = 4096 };

static enum ad_status name_in(const struct chart *chart, const char *name, const char *extension,
                              char *to, struct ad_error *error)
{
    if (mkdir(chart->folder, 0777) != 0 && errno != EEXIST)
        return ad_fail(error, AD_E_IO, "%s: %s", chart->folder, strerror(errno));
    if (snprintf(to, NAME_ROOM, "%s/%s.%s", chart->folder, name, extension) >= NAME_ROOM)
        return ad_fail(error, AD_E_ARGUMENT, "--out: the name is too long");
    return error->status;
}

/* The model name of the processor as Linux gives it. */
static void name_machine(char *to, size_t size)
{
    char line[256];
    FILE *info = fopen("/proc/cpuinfo", "r");
    snprintf(to, size, "unknown");
    while (info && fgets(line, sizeof line, info))
        if (strncmp(line, "model name", 10) == 0 && strchr(line, ':')) {
            line[strcspn(line, "\n")] = '\0';
            snprintf(to, size, "%s", strchr(line, ':') + 2);
            break;
        }
    if (info)
        fclose(info);
}

#ifdef __clang__
#define COMPILER "" /* its version begins with its name */
#else
#define COMPILER "gcc "
#endif

/* glibc's version is that of the vector functions. */
static void write_origin(FILE *out)
{
    char machine[128], date[32];
    time_t now = time(NULL);
    name_machine(machine, sizeof machine);
    strftime(date, sizeof date, "%Y-%m-%d", gmtime(&now));
    fprintf(out,
            "# machine: %s\n# date: %s\n# versions: leastaction %s, " COMPILER "%.40s, glibc %s\n",
            machine, date, LEASTACTION_VERSION, __VERSION__, gnu_get_libc_version());
}

FILE *chart_terminal(const struct chart *chart) { return chart->quiet ? NULL : stdout; }

struct sheet *chart_sheet(struct chart *chart, const char *name, const struct column *columns,
                          struct ad_error *error)
{
    char target[NAME_ROOM];
    assert(chart->sheets < CHART_SHEETS);
    struct sheet *sheet = &chart->sheet[chart->sheets];
    struct result *csv = &chart->csv[chart->sheets++];
    if (name_in(chart, name, "csv", target, error) == AD_OK &&
        result_begin(csv, target, error) == AD_OK)
        write_origin(csv->out);
    sheet_open(sheet, columns, csv->out, error->status == AD_OK ? chart_terminal(chart) : NULL);
    return sheet;
}

struct plot *chart_picture(struct chart *chart, const char *name, struct ad_error *error)
{
    char target[NAME_ROOM];
    assert(chart->pictures < CHART_PICTURES);
    struct plot *plot = &chart->picture[chart->pictures++];
    if (name_in(chart, name, chart->format, target, error) == AD_OK)
        plot_begin(plot, target, error);
    return plot;
}
