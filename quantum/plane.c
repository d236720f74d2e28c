/* Two coordinates with a product kernel: psi -> Kx psi Ky^T costs N^3 instead of N^4. */
#include "internal.h"
#include "physics/linear/linear.h"

void qm_propagate_plane(size_t nx, const qm_complex *Kx, size_t ny, const qm_complex *Ky,
                        const qm_complex *mask, size_t steps, qm_complex *psi, qm_complex *work)
{
    if (!nx || !ny || !Kx || !Ky || !psi || !work) {
        qm_unknown(nx * ny, 1, psi);
        return;
    }
    for (size_t k = 0; k < steps; k++) {
        phys_lapack_gemm_complex(false, nx, ny, nx, (const double *)Kx, (const double *)psi,
                                 (double *)work);
        phys_lapack_gemm_complex(true, nx, ny, ny, (const double *)work, (const double *)Ky,
                                 (double *)psi);
        for (size_t a = 0; mask && a < nx * ny; a++)
            psi[a] *= mask[a];
    }
}
