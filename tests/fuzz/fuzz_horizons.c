/* Fuzzer of the Horizons reader: no input crashes it; accepted tables are finite, with ordered
   epochs and a date that converts back to the first, and refusals have a message. */
#include "fuzz.h"

#include "physics/ephemeris/horizons.h"

#include <math.h>
#include <string.h>

static void check(const struct phys_horizons *table)
{
    fuzz_require(table->n > 0 && *table->target && *table->center && *table->frame);
    fuzz_require(isfinite(table->gm) && table->gm >= 0);
    for (size_t i = 0; i < 3 * table->n; i++)
        fuzz_require(isfinite(table->position[i]) &&
                     (!table->velocity || isfinite(table->velocity[i])));
    for (size_t i = 1; i < table->n; i++)
        fuzz_require(table->jd[i] > table->jd[i - 1]);
}

int fuzz_horizons(const uint8_t *data, size_t size)
{
    struct phys_horizons table;
    struct ad_error error = {0};
    size_t index;
    if (phys_horizons_read(fuzz_file(data, size), &table, &error) != AD_OK) {
        fuzz_require(error.status == AD_E_INPUT && strstr(error.message, "expected") && !table.jd);
        return 0;
    }
    check(&table);
    phys_horizons_epoch(&table, table.start_date, &index, &error);
    phys_horizons_free(&table);
    return 0;
}
