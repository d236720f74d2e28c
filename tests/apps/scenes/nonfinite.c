/* A logarithm of a negative number from the first slice on. */
#include "mass.h"

static ad_var lagrangian(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t;
    ad_var depth = ad_label(ad_log(ad_sub(ad_row(q, 0), 1.0)), "depth");
    return ad_sub(kinetic(v, params), depth);
}
