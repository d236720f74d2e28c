/* Fuzzer of the check before a shared object is loaded: no file crashes it, and accepted files are
   complete. */
#include "fuzz.h"

#include "physics/system/internal.h"

int fuzz_library(const uint8_t *data, size_t size)
{
    int whole = phys_library_is_complete(fuzz_file(data, size));
    fuzz_require(!whole || (size >= 64 && memcmp(data, "\177ELF", 4) == 0));
    return 0;
}
