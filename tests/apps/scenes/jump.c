/* A step of the potential at the start, which no derivative on the tape shows. */
#include "mass.h"

static ad_var lagrangian(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t;
    return ad_sub(kinetic(v, params), ad_mul(3.0, ad_gt(ad_row(q, 0), 0.25)));
}
