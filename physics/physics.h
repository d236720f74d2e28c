/* Physics on the tape, all public headers: from one Lagrangian come the action of a discretised
   path, its gradient, the stationary path between two ends, and the motion from a start.

   Conventions. Coordinates, times and energies are in the scene's units. A function with a status
   returns AD_E_ARGUMENT for a NULL that is not allowed and for arguments out of range,
   AD_E_NONFINITE where L or a state is not finite, AD_E_ACCURACY where an accuracy is out of reach
   or a callback stopped it, AD_E_MEMORY when out of memory, and the errors of what it calls;
   *error, zero-initialised by the caller, gets the message. What is to be freed in any case is
   freed after a failure, too. */
#ifndef PHYSICS_H
#define PHYSICS_H

#include "autodiff/autodiff.h"
#include "autodiff/optim.h"
#include "physics/action/action.h"
#include "physics/ephemeris/ephemeris.h"
#include "physics/ephemeris/horizons.h"
#include "physics/ephemeris/models.h"
#include "physics/gas/order.h"
#include "physics/integrators/integrators.h"
#include "physics/io/names.h"
#include "physics/lagrangian/check.h"
#include "physics/lagrangian/conserved.h"
#include "physics/lagrangian/euler_lagrange.h"
#include "physics/lagrangian/legendre.h"
#include "physics/motion/checks.h"
#include "physics/motion/motion.h"
#include "physics/motion/solve.h"
#include "physics/ode/ode.h"
#include "physics/path/path.h"
#include "physics/stability/diagnostics.h"
#include "physics/stability/stability.h"
#include "physics/system/system.h"

#endif
