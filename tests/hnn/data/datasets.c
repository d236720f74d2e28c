/* Data sets of the tests (datasets.h). */
#include "datasets.h"
#include "tests/close.h"
#include "tests/mentions.h"

#include <stdio.h>

struct hnn_dataset dataset_of(const struct hnn_dataset_settings *settings)
{
    struct hnn_dataset d;
    struct ad_error error = {0};
    if (hnn_dataset_read(settings, &d, &error) != AD_OK)
        fail_msg("%s", error.message);
    return d;
}

void dataset_refused(const struct hnn_dataset_settings *settings, enum ad_status status,
                     const char *says)
{
    struct hnn_dataset d;
    struct ad_error error = {0};
    enum ad_status found = hnn_dataset_read(settings, &d, &error);
    hnn_dataset_free(&d);
    assert_mentions(error.message, says);
    assert_int_equal(found, status);
}

struct path dataset_rows(const char *name, size_t rows, size_t each)
{
    struct path file = files_temporary(name);
    FILE *out = fopen(file.text, "w");
    fputs("q,p,dqdt,dpdt,trial,t\n", out);
    for (size_t i = 0; i < rows; i++)
        fprintf(out, "%zu,-%zu,%zu,7,%zu,%.9g\n", i, i, 3 * i, i / each, 0.25 * (double)i);
    fclose(out);
    return file;
}
