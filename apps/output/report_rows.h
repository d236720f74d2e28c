/* Rows of a report, for what writes them (report.h). */
#ifndef APPS_OUTPUT_REPORT_ROWS_H
#define APPS_OUTPUT_REPORT_ROWS_H

#include "report.h"

enum kind { NUMBER, COUNT, FLAG, TEXT, LIST, TEXTS, LINE };

struct report_row {
    enum kind kind;
    const char *array, *object, *key, *label;
    char unit[40];
    bool passing;
    size_t item, n; /* n: the count, or the length of the list */
    double number;
    char *text;   /* owned */
    double *list; /* owned */
};

/* Not AD_OK where a row could not be added. */
enum ad_status report_complete(const struct report *report, struct ad_error *error);
bool report_begins_item(const struct report *report, size_t k);
/* No row before row k is of its object, or of its item of an array; `kept`: none that is kept in
   the file. */
bool report_is_first(const struct report *report, size_t k, bool kept);
/* First row behind row k that is not of its array. */
size_t report_array_end(const struct report *report, size_t k);

#endif
