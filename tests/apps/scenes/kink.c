/* A mass in a potential given when it is compiled (-DV=...), with a kink or without. */
#include "mass.h"

static ad_var lagrangian(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t;
    return ad_sub(kinetic(v, params), V(ad_row(q, 0)));
}
