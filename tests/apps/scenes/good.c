/* An anharmonic well, without defects. */
#include "mass.h"

static ad_var lagrangian(ad_var q, ad_var v, ad_var t, const void *params)
{
    ad_var x = ad_row(q, 0), well = ad_add(ad_square(x), ad_pow(x, 4));
    return ad_sub(kinetic(v, params), ad_add(well, ad_mul(0.1, ad_mul(x, ad_sin(t)))));
}
