/* Files of a chart (charts.h). */
#include "charts.h"
#include "apps/command.h"

#include <errno.h>
#include <gnu/libc-version.h>
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

struct origin {
    char machine[128], date[32], versions[96];
};

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
static struct origin origin(void)
{
    struct origin o;
    time_t now = time(NULL);
    name_machine(o.machine, sizeof o.machine);
    strftime(o.date, sizeof o.date, "%Y-%m-%d", gmtime(&now));
    snprintf(o.versions, sizeof o.versions, "leastaction %s, " COMPILER "%.40s, glibc %s",
             LEASTACTION_VERSION, __VERSION__, gnu_get_libc_version());
    return o;
}

enum ad_status chart_csv(const struct chart_settings *settings, const char *name,
                         struct result *csv, struct ad_error *error)
{
    char target[NAME_ROOM];
    *csv = (struct result){0};
    if (name_in(settings, name, "csv", target, error) != AD_OK ||
        result_begin(csv, target, error) != AD_OK)
        return error->status;
    struct origin o = origin();
    fprintf(csv->out, "# machine: %s\n# date: %s\n# versions: %s\n", o.machine, o.date, o.versions);
    return AD_OK;
}

enum ad_status chart_picture(const struct chart_settings *settings, const char *name,
                             struct plot *plot, struct ad_error *error)
{
    char target[NAME_ROOM], line[320];
    *plot = (struct plot){0};
    if (name_in(settings, name, settings->format, target, error) != AD_OK ||
        plot_begin(plot, target, error) != AD_OK)
        return error->status;
    struct origin o = origin();
    snprintf(line, sizeof line, "%s; %s; %s", o.machine, o.date, o.versions);
    fputs("set label 999 ", plot->script);
    plot_quote(plot->script, line);
    fputs(" at screen 0.004,0.99 left font ',7' textcolor rgb '#808080' noenhanced\n",
          plot->script);
    return AD_OK;
}

enum ad_status chart_end(struct plot *plot, struct result *csv, struct ad_error *error)
{
    if (error->status == AD_OK && plot_commit(plot, error) == AD_OK)
        result_commit(csv, error);
    plot_abandon(plot);
    result_abandon(csv);
    return error->status;
}
