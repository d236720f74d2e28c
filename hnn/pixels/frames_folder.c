/* Reads frames from a folder of pictures, or from its subfolders, one per trajectory. */
#include "frames.h"
#include "physics/io/grow.h"

#include <ctype.h>
#include <dirent.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

/* Names in a folder, with the folder before them, in their order. */
struct names {
    size_t n;
    char **name;
};

static void names_free(struct names *names)
{
    for (size_t k = 0; k < names->n; k++)
        free(names->name[k]);
    free(names->name);
    *names = (struct names){0};
}

/* Runs of digits compare as numbers: frame2 comes before frame10. */
static int by_number(const void *a, const void *b)
{
    const char *p = *(char *const *)a, *q = *(char *const *)b;
    while (*p && *q) {
        if (isdigit((unsigned char)*p) && isdigit((unsigned char)*q)) {
            p += strspn(p, "0");
            q += strspn(q, "0");
            size_t m = strspn(p, "0123456789"), n = strspn(q, "0123456789");
            int order = m != n ? (m < n ? -1 : 1) : strncmp(p, q, m);
            if (order)
                return order;
            p += m, q += n;
        } else if (*p != *q) {
            break;
        } else {
            p++, q++;
        }
    }
    return (unsigned char)*p - (unsigned char)*q;
}

static bool is_folder(const char *path)
{
    struct stat status;
    return stat(path, &status) == 0 && S_ISDIR(status.st_mode);
}

static bool is_picture(const char *path)
{
    const char *dot = strrchr(path, '.');
    return dot && (strcasecmp(dot, ".png") == 0 || strcasecmp(dot, ".pgm") == 0);
}

static bool add(struct names *names, char *path)
{
    bool room = phys_grow(&names->name, names->n, sizeof *names->name);
    if (room)
        names->name[names->n++] = path;
    return room;
}

/* Everything in a folder that `wanted` holds for. */
static enum ad_status list(const char *folder, bool (*wanted)(const char *), struct names *names,
                           struct ad_error *error)
{
    *names = (struct names){0};
    DIR *directory = opendir(folder);
    if (!directory)
        return ad_fail(error, AD_E_IO, "%s: cannot be read: %s", folder, strerror(errno));
    for (const struct dirent *entry; error->status == AD_OK && (entry = readdir(directory));) {
        char *path =
            *entry->d_name == '.' ? NULL : malloc(strlen(folder) + strlen(entry->d_name) + 2);
        if (path)
            stpcpy(stpcpy(stpcpy(path, folder), "/"), entry->d_name);
        else if (*entry->d_name != '.')
            ad_fail(error, AD_E_MEMORY, "%s: out of memory", folder);
        if (path && !(wanted(path) && add(names, path)))
            free(path);
    }
    closedir(directory);
    if (names->n)
        qsort(names->name, names->n, sizeof *names->name, by_number);
    return error->status;
}

/* Reads one picture to its place. The first one determines the size of all. */
static enum ad_status read_frame(const char *file, const char *first, const struct hnn_frames *f,
                                 float *pixels, struct ad_error *error)
{
    struct hnn_image image;
    if (hnn_image_read(file, &image, error) != AD_OK)
        return error->status;
    if (image.height != f->height || image.width != f->width)
        ad_fail(error, AD_E_INPUT, "%s: expected %zu x %zu pixels as in %s, found %zu x %zu", file,
                f->height, f->width, first, image.height, image.width);
    for (size_t k = 0; k < f->height * f->width && error->status == AD_OK; k++)
        pixels[k] = (float)image.pixels[k] / 255;
    free(image.pixels);
    return error->status;
}

static enum ad_status read_trajectory(const char *folder, const struct names *files, size_t i,
                                      const char *first, const struct hnn_frames_share *share,
                                      struct hnn_frames *f, struct ad_error *error)
{
    size_t area = f->height * f->width;
    if (files->n != f->frames)
        return ad_fail(error, AD_E_INPUT,
                       "%s: expected %zu pictures as in the first folder, found %zu", folder,
                       f->frames, files->n);
    for (size_t k = 0; k < files->n && hnn_frames_wanted(share, i); k++)
        if (read_frame(files->name[k], first, f, f->pixels + (i * f->frames + k) * area, error) !=
            AD_OK)
            return error->status;
    return AD_OK;
}

/* Sizes from the first folder and its first picture. */
static enum ad_status measure(const char *folder, const struct names *files, size_t trajectories,
                              struct hnn_frames_share *share, struct hnn_frames *f,
                              struct ad_error *error)
{
    struct hnn_image image;
    if (files->n < 3)
        return ad_fail(error, AD_E_INPUT,
                       "%s: expected three or more pictures, .png or .pgm, found %zu", folder,
                       files->n);
    if (hnn_image_read(files->name[0], &image, error) != AD_OK)
        return error->status;
    free(image.pixels);
    const size_t size[] = {trajectories, files->n, image.height, image.width};
    return hnn_frames_begin(f, size, share, error);
}

static enum ad_status read_folders(const struct names *folders, struct hnn_frames_share *share,
                                   struct hnn_frames *f, struct ad_error *error)
{
    struct names first = {0};
    for (size_t i = 0; i < folders->n && error->status == AD_OK; i++) {
        struct names files;
        const char *folder = folders->name[i];
        if (list(folder, is_picture, &files, error) == AD_OK &&
            (i > 0 || measure(folder, &files, folders->n, share, f, error) == AD_OK))
            read_trajectory(folder, &files, i, i ? first.name[0] : files.name[0], share, f, error);
        if (i == 0)
            first = files;
        else
            names_free(&files);
    }
    names_free(&first);
    return error->status;
}

enum ad_status hnn_frames_read_folder(const char *folder, struct hnn_frames_share *share,
                                      struct hnn_frames *f, struct ad_error *error)
{
    struct names folders;
    char *itself = (char *)folder;
    if (list(folder, is_folder, &folders, error) == AD_OK)
        read_folders(folders.n ? &folders : &(struct names){1, &itself}, share, f, error);
    names_free(&folders);
    return error->status;
}
