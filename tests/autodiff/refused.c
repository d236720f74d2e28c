/* What a tape refused (refused.h). */
#include "refused.h"
#include "support.h"
#include "tests/mentions.h"

#include <stdio.h>

void assert_refused(ad_tape *t, enum ad_status status, const char *op, const char *label)
{
    const struct ad_error *e = ad_tape_error(t);
    char number[40];
    if (e->status != status)
        print_error("%s: status %d, %s\n", op, e->status, e->message);
    assert_int_equal(e->status, status);
    assert_mentions(e->message, op);
    snprintf(number, sizeof number, "operation %zu", ad_tape_size(t));
    assert_mentions(e->message, number);
    assert_mentions(e->message, label);
}
