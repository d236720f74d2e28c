/* Finds the --set to blame by leaving out each in turn (set_fault.h). */
#include "set_fault.h"
#include "hnn/hnn.h"
#include "physics/motion/solve.h"

const struct phys_setting *set_fault(const struct common *common)
{
    const struct phys_setting *fault = NULL;
    for (size_t k = 0; k < common->set.n; k++) {
        struct phys_system other;
        struct ad_error error = {0};
        hnn_system_open(common->argument[0], &other, &error);
        for (size_t i = 0; i < common->set.n && error.status == AD_OK; i++)
            if (i != k)
                phys_system_set(&other, common->set.setting[i].name, common->set.setting[i].value,
                                &error);
        if (error.status == AD_OK &&
            phys_motion_check_start(&other, common->seed, NULL, NULL, &error) == AD_OK) {
            if (fault)
                k = common->set.n;
            fault = fault ? NULL : &common->set.setting[k];
        }
        phys_system_close(&other);
    }
    return fault;
}

enum ad_status set_check(const struct common *common, const struct phys_system *system,
                         struct ad_error *error)
{
    struct ad_error cause = {0};
    if (common->set.n == 0 || !system->scene->start ||
        phys_motion_check_start(system, common->seed, NULL, NULL, &cause) != AD_E_ARGUMENT)
        return AD_OK;
    const struct phys_setting *fault = set_fault(common);
    return fault ? ad_fail(error, AD_E_ARGUMENT, "--set %.60s=%g: %s", fault->name, fault->value,
                           cause.message)
                 : AD_OK;
}
