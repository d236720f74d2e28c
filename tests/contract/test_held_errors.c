/* Every public function that takes an error does nothing if there is one already: it returns its
   status, and touches no argument but the result that it would make. Arguments point to memory that
   nobody may read; and it refuses NULL. scripts/check-headers asks that each function of the
   headers is in the table. */
#include "tests/close.h"
#include "autodiff/autodiff.h"
#include "autodiff/program.h"
#include "autodiff/optim.h"
#include "autodiff/ranks.h"
#include "physics/system/system.h"
#include "physics/io/names.h"
#include "physics/lagrangian/check.h"
#include "physics/lagrangian/conserved.h"
#include "physics/lagrangian/euler_lagrange.h"
#include "physics/modes/modes.h"
#include "physics/action/action.h"
#include "physics/path/path.h"
#include "physics/path/ranks/path_ranks.h"
#include "physics/ephemeris/ephemeris.h"
#include "physics/ephemeris/horizons.h"
#include "physics/ephemeris/models.h"
#include "physics/lagrangian/legendre.h"
#include "physics/ode/ode.h"
#include "physics/integrators/integrators.h"
#include "physics/motion/checks.h"
#include "physics/motion/motion.h"
#include "physics/motion/solve.h"
#include "physics/motion/ensemble.h"
#include "physics/gas/order.h"
#include "physics/stability/stability.h"
#include "physics/fit/fit.h"
#include "physics/stability/periodic.h"
#include "physics/stability/family.h"
#include "hnn/hnn.h"
#include "hnn/data/data.h"
#include "hnn/pixels/latent.h"
#include "hnn/pixels/pixels.h"
#include "hnn/pixels/pixel_energy.h"
#include "hnn/rollout/rollout.h"
#include "quantum/quantum.h"
#include "quantum/run.h"
#include "quantum/slit.h"
#include "quantum/published.h"

#include <setjmp.h>
#include <signal.h>
#include <string.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

static void *P; /* not to be read */
static char results[1 << 16];
static void *O = results;
static sigjmp_buf back;

static void touched(int signal)
{
    (void)signal;
    siglongjmp(back, 1);
}

