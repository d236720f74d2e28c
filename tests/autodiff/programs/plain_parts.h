/* Parts of the plain evaluation (plain.h). */
#ifndef TESTS_AUTODIFF_PROGRAMS_PLAIN_PARTS_H
#define TESTS_AUTODIFF_PROGRAMS_PLAIN_PARTS_H

#include "plain.h"

#include "autodiff/internal.h"

/* What was allocated; NULL ends the program. */
void *plain_memory(void *memory);
/* Half the distance from 1 to the next number of the tape's type. */
double plain_unit(const struct plain *p);
/* Where x, stretched to the size of a result, has what belongs to (r, c). */
size_t plain_element(const struct node *x, size_t r, size_t c);
void plain_elementwise(struct plain *p, uint32_t id, const struct node *n);
/* The ring of tests/autodiff/ring.h, the only operation of its own of a random program. */
void plain_custom(struct plain *p, uint32_t id, const struct node *n);
/* A solution, or the logarithm of a determinant. */
void plain_small_system(struct plain *p, uint32_t id, const struct node *n);

#endif
