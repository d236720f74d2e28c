/* Systems of textbooks with integrals of the motion, and closed forms less the motion, as
   observables: how far they change, which is by 0. */
#ifndef TESTS_PHYSICS_MOTION_TEXTBOOK_KEPT_H
#define TESTS_PHYSICS_MOTION_TEXTBOOK_KEPT_H

double textbook_toda(void), textbook_foucault(void), textbook_stormer(void), textbook_top(void),
    textbook_pushed(void), textbook_kepler(void);

#endif
