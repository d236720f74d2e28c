/* Reads the Horizons tables of several bodies from one folder (horizons.h). Every file is opened
   once and read forward; its header decides whether its records are read. */
#include "autodiff/free.h"
#include "horizons_reader.h"

#include <ctype.h>
#include <dirent.h>
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

enum { NONE = -1 };

struct candidate { /* a table that some body may want */
    const char *file;
    struct phys_horizons table;
};

struct wanted {
    const char *body;
    enum horizons_match match;
    int candidate, rival;  /* NONE; a rival matches as well */
    struct ad_error error; /* of the file that bears the body's name */
};

struct search {
    const char *folder;
    struct ad_error *error;
    enum ad_status status;
    struct dirent **files;
    int n_files;
    char *list; /* of bodies; cut into words */
    struct wanted *wanted;
    size_t n;
    struct candidate *candidates;
    int n_candidates;
    char targets[160]; /* of the tables there are, for messages */
};

#define FAIL(s, code, ...) ((s)->status = ad_fail((s)->error, code, __VA_ARGS__), false)

static bool out_of_memory(struct search *s)
{
    return FAIL(s, AD_E_MEMORY, "%s: out of memory", s->folder);
}

/* ---- bodies ---- */

static char *trim(char *word)
{
    word += strspn(word, " \t");
    size_t n = strlen(word);
    while (n > 0 && isspace((unsigned char)word[n - 1]))
        n--;
    word[n] = '\0';
    return word;
}

static bool parse_bodies(struct search *s, const char *bodies)
{
    size_t commas = 0;
    for (const char *p = bodies; *p; p++)
        commas += *p == ',';
    s->list = strdup(bodies);
    s->wanted = calloc(commas + 1, sizeof *s->wanted);
    if (!s->list || !s->wanted)
        return out_of_memory(s);
    for (char *p = s->list, *comma; p; p = comma ? comma + 1 : NULL) {
        comma = strchr(p, ',');
        if (comma)
            *comma = '\0';
        char *body = trim(p);
        if (!*body)
            return FAIL(s, AD_E_ARGUMENT, "bodies '%s': expected names or ids between commas",
                        bodies);
        s->wanted[s->n++] = (struct wanted){.body = body, .candidate = NONE, .rival = NONE};
    }
    return true;
}

/* ---- files ---- */

/* A file without a header is not a table, which matters only if a body was looked for there. */
static void note_unreadable(struct search *s, const char *file, const struct ad_error *error)
{
    size_t stem = strcspn(file, ".");
    for (size_t k = 0; k < s->n; k++)
        if (strlen(s->wanted[k].body) == stem && strncasecmp(file, s->wanted[k].body, stem) == 0)
            s->wanted[k].error = *error;
}

static void note_target(struct search *s, const struct phys_horizons *table)
{
    size_t n = strlen(s->targets);
    snprintf(s->targets + n, sizeof s->targets - n, "%s%s", n ? ", " : "", table->target);
}

/* Assigns the candidate to all bodies that it matches better than their present table. */
static bool offer(struct search *s, const struct phys_horizons *table, int candidate)
{
    bool taken = false;
    for (size_t k = 0; k < s->n; k++) {
        struct wanted *w = &s->wanted[k];
        enum horizons_match m = phys_horizons_match(table, w->body);
        if (m == HORIZONS_OTHER || m < w->match)
            continue;
        taken = true;
        w->rival = m == w->match ? w->candidate : NONE;
        w->candidate = candidate;
        w->match = m;
    }
    return taken;
}

static bool read_file(struct search *s, const char *file, const char *path)
{
    struct ad_error header = {0};
    struct horizons_reader r;
    struct candidate *candidate = &s->candidates[s->n_candidates];
    candidate->file = file;
    if (!phys_horizons_open(&r, path, &candidate->table, &header)) {
        note_unreadable(s, file, &header);
        phys_horizons_close(&r);
        return true;
    }
    r.error = s->error;
    note_target(s, &candidate->table);
    if (offer(s, &candidate->table, s->n_candidates)) {
        s->n_candidates++;
        phys_horizons_rows(&r);
    }
    s->status = phys_horizons_close(&r);
    return s->status == AD_OK;
}

static bool read_files(struct search *s)
{
    for (int k = 0; k < s->n_files; k++) {
        const char *file = s->files[k]->d_name;
        struct stat status;
        size_t size = strlen(s->folder) + strlen(file) + 2;
        char *path = malloc(size);
        if (!path)
            return out_of_memory(s);
        snprintf(path, size, "%s/%s", s->folder, file);
        bool usable =
            stat(path, &status) == 0 && (S_ISREG(status.st_mode) || S_ISFIFO(status.st_mode));
        bool read = !usable || read_file(s, file, path);
        free(path);
        if (!read)
            return false;
    }
    return true;
}