#define CALLS(X)                                                                                   \
    X(ad_evaluate, ad_evaluate(1, P, P, (ad_var){0}, P, e))                                        \
    X(ad_gradient, ad_gradient(1, P, P, (ad_var){0}, P, P, e))                                     \
    X(ad_run_checked, ad_run_checked(P, e))                                                        \
    X(ad_optimiser_new, ad_optimiser_new(P, 0, 1, e))                                              \
    X(ad_ranks_check, ad_ranks_check(P, e))                                                        \
    X(ad_ranks_gather, ad_ranks_gather(P, P, 1, P, e))                                             \
    X(ad_ranks_broadcast, ad_ranks_broadcast(P, 0, P, 1, e))                                       \
    X(ad_ranks_exchange, ad_ranks_exchange(P, 0, P, 0, P, 1, e))                                   \
    X(ad_ranks_spread, ad_ranks_spread(P, 0, P, P, e))                                             \
    X(hnn_samples_sum, hnn_samples_sum(P, P, 1, NULL, P, P, e))                                    \
    X(hnn_samples_take, hnn_samples_take(P, P, P, 0, 1, P, P, e))                                  \
    X(ad_ranks_least, ad_ranks_least(P, 1, P, e))                                                  \
    X(ad_ranks_agree, (ad_ranks_agree(NULL, e), ad_ranks_check(P, e)))                             \
    X(ad_ranks_same, ad_ranks_same(P, P, P, e))                                                    \
    X(ad_native_ranks, ad_native_ranks(P, NULL, 1, e))                                             \
    X(ad_ranks_sum, ad_ranks_sum(P, 1, 1, NULL, P, P, e))                                          \
    X(ad_ranks_deal, ad_ranks_deal(P, 1, 1, NULL, P, P, e))                                        \
    X(phys_system_open, phys_system_open(P, O, e))                                                 \
    X(phys_system_make, phys_system_make(P, O, e))                                                 \
    X(phys_system_set, phys_system_set(P, P, 1, e))                                                \
    X(phys_system_set_all, phys_system_set_all(P, 1, P, e))                                        \
    X(phys_param_use, phys_param_use(P, P, e))                                                     \
    X(phys_find, phys_find(P, P, 1, P, e))                                                         \
    X(phys_check_finite, phys_check_finite(P, P, e))                                               \
    X(phys_check_energies, phys_check_energies(P, P, e))                                           \
    X(phys_check_gradient, phys_check_gradient(P, P, 1, 1, 1, P, e))                               \
    X(phys_check_locality, phys_check_locality(P, P, P, e))                                        \
    X(phys_keeps_energy, phys_keeps_energy(P, e))                                                  \
    X(phys_conserved, phys_conserved(P, 1, P, P, P, e))                                            \
    X(phys_cyclic, phys_cyclic(P, 1, P, P, P, P, P, e))                                            \
    X(phys_equilibria_find, phys_equilibria_find(P, P, O, e))                                      \
    X(phys_motion_new, phys_motion_new(P, O, e))                                                   \
    X(phys_motion_acceleration, phys_motion_acceleration(P, P, P, 1, P, e))                        \
    X(phys_first_slices, phys_first_slices(P, P, P, 1, 1, 1, P, e))                                \
    X(phys_ode_path, phys_ode_path(P, 1, 1, 1, P, e))                                              \
    X(phys_rule_find, phys_rule_find(P, e))                                                        \
    X(phys_path_motion, phys_path_motion(P, P, P, 1, P, P, e))                                     \
    X(phys_solver_find, phys_solver_find(P, e))                                                    \
    X(phys_path_solve, phys_path_solve(P, P, P, P, P, e))                                          \
    X(phys_path_free_time, phys_path_free_time(P, P, 1, P, P, e))                                  \
    X(phys_path_resample, phys_path_resample(P, P, P, 1, e))                                       \
    X(phys_path_refine, phys_path_refine(P, P, P, 1, 1, O, e))                                     \
    X(phys_path_continue, phys_path_continue(O, P, P, 1, 1, P, O, O, e))                           \
    X(phys_path_spectrum, phys_path_spectrum(P, P, P, P, e))                                       \
    X(phys_path_share, phys_path_share(P, 0, 3, O, e))                                             \
    X(phys_path_ranks_start, phys_path_ranks_start(P, P, P, 1, false, P, P, e))                    \
    X(phys_path_ranks_gradient, phys_path_ranks_gradient(P, P, P, P, P, O, e))                     \
    X(phys_path_ranks_solve, phys_path_ranks_solve(P, P, P, P, P, P, e))                           \
    X(phys_path_ranks_spectrum, phys_path_ranks_spectrum(P, P, P, P, O, e))                        \
    X(phys_path_conjugate, phys_path_conjugate(P, P, P, P, e))                                     \
    X(phys_path_find, phys_path_find(P, P, P, P, P, e))                                            \
    X(phys_path_all, phys_path_all(P, P, P, 1, 1, O, e))                                           \
    X(phys_ephemeris_choose, phys_ephemeris_choose(P, P, 1, e))                                    \
    X(phys_ephemeris_use, phys_ephemeris_use(P, 1, P, 1, 1, 1, P, e))                              \
    X(phys_ephemeris_add, phys_ephemeris_add(P, P, 1, e))                                          \
    X(phys_horizons_read, phys_horizons_read(P, P, e))                                             \
    X(phys_horizons_folder, phys_horizons_folder(P, P, P, O, e))                                   \
    X(phys_horizons_epoch, phys_horizons_epoch(P, P, P, e))                                        \
    X(phys_ephemeris_tables_read, phys_ephemeris_tables_read(P, P, 1, P, e))                       \
    X(phys_ephemeris_track_tables, phys_ephemeris_track_tables(P, 1, O, e))                        \
    X(phys_ephemeris_follow, phys_ephemeris_follow(P, 1, O, e))                                    \
    X(phys_ephemeris_follow_tightly, phys_ephemeris_follow_tightly(P, 1, O, e))                    \
    X(phys_ephemeris_choose_step, phys_ephemeris_choose_step(P, P, 1, e))                          \
    X(phys_ephemeris_motion_open, phys_ephemeris_motion_open(P, P, O, e))                          \
    X(phys_ephemeris_measure, phys_ephemeris_measure(P, P, O, O, e))                               \
    X(phys_ephemeris_least, phys_ephemeris_least(P, 1, P, e))                                      \
    X(phys_legendre_new, phys_legendre_new(P, O, e))                                               \
    X(phys_legendre_velocity, phys_legendre_velocity(P, P, P, 1, P, e))                            \
    X(phys_ode_lagrangian, phys_ode_lagrangian(P, O, e))                                           \
    X(phys_ode_variations, phys_ode_variations(P, 1, O, e))                                        \
    X(phys_ode_parameters, phys_ode_parameters(P, 1, 1, P, O, e))                                  \
    X(phys_ode_canonical, phys_ode_canonical(P, O, e))                                             \
    X(phys_ode_gas, phys_ode_gas(P, 0, O, e))                                                      \
    X(phys_ode_hamiltonian, phys_ode_hamiltonian(NULL, 1, P, O, e))                                \
    X(phys_ode_enter, phys_ode_enter(P, 1, P, P, P, e))                                            \
    X(phys_ode_leave, phys_ode_leave(P, 1, P, P, P, e))                                            \
    X(phys_integrator_find, phys_integrator_find(P, e))                                            \
    X(phys_check_all, phys_check_all(P, P, 1, P, e))                                               \
    X(phys_check_scene, phys_check_scene(P, 1, 1, 1, 1, 1, P, e))                                  \
    X(phys_simulate, phys_simulate(P, P, P, P, e))                                                 \
    X(phys_ode_for, phys_ode_for(P, P, O, e))                                                      \
    X(phys_trajectory, phys_trajectory(P, P, P, 1, 1, P, P, e))                                    \
    X(phys_motion_path, phys_motion_path(P, P, P, P, 1, 1, P, e))                                  \
    X(phys_scene_path, phys_scene_path(P, 1, P, 1, 1, P, e))                                       \
    X(phys_published_path, phys_published_path(P, 1, 1, 1, 1, 1, P, P, e))                         \
    X(phys_typical_sizes, phys_typical_sizes(P, 1, P, P, e))                                       \
    X(phys_reference, phys_reference(P, P, P, 1, P, 1, NULL, P, P, e))                             \
    X(phys_closest_approach_begin, phys_closest_approach_begin(P, 1, P, P, e))                     \
    X(phys_crossing_read, phys_crossing_read(P, P, P, e))                                          \
    X(phys_motion_solve, phys_motion_solve(P, P, P, e))                                            \
    X(phys_motion_work, phys_motion_work(P, P, P, e))                                              \
    X(phys_motion_reactions, phys_motion_reactions(P, P, P, e))                                    \
    X(phys_observe, phys_observe(P, 1, P, P, P, e))                                                \
    X(phys_motion_check_start, phys_motion_check_start(P, 1, P, P, e))                             \
    X(phys_motion_met, phys_motion_met(P, P, e))                                                   \
    X(phys_ensemble_solve, phys_ensemble_solve(P, P, P, e))                                        \
    X(phys_ensemble_met, phys_ensemble_met(P, P, e))                                               \
    X(phys_order, phys_order(1, P, 1, P, P, O, e))                                                 \
    X(phys_pair_distribution, phys_pair_distribution(1, P, P, 1, 1, P, e))                         \
    X(phys_gas_order, phys_gas_order(P, P, O, e))                                                  \
    X(phys_normal_modes, phys_normal_modes(P, 1, P, P, O, e))                                      \
    X(phys_step_limits, phys_step_limits(P, P, e))                                                 \
    X(phys_step_advise, phys_step_advise(P, P, 1, P, P, 1, P, e))                                  \
    X(phys_lyapunov, phys_lyapunov(P, P, P, P, e))                                                 \
    X(phys_lyapunov_spectrum, phys_lyapunov_spectrum(P, P, P, 1, P, P, e))                         \
    X(phys_transition, phys_transition(P, P, P, P, P, e))                                          \
    X(phys_sensitivity, phys_sensitivity(P, P, 1, P, 1, P, P, P, e))                               \
    X(phys_periodic_find, phys_periodic_find(P, P, O, e))                                          \
    X(phys_family_follow, phys_family_follow(P, P, O, e))                                          \
    X(phys_fit_solve, phys_fit_solve(P, P, P, O, e))                                               \
    X(hnn_model_new, hnn_model_new(P, O, e))                                                       \
    X(hnn_model_new_network, hnn_model_new_network(P, HNN_HAMILTONIAN, 1, O, e))                   \
    X(hnn_model_normalise, hnn_model_normalise(P, P, P, P, e))                                     \
    X(hnn_model_see, hnn_model_see(P, 1, P, e))                                                    \
    X(hnn_model_note, hnn_model_note(P, P, P, e))                                                  \
    X(hnn_model_evaluate, hnn_model_evaluate(P, 1, P, P, P, e))                                    \
    X(hnn_model_inputs, hnn_model_inputs(P, 0, P, e))                                              \
    X(hnn_inputs_at, hnn_inputs_at(P, 0, P, e))                                                    \
    X(hnn_inputs_read, hnn_inputs_read(P, P, P, O, e))                                             \
    X(hnn_model_ode, hnn_model_ode(P, O, e))                                                       \
    X(hnn_system_open, hnn_system_open(P, O, e))                                                   \
    X(hnn_system_drive, hnn_system_drive(P, P, e))                                                 \
    X(hnn_model_mass, hnn_model_mass(P, 1, P, O, e))                                               \
    X(hnn_path_mass, hnn_path_mass(P, P, O, e))                                                    \
    X(hnn_model_encode, hnn_model_encode(P, 1, P, P, e))                                           \
    X(hnn_model_decode, hnn_model_decode(P, 1, P, P, e))                                           \
    X(hnn_model_save, hnn_model_save(P, P, P, e))                                                  \
    X(hnn_model_load, hnn_model_load(P, O, e))                                                     \
    X(hnn_model_load_network, hnn_model_load_network(P, P, O, e))                                  \
    X(hnn_schedule_find, hnn_schedule_find(P, e))                                                  \
    X(hnn_optimiser_find, hnn_optimiser_find(P, e))                                                \
    X(hnn_trainer_new, hnn_trainer_new(P, P, P, P, O, e))                                          \
    X(hnn_trainer_run, hnn_trainer_run(P, O, e))                                                   \
    X(hnn_trainer_advance, hnn_trainer_advance(P, 1, O, e))                                        \
    X(hnn_trainer_set_rate, hnn_trainer_set_rate(P, 1, e))                                         \
    X(hnn_trainer_save, hnn_trainer_save(P, P, P, e))                                              \
    X(hnn_trainer_resume, hnn_trainer_resume(P, P, e))                                             \
    X(hnn_dataset_read, hnn_dataset_read(P, O, e))                                                 \
    X(hnn_dataset_arrays, hnn_dataset_arrays(1, 1, P, P, 0, O, e))                                 \
    X(hnn_dataset_normalise, hnn_dataset_normalise(P, P, e))                                       \
    X(hnn_task_find, hnn_task_find(P, e))                                                          \
    X(hnn_task_ode, hnn_task_ode(P, 1, P, e))                                                      \
    X(hnn_task_observe, hnn_task_observe(P, P, 1, O, e))                                           \
    X(hnn_pixels_predict, hnn_pixels_predict(P, P, P, 1, O, P, O, e))                              \
    X(hnn_observe, hnn_observe(P, P, P, e))                                                        \
    X(hnn_show, hnn_show(P, P, 1, P, e))                                                           \
    X(hnn_latent_motion, hnn_latent_motion(P, 1, 1, P, P, P, P, e))                                \
    X(hnn_video_motion, hnn_video_motion(P, P, P, P, e))                                           \
    X(hnn_filter_find, hnn_filter_find(P, P, e))                                                   \
    X(hnn_rod_check, hnn_rod_check(P, e))                                                          \
    X(hnn_frames_split, hnn_frames_split(P, 1, 1, P, e))                                           \
    X(hnn_frames_read, hnn_frames_read(P, P, e))                                                   \
    X(hnn_frames_read_split, hnn_frames_read_split(P, 1, 1, NULL, P, P, e))                        \
    X(hnn_frames_save, hnn_frames_save(P, P, e))                                                   \
    X(hnn_rod_video, hnn_rod_video(P, 1, O, e))                                                    \
    X(hnn_bodies_video, hnn_bodies_video(P, P, 1, 1, 0, 1, O, e))                                  \
    X(hnn_rod_angles, hnn_rod_angles(P, 1, 1, 1, P, P, e))                                         \
    X(hnn_video_energies, hnn_video_energies(P, 1, P, P, e))                                       \
    X(hnn_path_read, hnn_path_read(P, 1, 1, O, e))                                                 \
    X(hnn_rollout, hnn_rollout(P, P, P, O, O, e))                                                  \
    X(hnn_map_rollout, hnn_map_rollout(P, P, P, O, O, e))                                          \
    X(hnn_task_published_mse, hnn_task_published_mse(P, 1, P, P, P, P, P, e))                      \
    X(hnn_task_trials, hnn_task_trials(P, P, P, P, e))                                             \
    X(qm_aliasing, qm_aliasing(P, O, e))                                                           \
    X(qm_kernel, qm_kernel(P, P, e))                                                               \
    X(qm_kernel_short, qm_kernel_short(P, P, e))                                                   \
    X(qm_kernel_square, qm_kernel_square(1, 1, P, e))                                              \
    X(qm_potential, qm_potential(P, P, P, P, e))                                                   \
    X(qm_sampled, qm_sampled(P, P, 1, O, e))                                                       \
    X(qm_eigenstates, qm_eigenstates(P, P, 1, 1, P, P, e))                                         \
    X(qm_method_find, qm_method_find(P, e))                                                        \
    X(qm_propagator_new, qm_propagator_new(P, P, O, e))                                            \
    X(qm_propagate, qm_propagate(P, 1, P, e))                                                      \
    X(qm_correlation, qm_correlation(P, 1, 1, P, P, e))                                            \
    X(qm_observe, qm_observe(P, 1, P, O, e))                                                       \
    X(qm_reference, qm_reference(P, P, 1, 1, P, P, e))                                             \
    X(qm_error, qm_error(P, P, 1, P, 1, P, P, P, e))                                               \
    X(qm_classical, qm_classical(P, P, 1, P, P, e))                                                \
    X(qm_run, qm_run(P, O, e))                                                                     \
    X(qm_slit_new, qm_slit_new(P, O, e))                                                           \
    X(qm_published_new, qm_published_new(1, O, e))                                                 \
    X(qm_published_right, qm_published_right(1, O, O, O, P, e))

