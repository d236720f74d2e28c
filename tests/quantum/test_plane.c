/* Two dimensions: products of kernels against the full kernel, and the fringes behind two slits. */
#include "waves.h"

#include <stdlib.h>

static const struct parameter weightless[] = {{"g", 0}};

/* On a small grid the product of the kernels is the matrix of all pairs. */
static void product_is_the_whole(void **state)
{
    (void)state;
    enum { NX = 12, NY = 9 };
    struct ad_error error = {0};
    struct phys_system system = system_with("spring", 0, NULL);
    struct qm_slice slice = {
        .size = sizeof slice, &system, NULL, {-2, 2, NX}, QM_OPEN, 0, 0.7, 1, 1};
    qm_complex Kx[NX * NX], Ky[NY * NY], psi[NX * NY], work[NX * NY], mask[NX * NY], out[NX * NY];
    qm_kernel(&slice, Kx, &error);
    slice.grid = (struct qm_grid){-1, 3, NY};
    qm_kernel(&slice, Ky, &error);
    assert_no_error(&error);
    for (size_t k = 0; k < NX * NY; k++) {
        psi[k] = sin(1.7 * (double)k) + I * cos(2.3 * (double)k);
        mask[k] = cos(0.3 * (double)k) + 0.4 * I;
    }
    for (size_t a = 0; a < NX; a++)
        for (size_t b = 0; b < NY; b++) {
            qm_complex sum = 0;
            for (size_t c = 0; c < NX; c++)
                for (size_t d = 0; d < NY; d++)
                    sum += Kx[a * NX + c] * Ky[b * NY + d] * psi[c * NY + d];
            out[a * NY + b] = sum * mask[a * NY + b];
        }
    qm_propagate_plane(NX, Kx, NY, Ky, mask, 1, psi, work);
    assert_close(distance(NX * NY, psi, out), 0, 0, 1e-13);
    phys_system_close(&system);
}

/* Behind two Gaussian slits the phases that the packets of either bring run apart in proportion to
   y: dark lines are half a fringe from the middle. */
static void fringes_are_where_they_should_be(void **state)
{
    (void)state;
    enum { NX = 32, NY = 1024 };
    struct ad_error error = {0};
    struct phys_system system = system_with("freebody", 1, weightless);
    struct qm_slice slice = {.size = sizeof slice, &system, NULL, {-6, 6, NX}, QM_OPEN, 0, 3, 1, 1};
    struct qm_grid y = {-40, 40, NY};
    qm_complex *Kx = malloc((NX * NX + NY * NY + 2 * NX * NY) * sizeof *Kx);
    assert_non_null(Kx);
    qm_complex *Ky = Kx + NX * NX, *psi = Ky + NY * NY, *work = psi + NX * NY;
    qm_complex along[NX], up[NY];
    qm_kernel(&slice, Kx, &error);
    slice.grid = y;
    qm_kernel(&slice, Ky, &error);
    assert_no_error(&error);
    qm_packet(&(struct qm_grid){-6, 6, NX}, 1, &(struct qm_gaussian){0, 1, 0}, 1, 0, along);
    qm_packet(&y, 1, &(struct qm_gaussian){2, 0.3, 0}, 1, 0, up);
    for (size_t k = 0; k < NX * NY; k++)
        psi[k] = along[k / NY] * up[k % NY];
    qm_propagate_plane(NX, Kx, NY, Ky, NULL, 1, psi, work);
    /* the other slit's wave is the mirror image: the phase between them at y, at -y turned around
     */
    const qm_complex *row = psi + NX / 2 * NY;
    double slope = 0;
    for (size_t b = NY / 2; b < NY / 2 + 30; b++) {
        double phase = carg(row[b] * conj(row[NY - 1 - b]));
        slope += phase / qm_x(&y, b) / 30;
    }
    assert_close(2 * M_PI / fabs(slope), qm_exact_fringe(1, 1, 4, 0.3, 3), 1e-8, 0);
    assert_close(2 * M_PI / fabs(slope), 4.72935358, 1e-8, 0);
    free(Kx);
    phys_system_close(&system);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(product_is_the_whole),
        cmocka_unit_test(fringes_are_where_they_should_be),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
