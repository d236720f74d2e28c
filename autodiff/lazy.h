/* Functions and variables of shared libraries that are loaded on first use: loading HDF5 and
   OpenBLAS takes three times as long as a small job. After the library's own header, whose types
   hold,

   #define cblas_dgemm AD_LAZY(ad_blas_load, cblas_dgemm)

   and calls look as ever. A library that cannot be loaded ends the process with status 127, as the
   dynamic loader does at the start. */
#ifndef AUTODIFF_LAZY_H
#define AUTODIFF_LAZY_H

#include "libraries.h" /* made by the Makefile: AD_LIBRARY_hdf5, AD_LIBRARY_openblas */

/* The address of `name` in a library; NULL: not there. */
void *ad_lazy_find(const char *library, const char *name);
/* The same, kept in *slot, or the end of the process. */
void *ad_lazy_load(void **slot, const char *library, const char *name);

/* `load`: a function of slot and name. */
#define AD_LAZY(load, name)                                                                        \
    __extension__({                                                                                \
        static void *lazy_slot;                                                                    \
        void *lazy_at = __atomic_load_n(&lazy_slot, __ATOMIC_ACQUIRE);                             \
        (__typeof__(&name))(lazy_at ? lazy_at : load(&lazy_slot, #name));                          \
    })

#endif
