/* The pendulum of pixels.h: Pendulum-v0 of OpenAI Gym (G. Brockman et al., arXiv 1606.01540)
   without torque and without its speed limit, which starts near hanging do not reach. */
#include "hnn/model/internal.h"
#include "pixels.h"

#include <math.h>

struct hnn_rod hnn_rod_published(void)
{
    const double screen = 500, half = 2.2, unit = 2 * half / screen; /* of one pixel */
    return (struct hnn_rod){.gravity = 10,
                            .mass = 1,
                            .length = 1,
                            .dt = 0.05,
                            .radius = 0.1,
                            .axle = 0.05,
                            .shade = 0.5,
                            .left = 165 * unit - half,
                            .right = 335 * unit - half,
                            .bottom = half - 390 * unit,
                            .top = half - 220 * unit};
}

enum ad_status hnn_rod_check(const struct hnn_rod *r, struct ad_error *error)
{
    if (AD_LACKS(error, r))
        return error->status;
    const struct {
        bool holds;
        const char *expected;
    } rule[] = {
        {r->gravity > 0 && isfinite(r->gravity), "a gravity over 0"},
        {r->mass > 0 && isfinite(r->mass), "a mass over 0"},
        {r->length > 0 && isfinite(r->length), "a length over 0"},
        {r->dt > 0 && r->dt * r->dt * 1.5 * r->gravity / r->length < 4,
         "a time step over 0 and under 2/sqrt(3 g/(2 l)), where the scheme becomes unstable"},
        {r->radius > 0 && isfinite(r->radius), "a radius over 0"},
        {r->axle >= 0 && r->axle <= r->radius, "an axle not wider than the rod"},
        {r->shade > 0 && r->shade <= 1, "a shade over 0 and at most 1"},
        {r->filter == HNN_AREA || r->filter == HNN_BILINEAR, "a filter that there is"},
        {r->left < r->right && isfinite(r->right - r->left), "left below right"},
        {r->bottom < r->top && isfinite(r->top - r->bottom), "bottom below top"},
    };
    for (size_t k = 0; k < LENGTH(rule); k++)
        if (!rule[k].holds)
            return ad_fail(error, AD_E_ARGUMENT, "frames of a pendulum need %s", rule[k].expected);
    return AD_OK;
}

/* I angle'' = -m g (l/2) sin angle with I = m l^2/3. */
static double acceleration(const struct hnn_rod *rod, double angle)
{
    return -1.5 * rod->gravity / rod->length * sin(angle);
}

void hnn_rod_step(const struct hnn_rod *rod, double *angle, double *speed)
{
    if (!rod || !angle || !speed)
        return;
    *speed += acceleration(rod, *angle) * rod->dt;
    *angle += *speed * rod->dt;
}
