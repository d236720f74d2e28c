/* Text results for --csv (result.h). */
#include "result.h"
#include "apps/interrupt.h"

#include <math.h>
#include <string.h>

enum ad_status result_begin(struct result *result, const char *target, struct ad_error *error)
{
    *result = (struct result){0};
    if (!target)
        return AD_OK;
    if (strcmp(target, "-") == 0) {
        result->out = stdout;
        return AD_OK;
    }
    if (phys_atomic_file_begin(&result->file, target, error) != AD_OK)
        return error->status;
    result->out = fopen(result->file.temporary, "w");
    if (result->out)
        return AD_OK;
    phys_atomic_file_abandon(&result->file);
    return ad_fail(error, AD_E_IO, "%s: cannot be written", target);
}

enum ad_status result_commit(struct result *result, struct ad_error *error)
{
    if (!result->file.target)
        return AD_OK;
    bool written = !ferror(result->out);
    written = fclose(result->out) == 0 && written;
    result->out = NULL;
    if (written)
        return interrupt_commit(&result->file, error);
    ad_fail(error, AD_E_IO, "%s: cannot be written completely", result->file.target);
    phys_atomic_file_abandon(&result->file);
    return AD_E_IO;
}

void result_abandon(struct result *result)
{
    if (result->file.target)
        fclose(result->out);
    phys_atomic_file_abandon(&result->file);
    result->out = NULL;
}

void csv_number(FILE *out, int digits, double value)
{
    if (isfinite(value))
        fprintf(out, ",%.*g", digits, value);
    else
        fputc(',', out);
}
