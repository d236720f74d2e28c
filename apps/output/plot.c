/* Pictures by gnuplot (plot.h): commands and data go to temporary files, gnuplot writes a third. */
#include "plot.h"
#include "autodiff/free.h"
#include "apps/interrupt.h"
#include "autodiff/native/process.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

static const struct plot_format {
    const char *extension, *terminal, *options; /* the size goes between the two */
    double pixels;
    bool animated;
    const char *end; /* its last bytes, but for newlines */
} formats[] = {
    {".svg", "svg", "font 'Helvetica,13' background 'white'", 1, false, "</svg>"},
    {".png", "pngcairo", "font 'Helvetica,13' fontscale 1.2", 1.5, false, "IEND\xae\x42\x60\x82"},
    {".gif", "gif animate delay 8 loop 0", "", 1, true, ";"},
};

static const struct plot_format *format_of(const char *target)
{
    const char *dot = strrchr(target, '.');
    for (size_t k = 0; dot && k < sizeof formats / sizeof *formats; k++)
        if (strcasecmp(dot, formats[k].extension) == 0)
            return &formats[k];
    return NULL;
}

/* Begins the file of the target's name and another extension behind it: fig.svg.dat. */
static enum ad_status begin_beside(struct phys_atomic_file *file, const char *target,
                                   const char *extension, struct ad_error *error)
{
    char *name = text_joined(target, extension);
    if (!name)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    enum ad_status status = phys_atomic_file_begin(file, name, error);
    free(name);
    return status;
}

enum ad_status plot_begin(struct plot *plot, const char *target, struct ad_error *error)
{
    const struct plot_format *format = format_of(target);
    *plot = (struct plot){.width = 1040, .height = 440, .format = format};
    if (!format)
        return ad_fail(error, AD_E_ARGUMENT,
                       "--plot: expected a name ending in .svg, .png, .gif or .html, got '%s'",
                       target);
    plot->animated = format->animated;
    if (phys_atomic_file_begin(&plot->picture_file, target, error) != AD_OK ||
        begin_beside(&plot->data_file, target, ".dat", error) != AD_OK ||
        begin_beside(&plot->script_file, target, ".gp", error) != AD_OK) {
        plot_abandon(plot);
        return error->status;
    }
    plot->data = fopen(plot->data_file.temporary, "w");
    plot->script = open_memstream(&plot->script_text, &plot->script_length);
    if (plot->data && plot->script)
        return AD_OK;
    plot_abandon(plot);
    return ad_fail(error, AD_E_IO, "%s: cannot be written", target);
}

/* Closes an output stream; false if a write failed. */
static bool close_stream(FILE **stream)
{
    bool written = *stream && !ferror(*stream);
    if (*stream && fclose(*stream) != 0)
        written = false;
    *stream = NULL;
    return written;
}

void plot_abandon(struct plot *plot)
{
    close_stream(&plot->data);
    close_stream(&plot->script);
    free(plot->script_text);
    phys_atomic_file_abandon(&plot->picture_file);
    phys_atomic_file_abandon(&plot->data_file);
    phys_atomic_file_abandon(&plot->script_file);
    *plot = (struct plot){0};
}

/* The script file, for a data file and a picture of these names. */
static bool write_script(const struct plot *plot, const char *data, const char *picture)
{
    FILE *out = fopen(plot->script_file.temporary, "w");
    if (!out)
        return false;
    fputs("data = ", out);
    quote_gnuplot_file(out, data);
    fputs("\npicture = ", out);
    quote_gnuplot_file(out, picture);
    fputc('\n', out);
    const struct plot_format *format = plot->format;
    fprintf(out,
            "set terminal %s size %.0f,%.0f %s\nset output picture\n"
            "set border 3 lc rgb '#606060'\nset tics nomirror\n",
            format->terminal, plot->width * format->pixels, plot->height * format->pixels,
            format->options);
    fwrite(plot->script_text, 1, plot->script_length, out);
    return close_stream(&out);
}

enum { NOT_INSTALLED = 127 };

