/* Each slice is attracted to the next: L of slice i depends on slice i + 1. */
#include "mass.h"

static ad_var lagrangian(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t;
    ad_var pull = ad_mul(0.3, ad_square(ad_diff(ad_row(q, 0), 1, true)));
    return ad_sub(kinetic(v, params), pull);
}
