/* Propagation of wave packets by the Lagrangian that gives the classical path.

   In a time dt a particle at x_b moves to x_a with the amplitude exp(i S_ab / hbar), S_ab being the
   action of the straight path between them (Feynman, Rev. Mod. Phys. 20, 1948). On a grid this is a
   matrix, by which a wave function is multiplied:

       struct qm_slice slice = {.size = sizeof slice, .system = &system, .grid = {-10, 10, 256}, .dt
   = .5, .hbar = 1}; qm_propagator *propagator; qm_packet(&slice.grid, slice.hbar, &(struct
   qm_gaussian){-2, .5, 1}, 1, 0, psi); qm_propagator_new(&qm_method_kernel, &slice, &propagator,
   &error); qm_propagate(propagator, 1, psi, &error);          psi [256] is the wave dt later
       qm_propagator_free(propagator);

   Any scene of one coordinate whose L does not depend on time can be used. Units are the scene's;
   hbar is in units of its action. No function normalises psi: its norm is the first measure of the
   error.

   Shapes: arrays are the caller's, row-major: psi [n x packets] has point a of packet p at psi[a *
   packets
   + p]. Errors: functions that return a status refuse NULL, sizes of 0 and invalid numbers with
   AD_E_ARGUMENT, an L that is not finite with AD_E_NONFINITE, and return AD_E_MEMORY when out of
   memory; outputs are then undefined. *error, zero-initialised by the caller and never NULL, gets
   the message. Functions without a status return NaN, fill the arrays given
   with NaN, or do nothing. *slice and *system are read during the call only, by qm_propagator_new
   also until qm_propagator_free. Threads: functions may run at once on different data. */
#ifndef QUANTUM_QUANTUM_H
#define QUANTUM_QUANTUM_H

#include "physics/physics.h"

AD_HEADER_BEGIN

__extension__ typedef double _Complex qm_complex;

/* ---- grid ---- */

/* n cells between the walls; the points x_a = low + (a + 1/2) dx are their centres, so that a wall
   lies halfway between a point and its mirror image. */
struct qm_grid {
    double low, high;
    size_t n;
};
double qm_dx(const struct qm_grid *grid);          /* (high - low) / n */
double qm_x(const struct qm_grid *grid, size_t a); /* x_a */

enum qm_walls {
    QM_OPEN,    /* paths end inside the box; a wave that leaves it is lost */
    QM_REFLECT, /* psi = 0 at both ends: mirrored paths are added, with the sign -1 */
    QM_RING     /* low and high are the same place: windings are added */
};

/* ---- one time slice ---- */

struct qm_slice {
    size_t size;                      /* sizeof(struct qm_slice) */
    const struct phys_system *system; /* of one coordinate */
    const struct phys_rule *rule;     /* left, midpoint or trapezoid; NULL: trapezoid */
    struct qm_grid grid;
    enum qm_walls walls; /* QM_REFLECT, QM_RING: not with midpoint, whose paths cross the wall;
                            QM_REFLECT: not with an L that changes with the sign of v */
    double
        absorb; /* width of layers at both ends that absorb shorter waves; at most half the box */
    double dt, hbar; /* above 0 */
    size_t threads;  /* 0 means 1; results are bit for bit the same with any number */
};

/* A sum over paths on grid points is accurate while the phases of neighbouring paths differ by less
   than pi. Beyond that it also has maxima at ghosts, 2 pi hbar dt / (m dx) away from the wave. */
struct qm_aliasing {
    double ratio;    /* largest difference between neighbours, in units of pi */
    double ghost;    /* distance of the first ghost */
    double dt_least; /* least dt with a ratio of 1 on this grid; NaN: none found */
    double dx_most;  /* largest dx of this box, at this dt */
    double box_most; /* longest box of this dx, at this dt */
};
/* Uses the paths from all points to 33 of them. AD_E_ARGUMENT for more than one coordinate, an L
   that depends on time, rules other than left, midpoint and trapezoid, and a dt too long for
   straight paths: D = -d2S / dx_a dx_b is not positive; the message has D of this slice and of two
   slices of half the length. qm_error measures the accuracy of an admitted slice. */
enum ad_status qm_aliasing(const struct qm_slice *slice, struct qm_aliasing *aliasing,
                           struct ad_error *error);

/* ---- kernel (kernel.c) ---- */

/* K [n x n]: K_ab = dx sqrt(D / (2 pi i hbar)) exp(i S_ab / hbar), D = -d2S / dx_a dx_b (van Vleck,
   PNAS 14, 1928), from the scene's own Lagrangian by a compiled program whose columns are paths. D
   is m/dt where the mass is constant and the rule evaluates L at the ends alone. Between walls K is
   the sum over mirrored or winding paths, with weights that fall from 1 to 0 where a path is faster
   than the grid's shortest wave, |x_a - x_b| D dx = pi hbar (kernel.c). Aliased slices are
   computed, not refused: see qm_aliasing. */
