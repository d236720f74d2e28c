/* The release of these headers, and that of the library which the program runs with: see
   docs/compatibility.md for what may differ. Threads: any. */
#ifndef AUTODIFF_VERSION_H
#define AUTODIFF_VERSION_H

#define LEASTACTION_VERSION_MAJOR 0
#define LEASTACTION_VERSION_MINOR 1
#define LEASTACTION_VERSION_PATCH 0
#define LEASTACTION_VERSION "0.1.0"
/* For #if, as LEASTACTION_VERSION_NUMBER >= 102 for 0.1.2 and later. */
#define LEASTACTION_VERSION_NUMBER                                                                 \
    (LEASTACTION_VERSION_MAJOR * 10000 + LEASTACTION_VERSION_MINOR * 100 +                         \
     LEASTACTION_VERSION_PATCH)

#ifdef __cplusplus
extern "C" {
#endif
/* "MAJOR.MINOR.PATCH" of the library; a constant. */
const char *leastaction_version(void);
#ifdef __cplusplus
}
#endif

#endif
