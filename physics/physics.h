/* Physics on the tape, all public headers: from one Lagrangian come the action of a discretised
   path, its gradient, the stationary path between two ends, and the motion from a start.

   Conventions. Coordinates, times and energies are in the scene's units. A function with a status
   returns AD_E_ARGUMENT for a NULL that is not allowed and for arguments out of range,
   AD_E_NONFINITE where L or a state is not finite, AD_E_ACCURACY where an accuracy is out of reach
   or a callback stopped it, AD_E_MEMORY when out of memory, and the errors of what it calls;
   *error, zero-initialised by the caller and never NULL, gets the message. What is to be freed in
   any case is freed after a failure, too.

   Folders, lowest first, with their public headers (internal.h: for physics/ only):

       linear/, io/    linear algebra; CSV, HDF5, numbers, names, atomic files
       system/         scenes and systems                      system.h
       lagrangian/     checks, momenta and energy, motion of L check.h, legendre.h, conserved.h, ...
       scenes/         the built-in scenes                     scenes.def
       action/         the discrete action and its rules       action.h
       ode/            vector fields                           ode.h
       integrators/    methods by name                         integrators.h
       motion/         one method; a complete motion           motion.h; solve.h
       stability/      step limits, chaos, periodic motions    stability.h, family.h, ...
       fit/            parameters from measured motions        fit.h
       modes/          equilibria, small oscillations          modes.h
       gas/            order and fast motion of a gas          order.h
       ephemeris/      Horizons tables, models of the planets  horizons.h, models.h
       path/           stationary paths; all/: all of them     path.h; ranks/path_ranks.h */
#ifndef PHYSICS_PHYSICS_H
#define PHYSICS_PHYSICS_H

#include "autodiff/autodiff.h"
#include "autodiff/optim.h"
#include "physics/action/action.h"
#include "physics/ephemeris/ephemeris.h"
#include "physics/ephemeris/horizons.h"
#include "physics/ephemeris/models.h"
#include "physics/fit/fit.h"
#include "physics/gas/order.h"
#include "physics/integrators/integrators.h"
#include "physics/io/names.h"
#include "physics/lagrangian/check.h"
#include "physics/lagrangian/conserved.h"
#include "physics/lagrangian/euler_lagrange.h"
#include "physics/lagrangian/legendre.h"
#include "physics/modes/modes.h"
#include "physics/motion/checks.h"
#include "physics/motion/motion.h"
#include "physics/motion/ensemble.h"
#include "physics/motion/solve.h"
#include "physics/ode/ode.h"
#include "physics/path/path.h"
#include "physics/path/ranks/path_ranks.h"
#include "physics/stability/diagnostics.h"
#include "physics/stability/family.h"
#include "physics/stability/periodic.h"
#include "physics/stability/stability.h"
#include "physics/system/system.h"

#endif
