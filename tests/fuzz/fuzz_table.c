/* Fuzzer of the CSV reader: no input crashes it; accepted tables are finite, and refusals have a
   message. */
#include "fuzz.h"

#include "physics/io/csv.h"

#include <math.h>
#include <string.h>

int fuzz_table(const uint8_t *data, size_t size)
{
    size_t rows = 0, cols = 0;
    double *values = NULL;
    struct ad_error error = {0};
    if (phys_table_read(fuzz_file(data, size), &rows, &cols, &values, &error) != AD_OK) {
        fuzz_require(error.status == AD_E_INPUT && strstr(error.message, "expected") && !values);
        return 0;
    }
    fuzz_require(rows > 0 && cols > 0 && rows * cols <= size);
    for (size_t k = 0; k < rows * cols; k++)
        fuzz_require(isfinite(values[k]));
    free(values);
    return 0;
}
