/* For physics/ only. */
#ifndef PHYSICS_STABILITY_INTERNAL_H
#define PHYSICS_STABILITY_INTERNAL_H

#include "diagnostics.h"

/* The derivatives [n][2 dof] of the scene's start (q, v) by n parameters, and what they may be off
   by; by differences. AD_E_NONFINITE where there is none. */
enum ad_status phys_start_slopes(const struct phys_system *system, uint64_t seed, size_t n,
                                 const char *const names[], double *slope, double *uncertainty,
                                 struct ad_error *error);

/* Adds a warning where steps of an implicit method, tried, are as good and cost less
   (stiffness.c). */
void phys_judge_stiffness(const struct phys_motion_settings *settings,
                          const struct phys_motion_solution *m, struct phys_diagnosis *d);

#endif