static int is_visible(const struct dirent *entry) { return entry->d_name[0] != '.'; }

/* In alphabetical order, so that messages do not depend on the file system. */
static bool list_files(struct search *s)
{
    s->n_files = scandir(s->folder, &s->files, is_visible, alphasort);
    if (s->n_files < 0) {
        s->n_files = 0;
        return FAIL(s, AD_E_IO, "%s: cannot be read: %s; expected a folder of Horizons tables",
                    s->folder, strerror(errno));
    }
    s->candidates = calloc((size_t)s->n_files + 1, sizeof *s->candidates);
    return s->candidates || out_of_memory(s);
}

/* ---- results ---- */

static bool check_found(struct search *s)
{
    for (size_t k = 0; k < s->n; k++) {
        const struct wanted *w = &s->wanted[k];
        if (w->candidate == NONE && w->error.status != AD_OK)
            return FAIL(s, w->error.status, "%s", w->error.message);
        if (w->candidate == NONE)
            return FAIL(s, AD_E_INPUT, "%s: expected a table of '%s', found %s", s->folder, w->body,
                        *s->targets ? s->targets : "no tables");
        if (w->rival != NONE)
            return FAIL(s, AD_E_INPUT, "%s: expected one table of %s, found %s and %s", s->folder,
                        w->body, s->candidates[w->rival].file, s->candidates[w->candidate].file);
        for (size_t j = 0; j < k; j++)
            if (s->wanted[j].candidate == w->candidate)
                return FAIL(s, AD_E_ARGUMENT, "bodies '%s' and '%s' are one, in %s/%s",
                            s->wanted[j].body, w->body, s->folder,
                            s->candidates[w->candidate].file);
    }
    return true;
}

static bool agree(struct search *s, const struct candidate *a, const struct candidate *b)
{
    const struct phys_horizons *x = &a->table, *y = &b->table;
    if (strcmp(x->center, y->center) != 0)
        return FAIL(s, AD_E_INPUT, "%s: %s and %s disagree in the centre: '%s' and '%s'", s->folder,
                    a->file, b->file, x->center, y->center);
    if (strcmp(x->frame, y->frame) != 0)
        return FAIL(s, AD_E_INPUT, "%s: %s and %s disagree in the frame: '%s' and '%s'", s->folder,
                    a->file, b->file, x->frame, y->frame);
    if (x->n != y->n)
        return FAIL(s, AD_E_INPUT, "%s: %s and %s disagree in the epochs: %zu and %zu of them",
                    s->folder, a->file, b->file, x->n, y->n);
    for (size_t i = 0; i < x->n; i++)
        if (fabs(x->jd[i] - y->jd[i]) > 1e-8)
            return FAIL(s, AD_E_INPUT,
                        "%s: %s and %s disagree in the epochs: number %zu is JD %.9f and %.9f",
                        s->folder, a->file, b->file, i, x->jd[i], y->jd[i]);
    return true;
}

/* Hands the tables over, in the order of the bodies. */
static bool take_tables(struct search *s, size_t *n, struct phys_horizons **tables)
{
    struct phys_horizons *array = malloc(s->n * sizeof *array);
    if (!array)
        return out_of_memory(s);
    for (size_t k = 0; k < s->n; k++) {
        struct candidate *candidate = &s->candidates[s->wanted[k].candidate];
        array[k] = candidate->table;
        candidate->table = (struct phys_horizons){0};
    }
    *n = s->n;
    *tables = array;
    return true;
}

static bool check_agreement(struct search *s)
{
    for (size_t k = 1; k < s->n; k++)
        if (!agree(s, &s->candidates[s->wanted[0].candidate],
                   &s->candidates[s->wanted[k].candidate]))
            return false;
    return true;
}

static void release(struct search *s)
{
    for (int k = 0; k < s->n_candidates; k++)
        phys_horizons_free(&s->candidates[k].table);
    for (int k = 0; k < s->n_files; k++)
        free(s->files[k]);
    AD_FREE(s->files, s->candidates, s->wanted, s->list);
}

enum ad_status phys_horizons_folder(const char *folder, const char *bodies, size_t *n,
                                    struct phys_horizons **tables, struct ad_error *error)
{
    struct search s = {.folder = folder, .error = error};
    if (AD_LACKS(error, folder, bodies, n, tables))
        return error->status;
    if (parse_bodies(&s, bodies) && list_files(&s) && read_files(&s) && check_found(&s) &&
        check_agreement(&s))
        take_tables(&s, n, tables);
    release(&s);
    return s.status;
}
