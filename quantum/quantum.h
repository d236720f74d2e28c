/* Wave packets from the Lagrangian that gives the classical path.

   In a time dt a particle at x_b goes to x_a with the amplitude exp(i S_ab / hbar), S_ab the action
   of the straight path between them (Feynman, Rev. Mod. Phys. 20, 1948). On a grid this is a
   matrix, and a wave function is moved on by multiplying with it:

       struct qm_slice slice = {.system = &system, .grid = {-10, 10, 256}, .dt = .5, .hbar = 1};
       qm_propagator *propagator;
       qm_packet(&slice.grid, slice.hbar, &(struct qm_gaussian){-2, .5, 1}, 1, 0, psi);
       qm_propagator_new(&qm_method_kernel, &slice, &propagator, &error);
       qm_propagate(propagator, 1, psi, &error);          psi [256] is where it is dt later
       qm_propagator_free(propagator);

   Any scene of one coordinate whose L does not depend on time will do. Units are the scene's; hbar
   is in units of its action. Nothing is normalised behind the caller's back: what becomes of the
   norm is the first thing to look at. */
#ifndef QUANTUM_H
#define QUANTUM_H

#include "physics/physics.h"

#ifdef __cplusplus
extern "C" {
#pragma GCC diagnostic push /* C has a struct and a function of one name */
#pragma GCC diagnostic ignored "-Wshadow"
#endif

__extension__ typedef double _Complex qm_complex;

/* ---- grid ---- */

/* n cells between the walls; the points x_a = low + (a + 1/2) dx are their centres, so that a wall
   lies halfway between a point and its mirror image. */
struct qm_grid {
    double low, high;
    size_t n;
};
double qm_dx(const struct qm_grid *grid);
double qm_x(const struct qm_grid *grid, size_t a); /* x_a */

enum qm_walls {
    QM_OPEN,    /* what leaves the box is gone */
    QM_REFLECT, /* psi = 0 at both ends: paths are mirrored there, with the sign -1 */
    QM_RING     /* low and high are the same place: paths go around any number of times */
};

/* ---- one slice of time ---- */

struct qm_slice {
    const struct phys_system *system; /* of one coordinate */
    const struct phys_rule *rule;     /* left, midpoint or trapezoid; NULL: trapezoid */
    struct qm_grid grid;
    enum qm_walls walls; /* QM_REFLECT, QM_RING: with rules that look at ends of paths alone */
    double absorb;       /* width of layers at both ends that swallow shorter waves; 0: none */
    double dt, hbar;
    size_t threads; /* 0 means 1; no bit of the result depends on it */
};

/* A sum over paths is right while the phases of neighbouring paths differ by less than pi. Beyond,
   it also adds up at ghosts, a distance of 2 pi hbar dt / (m dx) from where the wave should be. */
struct qm_aliasing {
    double ratio;    /* largest difference between neighbours, in units of pi */
    double ghost;    /* how far from the wave its first ghost stands */
    double dt_least; /* smallest dt with a ratio of 1 in this box; NaN: none found */
    double dx_most;  /* largest dx of this box, at this dt */
    double box_most; /* longest box of this dx, at this dt */
};
/* Looks at the paths to points all over the grid, and at the slice itself: AD_E_ARGUMENT for more
   than one coordinate, an L that depends on time, a rule of another kind, sizes that are not
   positive, and a dt for which straight paths are too crude: D is not positive. */
enum ad_status qm_aliasing(const struct qm_slice *slice, struct qm_aliasing *aliasing,
                           struct ad_error *error);

/* ---- kernel (kernel.c) ---- */

/* K [n x n]: K_ab = dx sqrt(D / (2 pi i hbar)) exp(i S_ab / hbar), D = -d2S / dx_a dx_b, all by one
   compiled program, a column a path, from the scene's own Lagrangian. D is m/dt where the mass is
   constant and the rule looks at the ends alone; in general it is what keeps the norm to second
   order (van Vleck, PNAS 14, 1928). Between walls K is the sum over mirrored or winding paths, of
   which those faster than the grid can tell apart (|x_a - x_b| D dx > pi hbar) fade out. It does so
   whatever the aliasing: refusing is the caller's. */
enum ad_status qm_kernel(const struct qm_slice *slice, qm_complex *K, struct ad_error *error);
/* K of a free particle on a ring, however short dt is, as the quotient of two slices that are long
   enough (short.c); walls and layers of the slice are not looked at. Right for momenta up to half
   of what the grid can hold. */
enum ad_status qm_kernel_short(const struct qm_slice *slice, qm_complex *K, struct ad_error *error);
/* K becomes K^(2^times), by squaring. */
enum ad_status qm_kernel_square(size_t n, size_t times, qm_complex *K, struct ad_error *error);

/* out [n x packets] = K psi, for as many packets as psi [n x packets] has columns. */
void qm_kernel_apply(size_t n, const qm_complex *K, size_t packets, const qm_complex *psi,
                     qm_complex *out);

/* V [n] on the grid and the mass, of a scene whose L is m v^2/2 - V(q); AD_E_ARGUMENT for another.
 */
enum ad_status qm_potential(const struct phys_system *system, const struct qm_grid *grid, double *V,
                            double *mass, struct ad_error *error);

/* Real energies [states] and wave functions [states x n], each of norm 1 and real, of the lowest
   states between walls where psi = 0: second-order differences, LAPACK tridiagonal. */
enum ad_status qm_eigenstates(const struct phys_system *system, const struct qm_grid *grid,
                              double hbar, size_t states, double *energy, double *psi,
                              struct ad_error *error);

/* ---- propagation ---- */

/* What a run will take: a look before it starts. */
struct qm_cost {
    double bytes;
    double setup, step; /* floating-point operations: once, and a packet and slice */
};

/* A way to move wave functions on: one file, one const struct, one line in the table. */
struct qm_method {
    const char *name, *what;
    bool (*aliases)(const struct qm_slice *slice); /* what qm_aliasing finds matters to it */
    void (*cost)(const struct qm_slice *slice, struct qm_cost *cost);
    enum ad_status (*open)(const struct qm_slice *slice, void **state, struct ad_error *error);
    /* psi [n x packets], in place; state is the one of open. */
    enum ad_status (*step)(void *state, size_t packets, qm_complex *psi, struct ad_error *error);
    void (*close)(void *state); /* takes NULL */
};
/* kernel: K by zgemv or zgemm; fft: the same K where it depends on the difference of the positions
   but for phases of its ends, by fast Fourier transforms; on a ring of 2^k points all windings are
   summed in closed form, and no dt is too short; crank-nicolson: Schroedinger's equation
   by differences, none of the above in it. */
extern const struct qm_method qm_method_kernel, qm_method_fft, qm_method_crank_nicolson;
extern const struct qm_method *const qm_methods[]; /* NULL-terminated */
const struct qm_method *qm_method_find(const char *name, struct ad_error *error);

typedef struct qm_propagator qm_propagator;
/* AD_E_ARGUMENT where the method does not suit the slice, saying why; not for aliasing. */
enum ad_status qm_propagator_new(const struct qm_method *method, const struct qm_slice *slice,
                                 qm_propagator **propagator, struct ad_error *error);
void qm_propagator_free(qm_propagator *propagator); /* takes NULL */
/* psi [n x packets], a column a packet, one slice on, in place. */
enum ad_status qm_propagate(qm_propagator *propagator, size_t packets, qm_complex *psi,
                            struct ad_error *error);

/* Two coordinates that do not act on each other: psi [nx x ny] becomes Kx psi Ky^T, element by
   element times mask [nx x ny] (NULL: none), `steps` times. work [nx x ny] is room. */
void qm_propagate_plane(size_t nx, const qm_complex *Kx, size_t ny, const qm_complex *Ky,
                        const qm_complex *mask, size_t steps, qm_complex *psi, qm_complex *work);

/* ---- packets and what is seen of them ---- */

/* A Gaussian packet: |psi|^2 is a normal distribution, x +- sigma, momentum p. */
struct qm_gaussian {
    double x, sigma, p;
};
/* Column `column` of psi [n x packets]; the norm is 1 but for what the box cuts off. */
void qm_packet(const struct qm_grid *grid, double hbar, const struct qm_gaussian *packet,
               size_t packets, size_t column, qm_complex *psi);

struct qm_moments {
    double norm;          /* sum |psi|^2 dx: 1 where nothing is lost, and the accuracy */
    double mean_x, std_x; /* of the normalised distribution; NaN where there is nothing */
};
/* Of psi [n], whose elements lie `stride` apart. */
struct qm_moments qm_moments(const struct qm_grid *grid, size_t stride, const qm_complex *psi);
/* <a|b> dx of two columns [n]. */
qm_complex qm_overlap(const struct qm_grid *grid, size_t stride, const qm_complex *a,
                      const qm_complex *b);

/* ---- exact answers (exact.c) ---- */

/* m x^2 curvature/2 + m gravity x: free, falling, oscillating, all with Gaussian packets for ever.
 */
struct qm_quadratic {
    double mass, curvature, gravity; /* V / m = curvature x^2/2 + gravity x; curvature >= 0 */
};
/* psi [n] at time t of a packet (Heller, J. Chem. Phys. 62, 1975): its centre is on the classical
   path, its width, phase and slope follow from two solutions of the classical equation. */
void qm_exact_packet(const struct qm_quadratic *scene, double hbar,
                     const struct qm_gaussian *packet, double t, const struct qm_grid *grid,
                     qm_complex *psi);
/* Amplitude density from x_b to x_a in time t, 0 < t < half a period (Mehler 1866 for curvature >
   0; Kennard 1927 for gravity): times dx it is an element of K. */
qm_complex qm_exact_kernel(const struct qm_quadratic *scene, double hbar, double x_a, double x_b,
                           double t);
/* ---- a reference (reference.c) ---- */

struct qm_reference {
    double uncertainty; /* of psi, sqrt(int |psi - psi'|^2 dx); INFINITY: none was found */
    double norm;        /* of the whole wave, inside and outside an open box */
};
/* psi [n] at time t of a packet in the box of a slice by Schroedinger's equation, split in Fourier
   space, with steps and points of its own: independent of any sum over paths and of the slice's dt
   and n. Refined until `uncertainty` is at most `wanted` or the work too much. Open and absorbing
   ends are taken for none: the box is widened until nothing reaches the ends. AD_E_ARGUMENT where L
   is not m v^2/2 - V(q). */
enum ad_status qm_reference(const struct qm_slice *slice, const struct qm_gaussian *packet,
                            double t, double wanted, qm_complex *psi,
                            struct qm_reference *reference, struct ad_error *error);

/* Distance of bright fringes behind two Gaussian slits +-sigma wide, `apart` from centre to centre,
   a time t after a plane wave met them. */
double qm_exact_fringe(double mass, double hbar, double apart, double sigma, double t);

#ifdef __cplusplus
#pragma GCC diagnostic pop
}
#endif
#endif
