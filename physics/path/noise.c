/* Noisy starts, drawn as in the published code (struct phys_noise). */
#include "internal.h"
#include "physics/io/random.h"

enum { QUIET = 3 }; /* slices at either end that carry no noise */

static double draw(const struct phys_noise *noise, struct phys_random *random)
{
    double x = phys_random_normal(random);
    if (noise->clip > 0)
        x = x < -noise->clip ? -noise->clip : x > noise->clip ? noise->clip : x;
    return noise->sigma * x;
}

/* Whether slice i is at least `margin` slices away from both ends of a path. */
static bool within(size_t i, size_t slices, size_t margin)
{
    return i >= margin && i + margin < slices;
}

void phys_noise_add(const struct phys_noise *noise, const struct phys_system *system, size_t slices,
                    uint64_t seed, double *path)
{
    struct phys_random random;
    if (!noise || !system || !path)
        return;
    phys_random_seed(&random, seed);
    for (size_t k = 0; k < system->dof; k++) {
        bool quiet = k / system->dims < noise->quiet_bodies;
        for (size_t i = 0; i < slices; i++) {
            double *x = &path[k * slices + i];
            if (noise->around_zero && within(i, slices, 1))
                *x = 0;
            if (!quiet && within(i, slices, QUIET))
                *x += draw(noise, &random);
            if (noise->margin && within(i, slices, noise->margin))
                *x = noise->scale * *x + noise->shift;
        }
    }
}