enum ad_status qm_kernel(const struct qm_slice *slice, qm_complex *K, struct ad_error *error);
/* K of a free particle on a ring for any dt, as the quotient of two slices that are long enough
   (short.c); walls and absorbing layers of the slice are ignored. Right for momenta up to half of
   the grid's largest, pi hbar / dx. */
enum ad_status qm_kernel_short(const struct qm_slice *slice, qm_complex *K, struct ad_error *error);
/* K [n x n] becomes K^(2^times), by squaring. */
enum ad_status qm_kernel_square(size_t n, size_t times, qm_complex *K, struct ad_error *error);

/* out [n x packets] = K [n x n] psi [n x packets]; out and psi do not overlap. */
void qm_kernel_apply(size_t n, const qm_complex *K, size_t packets, const qm_complex *psi,
                     qm_complex *out);

/* V [n] on the grid and *mass of a scene whose L is m v^2/2 - V(q), derived from L and its
   derivatives at two velocities; AD_E_ARGUMENT for another L. */
enum ad_status qm_potential(const struct phys_system *system, const struct qm_grid *grid, double *V,
                            double *mass, struct ad_error *error);

/* A system of L = mass v^2/2 - V(q) from values V [n] at the points of `grid`, which need not be
   those of the slices: their cubic spline, of fourth order. Outside of the box V is unknown, NaN,
   and what looks there is AD_E_NONFINITE. V is copied; close with phys_system_close after all that
   uses it. AD_E_ARGUMENT for fewer than 4 points, AD_E_NONFINITE names a point. */
enum ad_status qm_sampled(const struct qm_grid *grid, const double *V, double mass,
                          struct phys_system *system, struct ad_error *error);

/* Energies [states], ascending, and wave functions psi [states x n], real and of norm 1, of the
   lowest states between walls where psi = 0: second-order differences, LAPACK tridiagonal. */
enum ad_status qm_eigenstates(const struct phys_system *system, const struct qm_grid *grid,
                              double hbar, size_t states, double *energy, double *psi,
                              struct ad_error *error);

/* ---- propagation ---- */

/* Estimated cost of a run. */
struct qm_cost {
    double bytes;
    double setup, step; /* floating-point operations: once; per packet and slice */
};

/* A propagation method: one file, one const struct, one line in qm_methods. */
struct qm_method {
    const char *name, *what;
    bool (*aliases)(const struct qm_slice *slice); /* sums over paths: see qm_aliasing */
    void (*cost)(const struct qm_slice *slice, struct qm_cost *cost);
    enum ad_status (*open)(const struct qm_slice *slice, void **state, struct ad_error *error);
    /* advances psi [n x packets] by a slice, in place; state is that of open */
    enum ad_status (*step)(void *state, size_t packets, qm_complex *psi, struct ad_error *error);
    void (*close)(void *state); /* takes NULL */
};
/* kernel: the product K psi. fft: the same K by fast Fourier transforms, where it is a function of
   x_a - x_b times phases of x_a and of x_b; on a ring of 2^k points all windings are summed in
   closed form, for any dt. crank-nicolson: Schroedinger's equation by finite differences, without
   paths. */
extern const struct qm_method qm_method_kernel, qm_method_fft, qm_method_crank_nicolson;
extern const struct qm_method *const qm_methods[]; /* NULL-terminated */
/* By name; NULL and AD_E_ARGUMENT, naming the nearest, if there is none. */
const struct qm_method *qm_method_find(const char *name, struct ad_error *error);

typedef struct qm_propagator qm_propagator;
/* AD_E_ARGUMENT, with the reason, if the method does not suit the slice; aliasing is no error. On
   failure *propagator is NULL; free it with qm_propagator_free. */
enum ad_status qm_propagator_new(const struct qm_method *method, const struct qm_slice *slice,
                                 qm_propagator **propagator, struct ad_error *error);
void qm_propagator_free(qm_propagator *propagator); /* takes NULL */
/* Advances psi [n x packets] by one slice. AD_E_NONFINITE names the point and the packet that are
   not finite; psi stays. */
enum ad_status qm_propagate(qm_propagator *propagator, size_t packets, qm_complex *psi,
                            struct ad_error *error);

/* c [steps+1 x packets]: <psi(0)|psi(k dt)> for k = 0 ... steps of psi [n x packets], which moves
   on by as many slices. Errors as of qm_propagate. */
enum ad_status qm_correlation(qm_propagator *propagator, size_t steps, size_t packets,
                              qm_complex *psi, qm_complex *c, struct ad_error *error);

/* Two coordinates without interaction: `steps` times psi [nx x ny] becomes Kx psi Ky^T, times mask
   [nx x ny] element by element (NULL: no mask). work [nx x ny] is scratch. */
void qm_propagate_plane(size_t nx, const qm_complex *Kx, size_t ny, const qm_complex *Ky,
                        const qm_complex *mask, size_t steps, qm_complex *psi, qm_complex *work);

