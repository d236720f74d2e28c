/* Memory that a recording touches once, from one end to the other: by pages of 2 MB, where the
   system has them, a page fault serves 70000 operations rather than 140. */
#define _DEFAULT_SOURCE /* madvise */
#include "autodiff/internal.h"

#include <stdlib.h>
#include <sys/mman.h>

void *ad_allocate_large(size_t bytes)
{
    const size_t page = (size_t)1 << 21;
    if (bytes < page || bytes > SIZE_MAX - page)
        return malloc(bytes);
    void *memory = aligned_alloc(page, (bytes + page - 1) / page * page);
#ifdef MADV_HUGEPAGE
    if (memory)
        madvise(memory, (bytes + page - 1) / page * page, MADV_HUGEPAGE);
#endif
    return memory;
}