/* The status returned; that of the error where something else is returned. */
#define FUNCTION(name, call)                                                                       \
    static enum ad_status call_##name(struct ad_error *e)                                          \
    {                                                                                              \
        return _Generic((call), enum ad_status : (call), default : ((void)(call), e->status));     \
    }
CALLS(FUNCTION)

static const struct {
    const char *name;
    enum ad_status (*call)(struct ad_error *e);
} table[] = {
#define ROW(name, call) {#name, call_##name},
    CALLS(ROW)};

static void test_all(void **state)
{
    volatile size_t wrong = 0;
    (void)state;
    struct sigaction action = {.sa_handler = touched, .sa_flags = SA_NODEFER}, segv, bus;
    int zero = open("/dev/zero", O_RDONLY);
    P = mmap(NULL, 1 << 16, PROT_NONE, MAP_PRIVATE, zero, 0);
    assert_true(P != MAP_FAILED);
    close(zero);
    sigaction(SIGSEGV, &action, &segv);
    sigaction(SIGBUS, &action, &bus);
    for (volatile size_t k = 0; k < sizeof table / sizeof *table; k++) {
        struct ad_error error = {AD_E_INPUT, "of an earlier call"};
        memset(results, 0x5a, sizeof results);
        if (sigsetjmp(back, 1) != 0)
            print_message("%s looks at its arguments\n", table[k].name), wrong++;
        else if (table[k].call(&error) != AD_E_INPUT)
            print_message("%s returns another status\n", table[k].name), wrong++;
        if (error.status != AD_E_INPUT || strcmp(error.message, "of an earlier call") != 0)
            print_message("%s changes the error\n", table[k].name), wrong++;
        for (size_t i = 0; i < sizeof results; i++)
            if (results[i] != 0x5a && results[i] != 0) {
                print_message("%s makes a result\n", table[k].name), wrong++;
                break;
            }
    }
    sigaction(SIGSEGV, &segv, NULL);
    sigaction(SIGBUS, &bus, NULL);
    munmap(P, 1 << 16);
    assert_int_equal(wrong, 0);
}

/* The same functions, handed NULL alone: an error with a message. */
static void test_null(void **state)
{
    size_t wrong = 0;
    (void)state;
    P = O = NULL;
    for (size_t k = 0; k < sizeof table / sizeof *table; k++) {
        struct ad_error error = {0};
        const enum ad_status status = table[k].call(&error);
        if (error.status == AD_OK || !*error.message || status != error.status)
            print_message("%s takes NULL: %d\n", table[k].name, error.status), wrong++;
    }
    assert_int_equal(wrong, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_all), cmocka_unit_test(test_null)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
