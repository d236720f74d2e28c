/* Files of a chart (charts.h). */
#include "charts.h"

#include <errno.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>

enum { NAME_ROOM = 4096 };

static enum ad_status name_in(const struct chart_settings *settings, const char *name,
                              const char *extension, char *to, struct ad_error *error)
{
    if (mkdir(settings->folder, 0777) != 0 && errno != EEXIST)
        return ad_fail(error, AD_E_IO, "%s: %s", settings->folder, strerror(errno));
    if (snprintf(to, NAME_ROOM, "%s/%s.%s", settings->folder, name, extension) >= NAME_ROOM)
        return ad_fail(error, AD_E_ARGUMENT, "--out: the name is too long");
    return AD_OK;
}

/* Model name of the processor as Linux gives it. */
static void print_machine(FILE *out)
{
    char line[256];
    FILE *info = fopen("/proc/cpuinfo", "r");
    while (info && fgets(line, sizeof line, info))
        if (strncmp(line, "model name", 10) == 0 && strchr(line, ':')) {
            fprintf(out, "# machine: %s", strchr(line, ':') + 2);
            break;
        }
    if (info)
        fclose(info);
}

enum ad_status chart_csv(const struct chart_settings *settings, const char *name,
                         struct result *csv, struct ad_error *error)
{
    char target[NAME_ROOM], date[32] = "";
    time_t now = time(NULL);
    *csv = (struct result){0};
    if (name_in(settings, name, "csv", target, error) != AD_OK ||
        result_begin(csv, target, error) != AD_OK)
        return error->status;
    strftime(date, sizeof date, "%Y-%m-%d", gmtime(&now));
    print_machine(csv->out);
    fprintf(csv->out, "# date: %s\n# compiler: %s\n", date, __VERSION__);
    return AD_OK;
}

enum ad_status chart_picture(const struct chart_settings *settings, const char *name,
                             struct plot *plot, struct ad_error *error)
{
    char target[NAME_ROOM];
    *plot = (struct plot){0};
    if (name_in(settings, name, settings->format, target, error) != AD_OK)
        return error->status;
    return plot_begin(plot, target, error);
}
