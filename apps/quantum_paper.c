#include "command.h"
#include "quantum.h"
int quantum_paper(const struct quantum_options *options, struct ad_error *error)
{
    (void)options;
    ad_fail(error, AD_E_ARGUMENT, "not yet");
    return WRONG_USE;
}
