/* The curve of quickest descent under gravity, with free end time. With u the square root of the
   drop below the start, the time along a curve, the integral of ds / speed, is the length in the
   metric (4 u'^2 + x'^2 / u^2) / 2g. Its geodesics are the stationary paths of
       L = (4 u'^2 + x'^2 / u^2) / 4g + 1/2,
   and for free end time, hence energy 0, they are traversed in true time: S is the time of descent.
   In the drop itself the metric would have a pole; u begins like t. The second coordinate is w = x
   / u, x measured from the start, so that a straight line of (u, w) is a straight chute, and x' / u
   = w' + w u' / u. */
#include "scenes.h"

#include <math.h>

struct brachistochrone {
    double g, x0, y0, x1, y1;
};

static const struct phys_param params[] = {
    {"g", "m/s^2", "gravity, downwards", 9.80665, offsetof(struct brachistochrone, g)},
    {"x0", "m", "start", 0, offsetof(struct brachistochrone, x0)},
    {"y0", "m", "its height", 10, offsetof(struct brachistochrone, y0)},
    {"x1", "m", "end, to the right of it", 10, offsetof(struct brachistochrone, x1)},
    {"y1", "m", "its height, below the start", 5, offsetof(struct brachistochrone, y1)},
};

static size_t dof_of(const void *p)
{
    const struct brachistochrone *s = p;
    return s->g > 0 && s->x1 > s->x0 && s->y1 < s->y0 ? 2 : 0;
}

static ad_var lagrangian(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct brachistochrone *s = p;
    (void)t;
    ad_var u = ad_row(q, 0), w = ad_row(q, 1), du = ad_row(v, 0), dw = ad_row(v, 1);
    ad_var top = ad_eq(u, 0.0), slope = ad_div(w, ad_select(top, 1.0, u));
    ad_var ratio = ad_select(top, dw, ad_mul(slope, du)); /* at the start its limit */
    ad_var along = ad_square(ad_add(dw, ratio));
    ad_var metric = ad_add(ad_mul(4, ad_square(du)), along);
    return ad_add(ad_mul(ad_div(0.25, PHYS_PARAM(s, g)), metric), 0.5);
}

/* Angle by which the circle that draws the cycloid has turned at the end. */
static double end_angle(const struct brachistochrone *s)
{
    double slope = (s->x1 - s->x0) / (s->y0 - s->y1), low = 0, high = 2 * M_PI;
    for (int k = 0; k < 200 && high - low > 0; k++) {
        double angle = 0.5 * (low + high);
        if (angle == low || angle == high)
            break;
        if (angle - sin(angle) < slope * (1 - cos(angle)))
            low = angle;
        else
            high = angle;
    }
    return low;
}

static enum ad_status cycloid(const void *p, size_t slices, double *path, struct ad_error *error)
{
    const struct brachistochrone *s = p;
    double end = end_angle(s), radius = (s->y0 - s->y1) / (1 - cos(end));
    (void)error;
    for (size_t i = 0; i < slices; i++) {
        double angle = end * (double)i / (double)(slices - 1);
        path[i] = sqrt(2 * radius) * sin(0.5 * angle);
        path[slices + i] = i ? radius * (angle - sin(angle)) / path[i] : 0;
    }
    path[2 * slices - 1] = (s->x1 - s->x0) / path[slices - 1];
    return AD_OK;
}

/* On the cycloid a tenth of the way: at its beginning u = 0, and w means nothing there. */
static enum ad_status start(const void *p, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    const struct brachistochrone *s = p;
    (void)seed, (void)error;
    double end = end_angle(s), radius = (s->y0 - s->y1) / (1 - cos(end));
    double angle = 0.1 * end, rate = sqrt(s->g / radius);
    double x = radius * (angle - sin(angle));
    q[0] = sqrt(2 * radius) * sin(0.5 * angle);
    q[1] = x / q[0];
    v[0] = sqrt(0.5 * radius) * cos(0.5 * angle) * rate;
    v[1] = (radius * (1 - cos(angle)) * rate - q[1] * v[0]) / q[0];
    return AD_OK;
}

const struct phys_scene phys_scene_brachistochrone = {
    PHYS_SCENE_OF(struct brachistochrone),
    .name = "brachistochrone",
    .what = "the curve of quickest descent, its time free",
    .dof_of = dof_of,
    .dims = 2,
    .coordinates = (const char *const[]){"u", "w"},
    .unit = "m^1/2",
    .time_unit = "s",
    .energy_unit = "1",
    .lagrangian = lagrangian,
    .slices = 21,
    .dt = 0.1,
    .start = start,
    .picture = PHYS_PICTURE_TIME,
    .between = cycloid,
    .free_time = true,
};
