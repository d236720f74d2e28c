/* The column behind the error of a program with small systems. */
#ifndef AUTODIFF_SINGULAR_H
#define AUTODIFF_SINGULAR_H

#include "program.h"

/* The first column of the last run whose matrix is singular to rounding; SIZE_MAX if none is. */
size_t ad_program_singular(const ad_program *program);

#endif
