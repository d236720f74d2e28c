/* Horizons tables as text (horizons_text.h). */
#include "horizons_text.h"

#include "tests/close.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const struct layout plain_layout = {.form = FORM_LABELLED, .type = 3, .units = "KM-S"};

static const char stars[] =
    "*******************************************************************************\n";

/* Numerical Recipes' 64-bit congruential generator, upper bits. */
static double uniform(uint64_t *seed)
{
    *seed = *seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(*seed >> 11) * 0x1p-53 * 2 - 1;
}

struct states random_states(const char *target, unsigned seed)
{
    struct states s = {.target = target, .first = 2459774.5, .step = 0.25};
    uint64_t random = seed;
    for (int i = 0; i < STATES; i++)
        for (int k = 0; k < 6; k++)
            s.state[i][k] = uniform(&random) * (k < 3 ? 2.3e11 : 4.7e4);
    return s;
}

static void print_header(FILE *out, const struct states *states, const struct layout *layout)
{
    static const char *const formats[] = {"1 (position only)", "2 (position and velocity)",
                                          "3 (position, velocity, LT, range, range-rate)"};
    fputs(stars, out);
    fputs(" Revised: June 21, 2016                 Planet\n\n"
          "  GM 1-sigma (km^3/s^2) = +- 0.00028    GM (km^3/s^2)         = 42828.375214\n",
          out);
    fprintf(out, "%sEphemeris / API_USER Sun Jan 15 21:37:52 2023 Pasadena, USA  / Horizons\n%s",
            stars, stars);
    fprintf(out, "Target body name: %-32s{source: mar097}\n", states->target);
    fputs("Center body name: Solar System Barycenter (0)     {source: DE441}\n"
          "Center-site name: BODY CENTER\n",
          out);
    fprintf(out, "%sOutput units    : %-20s\nOutput type     : GEOMETRIC cartesian states\n", stars,
            layout->units);
    fprintf(out, "Output format   : %s\n", formats[layout->type - 1]);
    fputs(layout->old ? "Reference frame : ICRF/J2000.0\n"
                        "Coordinate systm: Ecliptic and Mean Equinox of Reference Epoch\n"
                      : "Reference frame : Ecliptic of J2000.0\n",
          out);
    fputs(stars, out);
}

static void print_columns(FILE *out, const struct layout *layout)
{
    static const char *const lines[] = {"   X     Y     Z\n", "   VX    VY    VZ\n",
                                        "   LT    RG    RR\n"};
    static const char *const csv[] = {"X, Y, Z,", " VX, VY, VZ,", " LT, RG, RR,"};
    const char *epoch = layout->old ? "JDCT" : "JDTDB";
    if (layout->form == FORM_CSV) {
        fprintf(out, "%12s , %s, %s", epoch, layout->old ? "  " : "Calendar Date (TDB)",
                layout->delta_t ? "delta-T, " : "");
        for (int k = 0; k < layout->type; k++)
            fputs(csv[k], out);
        fputc('\n', out);
    } else {
        fprintf(out, "%s\n", epoch);
        for (int k = 0; k < layout->type; k++)
            fputs(lines[k], out);
    }
    fputs(stars, out);
}

static void print_values(FILE *out, const struct layout *layout, const double values[9])
{
    static const char *const labels[] = {
        "X =", "Y =", "Z =", "VX=", "VY=", "VZ=", "LT=", "RG=", "RR="};
    for (int k = 0; k < 3 * layout->type; k++) {
        if (layout->form == FORM_CSV)
            fprintf(out, " %22.15E,", values[k]);
        else
            fprintf(out, " %s%22.15E%s", layout->form == FORM_BARE ? " " : labels[k], values[k],
                    k % 3 == 2 ? "\n" : "");
    }
    if (layout->form == FORM_CSV)
        fputc('\n', out);
}

static void print_record(FILE *out, const struct states *states, int i, const struct layout *layout)
{
    bool au = layout->units[0] == 'A', day = strstr(layout->units, "-D");
    double length = au ? 149597870700.0 : 1e3, time = day ? 86400 : 1, values[9];
    for (int k = 0; k < 6; k++)
        values[k] = states->state[i][k] / (k < 3 ? length : length / time);
    for (int k = 6; k < 9; k++)
        values[k] = 0.125 * k;
    fprintf(out,
            layout->form == FORM_CSV ? "%.9f, A.D. 2022-Jul-14 00:00:00.0000, %s"
                                     : "%.9f = A.D. 2022-Jul-14 00:00:00.0000 TDB %s\n",
            states->first + i * states->step, layout->delta_t ? "69.183904," : "");
    print_values(out, layout, values);
}

char *print_table(const struct states *states, const struct layout *layout)
{
    char *text;
    size_t size;
    FILE *out = open_memstream(&text, &size);
    assert_non_null(out);
    print_header(out, states, layout);
    print_columns(out, layout);
    fputs("$$SOE\n", out);
    for (int i = 0; i < STATES; i++)
        print_record(out, states, i, layout);
    fprintf(out, "$$EOE\n%s\nTIME\n\n  Barycentric Dynamical Time\n", stars);
    assert_int_equal(fclose(out), 0);
    while (layout->crlf && strstr(text, "\n") && !strstr(text, "\r")) {
        char *dos = calloc(2, size + 1), *q = dos;
        assert_non_null(dos);
        for (char *p = text; *p; *q++ = *p++)
            if (*p == '\n')
                *q++ = '\r';
        free(text);
        text = dos;
    }
    return text;
}

char *replaced(const char *text, const char *from, const char *to)
{
    const char *at = strstr(text, from);
    if (!at)
        fail_msg("no '%s' to replace", from);
    size_t size = strlen(text) + strlen(to) + 1;
    char *copy = malloc(size);
    assert_non_null(copy);
    snprintf(copy, size, "%.*s%s%s", (int)(at - text), text, to, at + strlen(from));
    return copy;
}

struct phys_horizons read_fine(const char *file)
{
    struct phys_horizons table;
    struct ad_error error = {0};
    if (phys_horizons_read(file, &table, &error) != AD_OK)
        fail_msg("%s", error.message);
    return table;
}

void free_tables(struct phys_horizons *tables, size_t n)
{
    for (size_t k = 0; k < n; k++)
        phys_horizons_free(&tables[k]);
    free(tables);
}

void assert_states(const struct phys_horizons *table, const struct states *states, int type)
{
    assert_int_equal(table->n, STATES);
    assert_true((table->velocity == NULL) == (type == 1));
    for (size_t i = 0; i < STATES; i++) {
        assert_true(table->jd[i] == states->first + (double)i * states->step);
        for (size_t d = 0; d < 3; d++) {
            assert_close(table->position[3 * i + d], states->state[i][d], 2e-15, 0);
            if (table->velocity)
                assert_close(table->velocity[3 * i + d], states->state[i][3 + d], 2e-15, 0);
        }
    }
}
