/* Checks that a shared object is not truncated (internal.h), by the header and program headers of
   the Executable and Linkable Format, System V ABI, chapters 4 and 5. */
#include "internal.h"

#include <elf.h>
#include <link.h>
#include <stdio.h>
#include <string.h>

/* [from, from + length) lies in a file of `size` bytes. */
static bool inside(uint64_t from, uint64_t length, uint64_t size)
{
    return from <= size && length <= size - from;
}

static bool read_at(FILE *in, uint64_t from, void *to, size_t length)
{
    return fseek(in, (long)from, SEEK_SET) == 0 && fread(to, 1, length, in) == length;
}

static bool is_whole(FILE *in)
{
    ElfW(Ehdr) head;
    ElfW(Phdr) part;
    if (!read_at(in, 0, &head, sizeof head) || fseek(in, 0, SEEK_END) != 0)
        return false;
    uint64_t size = (uint64_t)ftell(in);
    if (memcmp(head.e_ident, ELFMAG, SELFMAG) != 0 || head.e_type != ET_DYN ||
        head.e_phentsize != sizeof part ||
        !inside(head.e_phoff, (uint64_t)head.e_phnum * sizeof part, size) ||
        !inside(head.e_shoff, (uint64_t)head.e_shnum * head.e_shentsize, size))
        return false;
    size_t loaded = 0;
    for (size_t k = 0; k < head.e_phnum; k++) {
        if (!read_at(in, head.e_phoff + k * sizeof part, &part, sizeof part) ||
            (part.p_type == PT_LOAD && !inside(part.p_offset, part.p_filesz, size)))
            return false;
        loaded += part.p_type == PT_LOAD;
    }
    return loaded > 0;
}

bool phys_library_is_complete(const char *file)
{
    FILE *in = fopen(file, "rb");
    bool whole = in && is_whole(in);
    if (in)
        fclose(in);
    return whole;
}
