/* The texts of a picture (picture_text.h). */
#include "picture_text.h"
#include "shell.h"

#include <glob.h>
#include <math.h>
#include <setjmp.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

enum { MOST = 1000, SHOWN = 80 };

static const double slack = 1.5; /* pixels by which boxes may meet: ascenders are rarely full */

struct box {
    double left, right, top, bottom;
    char text[SHOWN];
};

/* Of a character in units of the font's size. */
static double width_of(unsigned char c)
{
    if ((c & 0xc0) == 0x80) /* the rest of a UTF-8 character */
        return 0;
    if (c == ' ' || strchr("ijl|.,:;!'/\\I[]ft", c))
        return 0.27;
    if (strchr("()-rs*\"`", c))
        return c == 's' ? 0.5 : 0.33;
    if (strchr("mMW@%", c))
        return 0.86;
    return c >= 'A' && c <= 'Z' ? 0.68 : 0.556;
}

static double number_after(const char *from, const char *end, const char *key, double otherwise)
{
    const char *at = strstr(from, key);
    return at && at < end ? strtod(at + strlen(key), NULL) : otherwise;
}

/* Adds the text between tags up to `end` to a box, and returns its width. */
static double read_text(const char *from, const char *end, double size, char shown[SHOWN])
{
    double width = 0, font = size;
    size_t n = 0;
    for (const char *c = from; c < end; c++) {
        if (*c == '<') {
            const char *close = strchr(c, '>');
            font = number_after(c, close, "font-size=\"", font);
            c = close;
            continue;
        }
        if (*c == '&')
            c = strchr(c, ';'); /* one character */
        width += font * width_of((unsigned char)*c);
        if (n + 1 < SHOWN)
            shown[n++] = *c;
    }
    shown[n] = '\0';
    return width;
}

/* The box of the group that begins at `group`, whose text is between `text` and `end`. */
static struct box read_box(const char *group, const char *text, const char *end)
{
    struct box b;
    double x = 0, y = 0, size = number_after(group, text, "font-size=\"", 12);
    double turn = number_after(group, text, "rotate(", 0);
    sscanf(strstr(group, "translate(") + strlen("translate("), "%lf,%lf", &x, &y);
    double width = read_text(text, end, size, b.text);
    const char *anchor = strstr(group, "text-anchor=\"");
    bool last = strncmp(anchor + 13, "end", 3) == 0, middle = strncmp(anchor + 13, "mid", 3) == 0;
    double from = last ? -width : middle ? -width / 2 : 0, to = from + width;
    double c = cos(turn * M_PI / 180), s = sin(turn * M_PI / 180);
    const double along[] = {from, to}, above[] = {-0.72 * size, 0.2 * size};
    b.left = b.top = INFINITY;
    b.right = b.bottom = -INFINITY;
    for (int k = 0; k < 4; k++) {
        double px = x + c * along[k % 2] - s * above[k / 2];
        double py = y + s * along[k % 2] + c * above[k / 2];
        b.left = fmin(b.left, px);
        b.right = fmax(b.right, px);
        b.top = fmin(b.top, py);
        b.bottom = fmax(b.bottom, py);
    }
    return b;
}

static bool overlap(const struct box *a, const struct box *b)
{
    return a->left + slack < b->right && b->left + slack < a->right && a->top + slack < b->bottom &&
           b->top + slack < a->bottom;
}

size_t picture_text_faults(const char *svg, char what[400], size_t *texts)
{
    static struct box box[MOST];
    double width = 0, height = 0;
    size_t n = 0, faults = 0;
    sscanf(strstr(svg, "viewBox=\"0 0 ") + 13, "%lf %lf", &width, &height);
    for (const char *group = svg; (group = strstr(group, "<g transform=\"translate("));) {
        const char *text = strstr(group, "<text>"), *end = text ? strstr(text, "</text>") : NULL;
        if (!end)
            break;
        assert_true(n < MOST);
        box[n] = read_box(group, text + 6, end);
        if (strspn(box[n].text, " ") != strlen(box[n].text))
            n++;
        group = end;
    }
    *texts = n;
    for (size_t i = 0; i < n; i++) {
        const struct box *a = &box[i];
        if ((a->left < -slack || a->top < -slack || a->right > width + slack ||
             a->bottom > height + slack) &&
            faults++ == 0)
            snprintf(what, 400, "'%s' leaves the picture: %.0f to %.0f across, %.0f to %.0f down",
                     a->text, a->left, a->right, a->top, a->bottom);
        for (size_t j = 0; j < i; j++)
            if (overlap(a, &box[j]) && faults++ == 0)
                snprintf(what, 400, "'%s' and '%s' overlap at %.0f, %.0f", a->text, box[j].text,
                         fmax(a->left, box[j].left), fmax(a->top, box[j].top));
    }
    return faults;
}

size_t picture_text_is_apart(const char *file)
{
    char what[400] = "";
    size_t texts = 0;
    FILE *in = fopen(*file == '/' ? file : shell_path(file), "rb");
    assert_non_null(in);
    fseek(in, 0, SEEK_END);
    size_t size = (size_t)ftell(in);
    char *svg = malloc(size + 1);
    assert_non_null(svg);
    rewind(in);
    assert_int_equal(fread(svg, 1, size, in), size);
    svg[size] = '\0';
    fclose(in);
    size_t faults = picture_text_faults(svg, what, &texts);
    free(svg);
    if (faults)
        fail_msg("%s: %zu of %zu texts: %s", file, faults, texts, what);
    return texts;
}

void picture_texts_are_apart(void)
{
    glob_t found;
    if (glob(shell_path("*.svg"), 0, NULL, &found) == 0)
        for (size_t k = 0; k < found.gl_pathc; k++)
            picture_text_is_apart(found.gl_pathv[k]);
    globfree(&found);
}
