/* Writes the field of a model on a grid as CSV, run file and picture (field.h). */
#include "field.h"

#include <math.h>

static void name(const struct field *f, size_t k, char text[32])
{
    phys_ode_component(&f->ode, k, text, 32);
}

void field_write_csv(const void *context, FILE *out)
{
    const struct field *f = context;
    char text[32];
    for (size_t k = 0; k < f->states; k++)
        fprintf(out, "%s,", (name(f, k, text), text));
    for (size_t k = 0; k < f->states; k++)
        fprintf(out, "d%sdt,", (name(f, k, text), text));
    fputs("H\n", out);
    for (size_t i = 0; i < f->samples; i++) {
        for (size_t k = 0; k < 2 * f->states; k++)
            fprintf(out, "%.17g,", f->x[k * f->samples + i]);
        fprintf(out, isnan(f->H[i]) ? "\n" : "%.17g\n", f->H[i]);
    }
}

enum ad_status field_write_file(const void *context, phys_hdf5 *file, struct ad_error *error)
{
    const struct field *f = context;
    size_t shape[] = {f->states, f->n, f->n};
    phys_hdf5_write(file, "state", AD_F64, 3, shape, f->x);
    phys_hdf5_write(file, "rate", AD_F64, 3, shape, f->rate);
    phys_hdf5_text(file, "state", "axes", "component, row, column of the grid");
    phys_hdf5_text(file, "rate", "axes", "component, row, column of the grid");
    if (f->ode.energy)
        phys_hdf5_write(file, "H", AD_F64, 2, shape + 1, f->H);
    return error->status;
}

/* ---- the picture: levels of H, and the field ---- */

enum { ARROWS = 21, LEVELS = 16 };

static void write_levels(const struct field *f, FILE *out)
{
    const double *x = f->x + f->plane.across * f->samples, *y = f->x + f->plane.up * f->samples;
    for (size_t i = 0; i < f->samples; i++)
        fprintf(out, "%.9g %.9g %.9g\n%s", x[i], y[i], f->H[i], (i + 1) % f->n ? "" : "\n");
    fputs("\n\n", out);
}

enum ad_status field_picture(const void *context, struct plot *plot, struct ad_error *error)
{
    const struct field *f = context;
    const char *unit = hnn_model_noted(f->model, "unit");
    struct layout layout = {
        .width = 560, .height = 500, .room = {0.14, f->ode.energy ? 0.82 : 0.97, 0.12, 0.92}};
    struct figure figure;
    char across[32], up[32];
    name(f, f->plane.across, across);
    name(f, f->plane.up, up);
    if (f->ode.energy) {
        write_levels(f, plot->data);
        fprintf(plot->script,
                "set contour base\nset cblabel 'H'\nset cntrparam levels auto %d\n"
                "unset surface\nset table $levels\nsplot data index 0 using 1:2:3\nunset table\n"
                "set palette defined (0 '#0072b2', 0.5 '#8aa9a0', 1 '#d9a441')\n",
                LEVELS);
    }
    figure_begin(&figure, plot, &layout);
    figure_panel(&figure,
                 &(struct panel){.title = f->ode.energy ? "contours of H, and the vector field"
                                                        : "the vector field",
                                 .across = {across, unit, f->plane.x, 0},
                                 .up = {up, unit, f->plane.y, 0}});
    if (f->ode.energy)
        figure_element(&figure, "$levels using 1:2:3 with lines lw 1.6 palette");
    figure_element(&figure,
                   "data index %d using 1:2:3:4 with vectors head size screen 0.012,20 filled lw "
                   "0.9 lc rgb '#707070'",
                   f->ode.energy ? 1 : 0);
    figure_end(&figure);
    return field_arrows(f->model, &f->plane, ARROWS, plot->data, error);
}
