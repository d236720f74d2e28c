/* Arrays that grow by one element at a time. */
#ifndef PHYSICS_IO_GROW_H
#define PHYSICS_IO_GROW_H

#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* Room for one more of the n elements of `size` bytes of an array that only this function grows, to
   powers of two; `array` is the address of the pointer to it. False: out of memory, the array as
   it was. */
static inline bool phys_grow(void *array, size_t n, size_t size)
{
    void *old;
    if ((n & (n - 1)) != 0)
        return true;
    memcpy(&old, array, sizeof old);
    void *grown = n > SIZE_MAX / 2 / size ? NULL : realloc(old, (n ? 2 * n : 1) * size);
    if (grown)
        memcpy(array, &grown, sizeof grown);
    return grown != NULL;
}

#endif
