/* Tiles one column wide. Rows picked by index lists are single numbers there; they are gathered
   into a contiguous buffer, so that one kernel call serves a tile instead of a row. Pair laws at
   one time are 1.4 (50 bodies) to 2.5 times (300) as fast. */
#include "exec.h"

enum { MOST_ROWS = 1024 }; /* of a tile, as tiles.c has it */

/* The cursors are passed by value: a store through char * might alias them, and they would be
   reloaded for each row. */
static void pack(enum ad_type type, struct cursor c, uint32_t rows, double *to)
{
    if (type == AD_F64)
        for (uint32_t r = 0; r < rows; r++)
            to[r] = *(const double *)(const void *)cursor_row(&c, r);
    else
        for (uint32_t r = 0; r < rows; r++)
            ((float *)(void *)to)[r] = *(const float *)(const void *)cursor_row(&c, r);
}

bool ad_run_column(const ad_program *p, const struct instruction *in, const struct tile *t)
{
    double room[3][MOST_ROWS];
    const void *from[3] = {NULL, NULL, NULL};
    const struct cursor o = cursor_at(p, &p->locs[in->loc[0]], t);
    if (t->rows > MOST_ROWS || o.list || o.step != p->element)
        return false;
    for (uint32_t k = 0; k < in->n_in; k++) {
        const struct loc *l = &p->locs[in->loc[1 + k]];
        const struct cursor c = cursor_at(p, l, t);
        bool number = l->cs == 0; /* and so the kernel was chosen */
        if (number && (c.list || c.step != 0))
            return false;
        from[k] = c.start;
        if (!number && (c.list || c.step != p->element)) {
            pack(p->type, c, t->rows, room[k]);
            from[k] = room[k];
        }
    }
    in->run(t->rows, o.start, from[0], from[1], from[2]);
    return true;
}

static void add_doubles(struct cursor to, struct cursor from, uint32_t rows, double sign)
{
    for (uint32_t r = 0; r < rows; r++)
        *(double *)(void *)cursor_row(&to, r) +=
            sign * *(const double *)(const void *)cursor_row(&from, r);
}

static void add_floats(struct cursor to, struct cursor from, uint32_t rows, float sign)
{
    for (uint32_t r = 0; r < rows; r++)
        *(float *)(void *)cursor_row(&to, r) +=
            sign * *(const float *)(const void *)cursor_row(&from, r);
}

void ad_add_column(const ad_program *p, const struct cursor *to, const struct cursor *from,
                   uint32_t rows, double sign)
{
    if (p->type == AD_F64)
        add_doubles(*to, *from, rows, sign);
    else
        add_floats(*to, *from, rows, (float)sign);
}
