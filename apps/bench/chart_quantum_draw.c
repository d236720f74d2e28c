/* The picture of chart quantum: a panel a problem, seconds against error. */
#include "chart_quantum.h"

static const struct style {
    const char *colour;
    int mark;
} styles[QUANTUM_WAYS] = {{"#8fc7e8", 6}, {"#c77dbb", 4}, {"#0b4f8a", 7},
                          {"#e8743b", 4}, {"#b8261b", 5}, {"#4e9a37", 9}};

/* A block a curve: error, seconds. */
static void write_data(const struct quantum_curves *curves, FILE *out)
{
    for (size_t p = 0; p < QUANTUM_PROBLEMS; p++)
        for (size_t w = 0; w < QUANTUM_WAYS; w++) {
            fprintf(out, "# %s, %s\n", quantum_problems[p].name, quantum_ways[w].name);
            for (size_t k = 0; k < curves->at[p][w].n; k++)
                fprintf(out, "%.6g %.6g\n", curves->at[p][w].point[k].error,
                        curves->at[p][w].point[k].seconds);
            if (curves->at[p][w].n == 0) /* gnuplot counts blocks that are there */
                fputs("NaN NaN\n", out);
            fputs("\n\n", out);
        }
}

void chart_quantum_draw(const struct quantum_curves *curves, struct plot *plot)
{
    FILE *out = plot->script;
    write_data(curves, plot->data);
    fputs(
        "set border 3 lc rgb '#606060'\nset tics nomirror\nset logscale xy\nset format '10^{%T}'\n"
        "set xrange [2:1e-14] noextend\nset xtics ('1' 1, '10^{-4}' 1e-4, '10^{-8}' 1e-8, "
        "'10^{-12}' 1e-12)\nset yrange [1e-4:10]\nset grid lc rgb "
        "'#e4e4e4'\n"
        "set multiplot layout 1,3\nset xlabel 'error'\n",
        out);
    for (size_t p = 0; p < QUANTUM_PROBLEMS; p++) {
        fprintf(out, "set title '%s'\nset ylabel '%s'\n", quantum_problems[p].title,
                p ? "" : "seconds, building included");
        fputs(p == 1 ? "set key bottom right samplen 1.5\nplot " : "unset key\nplot ", out);
        for (size_t w = 0; w < QUANTUM_WAYS; w++)
            fprintf(out,
                    "data index %zu using 1:2 with linespoints lw 1.8 pt %d ps 0.8 lc rgb '%s' "
                    "title '%s'%s",
                    p * QUANTUM_WAYS + w, styles[w].mark, styles[w].colour, quantum_ways[w].name,
                    w + 1 < QUANTUM_WAYS ? ", \\\n    " : "\n");
    }
    fputs("unset multiplot\n", out);
}