/* ---- packets and their moments ---- */

/* A Gaussian packet: |psi|^2 is the normal distribution of mean x and deviation sigma > 0; mean
   momentum p. */
struct qm_gaussian {
    double x, sigma, p;
};
/* Fills column `column` of psi [n x packets]; the norm is 1 less the part outside the box. On a
   ring qm_reference, qm_error and qm_run begin with the packet wound around it: the sum of this
   over x + j (high - low), with norm 1; they refuse one whose turns cancel, or of a width of more
   than 5 turns. */
void qm_packet(const struct qm_grid *grid, double hbar, const struct qm_gaussian *packet,
               size_t packets, size_t column, qm_complex *psi);

struct qm_moments {
    double norm;          /* sum |psi|^2 dx */
    double mean_x, std_x; /* of the normalised distribution; NaN where psi is 0 */
};
/* Of psi [n], elements `stride` apart: of packet p, with psi + p and stride packets. */
struct qm_moments qm_moments(const struct qm_grid *grid, size_t stride, const qm_complex *psi);
/* <a|b> = sum conj(a) b dx of two wave functions [n], elements `stride` apart. */
qm_complex qm_overlap(const struct qm_grid *grid, size_t stride, const qm_complex *a,
                      const qm_complex *b);

/* The probability, sum |psi|^2 dx, from `from` to `to`, with the part of the cells there: of second
   order in dx, and as a part of the norm. What is outside of the box counts 0; NaN for from > to.
 */
double qm_probability(const struct qm_grid *grid, double from, double to, size_t stride,
                      const qm_complex *psi);

/* Mean values of a wave, divided by its norm: momentum and its deviation, kinetic and potential
   energy and their sum. */
struct qm_observables {
    double mean_p, std_p, kinetic, potential, energy;
};
/* Of psi [n], elements `stride` apart, on the slice's grid and between its walls, by derivatives in
   Fourier space: momenta up to pi hbar / dx are known, others appear among them. Time: n^2.
   AD_E_ARGUMENT where L is not m v^2/2 - V(q); AD_E_NONFINITE for a wave that is 0 or not finite;
   AD_E_ACCURACY for one that is cut at an open wall. */
enum ad_status qm_observe(const struct qm_slice *slice, size_t stride, const qm_complex *psi,
                          struct qm_observables *observables, struct ad_error *error);

/* ---- exact solutions (exact.c) ---- */

/* V = mass (curvature x^2/2 + gravity x): free, falling, oscillating. Gaussian packets stay
 * Gaussian.
 */
struct qm_quadratic {
    double mass, curvature, gravity; /* mass > 0, curvature >= 0 */
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
    double uncertainty; /* estimate of sqrt(int |psi - truth|^2 dx); INFINITY: none was found */
    double norm;        /* norm of the whole wave, inside and outside an open box */
};
/* psi [n] at time t of a packet in the box of a slice by Schroedinger's equation, split in Fourier
   space, with its own steps and points: independent of any sum over paths and of the slice's dt and
   n. Refined until `uncertainty` is at most `wanted` or the work is too much. Open and absorbing
   ends are removed: the box is widened until nothing reaches its ends. AD_E_ARGUMENT where L is not
   m v^2/2 - V(q). */
enum ad_status qm_reference(const struct qm_slice *slice, const struct qm_gaussian *packet,
                            double t, double wanted, qm_complex *psi,
                            struct qm_reference *reference, struct ad_error *error);

/* ---- errors ---- */

/* The largest sqrt(int |psi - truth|^2 dx) of the packets psi [n x packets] at time t, each of
   which began as packet[k]. *against names the truth, a static text:
   - the closed form where the potential is quadratic (curvature >= 0) and the walls are open;
   - else, where L is m v^2/2 - V(q), qm_reference, whose uncertainty is the least error given
     (INFINITY: the work was too much);
   - else the same method with dt and dx a third as long: the difference divided by 1 - 3^-order of
     the rule. AD_E_ACCURACY where such a run would take too long.
   What is beyond an open wall counts, as psi = 0; absorbing layers are left out. */
enum ad_status qm_error(const struct qm_method *method, const struct qm_slice *slice,
                        size_t packets, const struct qm_gaussian *packet, double t,
                        const qm_complex *psi, double *off, const char **against,
                        struct ad_error *error);

/* x [n]: position at times t [n], ascending from 0, of the particle that starts with a packet's
   mean position and momentum and is reflected by reflecting walls. NaN after it leaves an open box,
   or where it cannot be followed. */
enum ad_status qm_classical(const struct qm_slice *slice, const struct qm_gaussian *packet,
                            size_t n, const double *t, double *x, struct ad_error *error);

/* Distance of bright fringes behind two Gaussian slits +-sigma wide, `apart` from centre to centre,
   a time t after a plane wave met them. */
double qm_exact_fringe(double mass, double hbar, double apart, double sigma, double t);

AD_HEADER_END
#endif