/* Starts gnuplot on a script, both its outputs in a pipe; an error number, or 0. */
static int start_gnuplot(const char *script, pid_t *child, FILE **output)
{
    int ends[2];
    *output = NULL;
    if (pipe(ends) != 0)
        return errno;
    fcntl(ends[0], F_SETFD, FD_CLOEXEC);
    fcntl(ends[1], F_SETFD, FD_CLOEXEC);
    int reason =
        interrupt_start_program((const char *const[]){"gnuplot", script, NULL}, ends[1], child);
    close(ends[1]);
    if (reason != 0 || !(*output = fdopen(ends[0], "r"))) /* it runs, unheard */
        close(ends[0]);
    return reason;
}

/* Runs gnuplot on the script: its exit status or, if it did not get that far, -1; and its first
   line. */
static int run_gnuplot(const struct plot *plot, char *line, int size)
{
    char *script = quote_path(plot->script_file.temporary), rest[256];
    FILE *output;
    pid_t child;
    int reason = script ? start_gnuplot(script, &child, &output) : ENOMEM;
    free(script);
    *line = '\0';
    if (reason != 0) {
        snprintf(line, (size_t)size, "%s", strerror(reason));
        return reason == ENOENT ? NOT_INSTALLED : -1;
    }
    for (char *to = line; output && fgets(to, to == line ? size : (int)sizeof rest, output);)
        if (strspn(to, " \t\r\n^") != strlen(to))
            to = rest;
    line[strcspn(line, "\n")] = '\0';
    if (output)
        fclose(output);
    int status = ad_process_wait(child);
    interrupt_forget();
    return status;
}

/* On a full disk gnuplot reports nothing and leaves a partial picture. */
static bool is_whole(const struct plot *plot)
{
    enum { TAIL = 16 };
    char tail[TAIL] = {0};
    const size_t length = strlen(plot->format->end);
    size_t n = 0;
    FILE *in = fopen(plot->picture_file.temporary, "rb");
    if (in && fseek(in, -TAIL, SEEK_END) == 0)
        n = fread(tail, 1, TAIL, in);
    if (in)
        fclose(in);
    while (n > 0 && tail[n - 1] == '\n')
        n--;
    return n >= length && memcmp(tail + n - length, plot->format->end, length) == 0;
}

/* Without gnuplot: data and commands, under names of their own. */
static enum ad_status keep(struct plot *plot, struct ad_error *error)
{
    char *data = strdup(plot->data_file.target), *script = strdup(plot->script_file.target);
    enum ad_status status = AD_OK;
    if (!data || !script || !write_script(plot, data, plot->picture_file.target))
        status = ad_fail(error, AD_E_IO, "%s: cannot be written", plot->script_file.target);
    if (status == AD_OK)
        status = interrupt_commit(&plot->data_file, error);
    if (status == AD_OK)
        status = interrupt_commit(&plot->script_file, error);
    if (status == AD_OK) {
        fputs("gnuplot is not installed: wrote ", stderr);
        quote_terminal(stderr, data);
        fputs(" and ", stderr);
        quote_terminal(stderr, script);
        fputs("; draw with: gnuplot ", stderr);
        quote_terminal(stderr, script);
        fputc('\n', stderr);
    }
    AD_FREE(data, script);
    return status;
}

enum ad_status plot_commit(struct plot *plot, struct ad_error *error)
{
    if (!plot->picture_file.target)
        return AD_OK;
    enum ad_status status = AD_OK;
    char line[160];
    const char *picture = plot->picture_file.target;
    if (!close_stream(&plot->data) || !close_stream(&plot->script) ||
        !write_script(plot, plot->data_file.temporary, plot->picture_file.temporary)) {
        status = ad_fail(error, AD_E_IO, "%s: its data cannot be written", picture);
    } else {
        int exit = run_gnuplot(plot, line, (int)sizeof line);
        if (exit == NOT_INSTALLED)
            status = keep(plot, error);
        else if (exit != 0)
            status = ad_fail(error, AD_E_IO, "%s: gnuplot failed: %s", picture, line);
        else if (!is_whole(plot))
            status = ad_fail(error, AD_E_IO,
                             "%s: cannot be written: gnuplot wrote only a part; is the disk full?",
                             picture);
        else
            status = interrupt_commit(&plot->picture_file, error);
    }
    plot_abandon(plot);
    return status;
}
