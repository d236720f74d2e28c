/* Whether a Jacobian is computed forward, by columns that share no row, or backward, by rows that
   share no column. Where y reads a variable through gathers and other views alone, rows share its
   columns but not the copies (observations that see one camera): backward, the derivatives by the
   copies take a run for each row of an observation, and add up to those by the variable. */
#include "autodiff/ascending.h"
#include "autodiff/free.h"
#include "jacobian.h"

#include <stdlib.h>
#include <string.h>

enum { VIEWED = 1, OTHERWISE = 2 };

/* How y reads each node up to it. */
static void find_readings(ad_var y, uint8_t *read)
{
    read[y.id] = OTHERWISE;
    for (uint32_t id = y.id; id > 0; id--) {
        const struct node *n = node_at(y.tape, id);
        for (size_t k = 0; read[id] && k < n_inputs(y.tape, n); k++)
            read[input_of(y.tape, n, k)] |= ad_is_view(n) ? VIEWED : OTHERWISE;
    }
}

/* The columns of the matrix that a node copies, from those of its operand. */
static uint32_t *copied_columns(const ad_tape *tape, const struct node *n, const uint32_t *of)
{
    const struct elements at = ad_viewed_elements(tape, n);
    uint32_t *column = malloc(node_size(n) * sizeof *column), *to = column;
    for (size_t r = 0; column && r < n->rows; r++)
        for (size_t c = 0; c < n->cols; c++)
            *to++ = of[element_at(&at, r, c)];
    return column;
}

/* Of the variables; false where they have no copies of their own: one is no input, or given
   twice. */
static bool number_columns(ad_var y, size_t n, const ad_var x[], uint32_t **column)
{
    uint32_t first = 0;
    for (size_t k = 0; k < n; k++) {
        const size_t size = ad_rows(x[k]) * ad_cols(x[k]);
        if (x[k].id <= y.id) {
            uint32_t *own = malloc(size * sizeof *own);
            if (!own || column[x[k].id] || node_at(y.tape, x[k].id)->op != AD_OP_input) {
                free(own);
                return false;
            }
            for (uint32_t e = 0; e < size; e++)
                own[e] = first + e;
            column[x[k].id] = own;
        }
        first += (uint32_t)size;
    }
    return true;
}

/* Views that are read otherwise than by views take the place of the variables. False: there are
   none, or too many. */
static bool find_copies(struct directions *d, ad_var y, const uint8_t *read, uint32_t **column)
{
    size_t size = 0, max_x = 0, max_columns = 0;
    bool copied = false, done = true;
    for (uint32_t id = 1; done && id <= y.id; id++) {
        const struct node *n = node_at(y.tape, id);
        const uint32_t from = n->in[0];
        if (ad_is_view(n) && read[id] && column[from] && read[from] == VIEWED) {
            done = (column[id] = copied_columns(y.tape, n, column[from]));
            copied = true;
        }
        if (!done || !column[id] || !(read[id] & OTHERWISE))
            continue;
        done = size + node_size(n) < UINT32_MAX &&
               ad_reserve((void **)&d->x, d->n, &max_x, 1, sizeof *d->x) &&
               ad_reserve((void **)&d->column, size, &max_columns, node_size(n), sizeof *d->column);
        if (done) {
            memcpy(d->column + size, column[id], node_size(n) * sizeof *d->column);
            d->x[d->n++] = ad_at(y.tape, id);
            size += node_size(n);
        }
    }
    return done && copied && d->n;
}

/* The variables themselves, without copies. */
static bool take_variables(struct directions *d, size_t n, const ad_var x[])
{
    AD_FREE(d->x, d->column);
    ad_pattern_free(&d->computed);
    d->column = NULL;
    d->n = n;
    d->x = malloc((n + 1) * sizeof *d->x);
    if (d->x)
        memcpy(d->x, x, n * sizeof *x);
    return d->x;
}

static bool find_variables(struct directions *d, ad_var y, size_t n, const ad_var x[])
{
    uint8_t *read = calloc((size_t)y.id + 1, 1);
    uint32_t **column = calloc((size_t)y.id + 1, sizeof *column);
    bool copies = read && column && number_columns(y, n, x, column);
    if (copies) {
        find_readings(y, read);
        copies = find_copies(d, y, read, column);
    }
    for (uint32_t id = 0; column && id <= y.id; id++)
        free(column[id]);
    AD_FREE(column, read);
    return copies || take_variables(d, n, x);
}

/* The pattern by the variables, from that by their copies. */
static bool merge_copies(const struct pattern *by, const uint32_t *column, struct pattern *p)
{
    p->rows = by->rows;
    p->start = calloc(p->rows + 1, sizeof *p->start);
    p->col = malloc((by->start[by->rows] + 1) * sizeof *p->col);
    for (size_t r = 0; p->start && p->col && r < p->rows; r++) {
        uint32_t *row = p->col + p->start[r];
        const size_t n = by->start[r + 1] - by->start[r];
        size_t kept = 0;
        for (size_t k = 0; k < n; k++)
            row[k] = column[by->col[by->start[r] + k]];
        if (n)
            qsort(row, n, sizeof *row, ad_ascending_indices);
        for (size_t k = 0; k < n; k++)
            if (!k || row[k] != row[kept - 1])
                row[kept++] = row[k];
        p->start[r + 1] = p->start[r] + kept;
    }
    return p->start && p->col;
}

/* Takes the columns of p if they have fewer colours than those before. */
static bool try_columns(struct directions *d, const struct pattern *p, const struct pattern *t)
{
    uint32_t *colour = malloc((p->cols + 1) * sizeof *colour);
    size_t n = colour ? ad_colour_columns(p, t, d->colours - 1, colour) : 0;
    if (n && n < d->colours) {
        free(d->colour);
        d->colour = colour;
        d->colours = n;
        d->forward = p == &d->pattern;
    } else {
        free(colour);
    }
    return n;
}

bool ad_directions_choose(struct directions *d, ad_var y, size_t n, const ad_var x[])
{
    struct pattern t = {0};
    *d = (struct directions){.colours = SIZE_MAX};
    bool done = find_variables(d, y, n, x) && ad_pattern_find(&d->computed, y, d->n, d->x);
    if (done && !d->column) {
        d->pattern = d->computed;
        d->computed = (struct pattern){0};
    } else {
        done = done && merge_copies(&d->computed, d->column, &d->pattern);
        for (size_t k = 0; k < n; k++)
            d->pattern.cols += ad_rows(x[k]) * ad_cols(x[k]);
    }
    done = done && ad_pattern_transpose(&d->pattern, &t) && try_columns(d, &d->pattern, &t) &&
           try_columns(d, &t, &d->pattern);
    ad_pattern_free(&t);
    const size_t colours = d->colours;
    if (d->column)
        done = done && ad_pattern_transpose(&d->computed, &t) && try_columns(d, &t, &d->computed);
    ad_pattern_free(&t);
    return done && (!d->column || d->colours < colours || take_variables(d, n, x));
}

void ad_directions_free(struct directions *d)
{
    ad_pattern_free(&d->pattern);
    ad_pattern_free(&d->computed);
    AD_FREE(d->x, d->column, d->colour);
}
