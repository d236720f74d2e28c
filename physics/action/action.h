/* The action of a discretised path: quadrature rules on elements, and the action on the tape.

   Units are the scene's. Errors: AD_E_ARGUMENT for NULL and numbers out of range, AD_E_MEMORY,
   AD_E_NONFINITE where L is not finite, and those named. Threads: calls may run at once unless
   they change one object; a system may be read by several. */
#ifndef PHYSICS_ACTION_ACTION_H
#define PHYSICS_ACTION_ACTION_H

#include "physics/system/system.h"

AD_HEADER_BEGIN

enum { PHYS_RULE_MOST = 24 }; /* largest degree, and number of points, of a rule */

/* The coefficients of a rule of degree s on an element, the interval of length dt between two
   slices. The path there is the polynomial through s + 1 nodes X_k, which include both slices, and
   S = dt sum_j weight_j L(q_j, v_j, t + time_j dt), q_j = sum_k q_jk X_k, v_j = (1/dt) sum_k v_jk
   X_k. */
struct phys_rule_table {
    size_t degree, points;
    double node[PHYS_RULE_MOST + 1]; /* positions of the nodes: 0 ... 1 */
    double time[PHYS_RULE_MOST], weight[PHYS_RULE_MOST];
    double q[PHYS_RULE_MOST][PHYS_RULE_MOST + 1], v[PHYS_RULE_MOST][PHYS_RULE_MOST + 1];
};

/* An action rule: one file, one line in the table. A path of a rule of degree s is [s*dof x
   slices]. Rows 0 ... dof-1 are the coordinates at the slices; rows k*dof ... are node k of the
   element that begins at that slice. A column thus holds all nodes of an element but the last,
   which is the first of the next column. The inner nodes of the last column are unused. */
struct phys_rule {
    const char *name, *what;
    size_t order;  /* order of convergence to the motion as dt falls */
    size_t degree; /* s */
    bool repeat;   /* left+repeat: the last slice counts as well, with the velocity before it */
    void (*fill)(const struct phys_rule *rule, struct phys_rule_table *table);
};
extern const struct phys_rule *const phys_rules[]; /* NULL-terminated; higher gauss rules exist */
/* By name: one of phys_rules, or gaussN up to N = PHYS_RULE_MOST; NULL and AD_E_ARGUMENT, naming
   the nearest, if there is none. */
const struct phys_rule *phys_rule_find(const char *name, struct ad_error *error);

/* The points at which the rule evaluates a path x [s*dof x n]: q, v [dof x m], t [1 x m], and the
   weight of each point in units of dt (1 x 1 where all are equal). Points are ordered by their
   number in the element, then by element. The path begins at t = 0. */
struct phys_rule_points {
    ad_var q, v, t, weight;
    size_t elements; /* points j*elements ... (j+1)*elements - 1 are in order of time */
};
void phys_rule_points(const struct phys_rule *rule, ad_var x, double dt,
                      struct phys_rule_points *points);
/* Puts the inner nodes of a path [s*dof x slices] on cubics through its slices. */
void phys_rule_interpolate(const struct phys_rule *rule, size_t dof, size_t slices, double *path);
/* All nodes of a path in order of time: nodes [dof x s*(slices-1)+1], and their times (NULL: not
   wanted). */
void phys_rule_nodes(const struct phys_rule *rule, size_t dof, size_t slices, double dt,
                     const double *path, double *nodes, double *times);

/* The action on a tape: path -> S, T, V and the objective that a descent minimises. */
struct phys_action {
    ad_var path;                                      /* input [s*dof x slices] */
    ad_var L;                                         /* at the points of the rule [1 x m] */
    ad_var kinetic_mean, potential_mean, action_mean; /* sums over slices / slices (and / bodies) */
    ad_var action;                                    /* integral: dt * sum of L */
    ad_var start_energy; /* input [1 x 1]: E0, held fixed along a descent */
    ad_var first_energy; /* energy of the first slice, the value to set E0 to */
    ad_var energy;       /* E_i = (v L_v - L) / slices (and / bodies), scaled as published, at the
                            points of the rule [1 x m] */
    ad_var energy_mean;  /* of v L_v - L over the elements, not scaled */
    ad_var objective;    /* action_mean + energy_weight * mean (E0 - E_i)^2 */
    struct phys_rule_points points;
};
/* Records the action, with an input for the path; errors of scene or rule are kept in the tape,
   whose status is returned. */
enum ad_status phys_action_record(ad_tape *tape, const struct phys_system *system,
                                  const struct phys_rule *rule, size_t slices, double dt,
                                  double energy_weight, struct phys_action *action);
/* Adds weight * mean (E_i - E_i-1)^2 to the objective: a penalty on the change of energy between
   slices. */
void phys_action_hold_energy(struct phys_action *action, double weight);

AD_HEADER_END
#endif
