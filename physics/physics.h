/* Physics on the tape: a Lagrangian written once gives the action of a discretised path, its
   gradient, the stationary path between two ends, and the motion from a start. All of it but motion
   by integrators (motion/motion.h), stability (stability/stability.h), tables of Horizons
   (ephemeris/horizons.h) and order in a gas (gas/order.h). */
#ifndef PHYSICS_H
#define PHYSICS_H

#include "autodiff/autodiff.h"
#include "autodiff/optim.h"
#include "physics/system/system.h"
#include "physics/io/names.h"
#include "physics/lagrangian/check.h"
#include "physics/lagrangian/conserved.h"
#include "physics/lagrangian/euler_lagrange.h"
#include "physics/action/action.h"
#include "physics/path/path.h"
#include "physics/ephemeris/ephemeris.h"

#endif
