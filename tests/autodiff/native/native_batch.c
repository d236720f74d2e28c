/* Sources of many programs in one file (native_batch.h). Each source's definitions get a suffix:
   its names end in a digit, except those in `others`; some names of libmvec and libm do, too. */
#include "native_batch.h"

#include "tests/files.h"

#include <ctype.h>
#include <dlfcn.h>
#include <stdlib.h>
#include <string.h>

static bool is_own(const char *name, size_t length)
{
    static const char *const others[] = {"R", "I", "numbers"};
    static const char *const library[] = {"expm1", "atan2"};
    for (size_t k = 0; k < sizeof others / sizeof *others; k++)
        if (strlen(others[k]) == length && memcmp(name, others[k], length) == 0)
            return true;
    for (size_t k = 0; k < sizeof library / sizeof *library; k++)
        if (strlen(library[k]) == length && memcmp(name, library[k], length) == 0)
            return false;
    return strncmp(name, "_ZGV", 4) != 0 && isdigit((unsigned char)name[length - 1]);
}

static bool in_word(char c) { return isalnum((unsigned char)c) || c == '_'; }

/* Numbers are words that begin with a digit; strings are instructions of the processor. */
static void write_renamed(FILE *out, const char *text, size_t program)
{
    while (*text) {
        size_t length = 1;
        if (*text == '"')
            length = strcspn(text + 1, "\"") + 2;
        else
            while (in_word(*text) && in_word(text[length]))
                length++;
        fwrite(text, 1, length, out);
        if (in_word(*text) && !isdigit((unsigned char)*text) && is_own(text, length))
            fprintf(out, "_p%zu", program);
        text += length;
    }
}

static size_t isa_of(struct native_batch *b, const ad_program *p)
{
    size_t k = 0;
    while (b->isas[k] && strcmp(b->isas[k], p->kernels->isa) != 0)
        k++;
    if (!b->isas[k]) {
        b->isas[k] = p->kernels->isa;
        b->sources[k] = open_memstream(&b->texts[k], &b->bytes[k]);
        if (!b->sources[k])
            abort();
    }
    return k;
}

bool native_batch_add(struct native_batch *b, ad_program *p)
{
    struct native *native = calloc(1, sizeof *native);
    char *source = native ? ad_native_source(p, native) : NULL;
    if (!source || b->n == BATCH_PROGRAMS)
        abort();
    bool any = ad_native_functions(native) > 0;
    if (any) {
        write_renamed(b->sources[isa_of(b, p)], source, b->n);
        b->programs[b->n] = p;
        b->natives[b->n++] = native;
    } else {
        ad_native_free(native);
    }
    free(source);
    return any;
}

static bool compile(struct native_batch *b, size_t isa, const struct compiler *compiler)
{
    /* the set's name: what is loaded under a name that is loaded already is not looked at */
    struct path source = files_temporary("batch.c"), object = files_temporary(b->isas[isa]);
    _Atomic pid_t running = 0;
    struct ad_error note = {0};
    FILE *file = fopen(source.text, "w");
    if (!file || fclose(b->sources[isa]) != 0 ||
        fwrite(b->texts[isa], 1, b->bytes[isa], file) != b->bytes[isa] || fclose(file) != 0)
        abort();
    b->sources[isa] = NULL;
    if (ad_cc_compile(compiler, b->isas[isa], source.text, object.text, &running, &note))
        b->libraries[isa] = dlopen(object.text, RTLD_NOW | RTLD_LOCAL);
    if (!b->libraries[isa])
        fprintf(stderr, "%s: %s %s\n", b->isas[isa], note.message, *note.message ? "" : dlerror());
    remove(source.text);
    remove(object.text);
    return b->libraries[isa];
}

/* The functions of program k. */
static bool put(struct native_batch *b, size_t k)
{
    size_t n = ad_native_functions(b->natives[k]);
    ad_segment_code **functions = malloc(n * sizeof *functions);
    void *library = b->libraries[isa_of(b, b->programs[k])];
    bool all = functions;
    for (size_t i = 0; all && i < n; i++) {
        char name[48];
        snprintf(name, sizeof name, "run%zu_p%zu", i, k);
        void *symbol = dlsym(library, name);
        memcpy(&functions[i], &symbol, sizeof symbol);
        all = symbol;
    }
    all = all && ad_native_put(b->programs[k], b->natives[k], functions);
    if (all)
        b->natives[k] = NULL;
    free(functions);
    return all;
}

bool native_batch_load(struct native_batch *b)
{
    struct compiler compiler = {.identity = ""};
    struct ad_error note = {0};
    bool done = ad_cc_find(&compiler, &note);
    for (size_t isa = 0; done && isa < BATCH_ISAS && b->isas[isa]; isa++)
        done = compile(b, isa, &compiler);
    for (size_t k = 0; done && k < b->n; k++)
        done = put(b, k);
    return done;
}

void native_batch_release(struct native_batch *b)
{
    for (size_t k = 0; k < b->n; k++)
        ad_native_free(b->natives[k]);
    for (size_t isa = 0; isa < BATCH_ISAS; isa++) {
        if (b->sources[isa])
            fclose(b->sources[isa]);
        if (b->libraries[isa])
            dlclose(b->libraries[isa]);
        free(b->texts[isa]);
    }
    *b = (struct native_batch){0};
}
