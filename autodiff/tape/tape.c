/* The tape: growing arrays of nodes, constants, lists and labels. */
#include "autodiff/free.h"
#include "autodiff/internal.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

const struct op_info ad_ops[AD_N_OPS] = {
#define AD_STRUCTURE(name, arity) [AD_OP_##name] = {#name, arity, false},
#define AD_UNARY(name, value, dx, lo, hi) [AD_OP_##name] = {#name, 1, true},
#define AD_BINARY(name, value, da, db, lo, hi) [AD_OP_##name] = {#name, 2, true},
#define AD_TERNARY(name, value, da, db, dc, lo, hi) [AD_OP_##name] = {#name, 3, true},
#include "autodiff/ops.def"
};

const char *ad_op_name(enum ad_op op) { return (unsigned)op < AD_N_OPS ? ad_ops[op].name : "?"; }

bool ad_reserve(void **array, size_t n, size_t *max, size_t more, size_t size)
{
    if (more <= *max - n)
        return true;
    size_t grown = *max + *max / 2 + 16;
    if (grown < n + more)
        grown = n + more;
    if (grown > SIZE_MAX / size)
        return false;
    void *moved = realloc(*array, grown * size);
    if (!moved)
        return false;
    *array = moved;
    *max = grown;
    return true;
}

static enum ad_status out_of_memory(ad_tape *tape)
{
    return ad_fail(&tape->error, AD_E_MEMORY, "out of memory after %zu nodes", tape->n_nodes);
}

/* Node 0 is the constant 0, which failed operations return, so that handles stay valid. */
static bool record_zero(ad_tape *tape)
{
    uint32_t number = ad_append_numbers(tape, 1, &(double){0});
    if (number == UINT32_MAX)
        return false;
    ad_append(tape, (struct node){.op = AD_OP_constant, .rows = 1, .cols = 1, .aux = number});
    return tape->error.status == AD_OK;
}

/* Recordings of all tapes are numbered from 1 on, so that a program, which outlives its tape,
   distinguishes its variables from those of a later tape at the same address. */
static uint32_t next_recording(void)
{
    static atomic_uint_least32_t last;
    uint32_t number;
    do
        number = (uint32_t)atomic_fetch_add_explicit(&last, 1, memory_order_relaxed) + 1;
    while (number == 0);
    return number;
}

ad_tape *ad_tape_new(enum ad_type type)
{
    ad_tape *tape = type == AD_F32 || type == AD_F64 ? calloc(1, sizeof *tape) : NULL;
    if (!tape)
        return NULL;
    tape->type = type;
    tape->recording = next_recording();
    if (!record_zero(tape)) {
        ad_tape_free(tape);
        return NULL;
    }
    return tape;
}

static void *copy_of(const void *array, size_t bytes, bool *done)
{
    void *copy = bytes ? malloc(bytes) : NULL;
    if (copy)
        memcpy(copy, array, bytes);
    *done = *done && (copy || !bytes);
    return copy;
}

/* How many blocks the one that follows `n` others is allocated with; 0: it lies in the group of one
   of those. */
static size_t blocks_from(size_t n)
{
    if (n < SINGLE_BLOCKS)
        return 1;
    return (n - SINGLE_BLOCKS) % GROUPED_BLOCKS ? 0 : GROUPED_BLOCKS;
}

static bool add_block(ad_tape *tape)
{
    const size_t n = tape->n_blocks, count = blocks_from(n);
    if (!ad_reserve((void **)&tape->blocks, n, &tape->max_blocks, 1, sizeof *tape->blocks))
        return false;
    struct node *block = count ? ad_allocate_large(count * BLOCK_SIZE * sizeof *block)
                               : tape->blocks[n - 1] + BLOCK_SIZE;
    if (!block)
        return false;
    tape->blocks[tape->n_blocks++] = block;
    return true;
}

ad_tape *ad_tape_copy(const ad_tape *tape)
{
    bool done = true;
    ad_tape *copy = copy_of(tape, sizeof *tape, &done);
    if (!copy)
        return NULL;
    copy->direct = NULL;
    copy->loops = NULL;
    copy->n_loops = copy->max_loops = 0;
    copy->blocks = NULL;
    copy->n_blocks = copy->max_blocks = 0;
    copy->max_numbers = tape->n_numbers;
    copy->max_lists = tape->n_lists;
    copy->max_customs = tape->n_customs;
    copy->max_labels = tape->n_labels;
    copy->max_texts = tape->n_texts;
    copy->numbers = copy_of(tape->numbers, tape->n_numbers * sizeof *tape->numbers, &done);
    copy->lists = copy_of(tape->lists, tape->n_lists * sizeof *tape->lists, &done);
    copy->customs = copy_of(tape->customs, tape->n_customs * sizeof *tape->customs, &done);
    copy->labels = copy_of(tape->labels, tape->n_labels * sizeof *tape->labels, &done);
    copy->texts = copy_of(tape->texts, tape->n_texts, &done);
    for (size_t k = 0; done && k < tape->n_blocks; k++)
        if ((done = add_block(copy)))
            memcpy(copy->blocks[k], tape->blocks[k], BLOCK_SIZE * sizeof(struct node));
    done = done && ad_loops_copy(copy, tape);
    if (done)
        return copy;
    ad_tape_free(copy);
    return NULL;
}

void ad_tape_reset(ad_tape *tape)
{
    if (!tape || tape->freed)
        return;
    tape->error = (struct ad_error){0};
    tape->recording = next_recording();
    tape->n_scalars = tape->last_input = 0;
    tape->n_nodes = tape->n_numbers = tape->n_lists = tape->n_customs = tape->n_labels =
        tape->n_texts = 0;
    ad_direct_reset(tape->direct);
    ad_loops_free(tape);
    record_zero(tape); /* cannot fail: the memory was kept */
}

/* What is left of the last freed tapes refuses their variables. */
static void keep_freed(ad_tape *tape)
{
    static _Atomic(ad_tape *) freed[AD_FREED_TAPES];
    static atomic_uint last;
    *tape = (ad_tape){.type = tape->type, .freed = true, .recording = next_recording()};
    ad_fail(&tape->error, AD_E_TAPE, "the tape was freed");
    free(atomic_exchange(&freed[atomic_fetch_add(&last, 1) % AD_FREED_TAPES], tape));
}

void ad_tape_free(ad_tape *tape)
{
    if (!tape || tape->freed)
        return;
    for (size_t i = 0; i < tape->n_blocks; i++)
        if (blocks_from(i))
            free(tape->blocks[i]);
    AD_FREE(tape->blocks, tape->numbers, tape->lists, tape->customs, tape->labels, tape->texts);
    ad_direct_free(tape->direct);
    ad_loops_free(tape);
    free(tape->loops);
    keep_freed(tape);
}

const struct ad_error *ad_tape_error(const ad_tape *tape)
{
    static const struct ad_error no_tape = {AD_E_MEMORY, "no tape: out of memory"};
    return tape ? &tape->error : &no_tape;
}

size_t ad_tape_size(const ad_tape *tape) { return tape ? tape->n_nodes : 0; }

size_t ad_tape_bytes(const ad_tape *tape)
{
    if (!tape)
        return 0;
    size_t bodies = tape->max_loops * sizeof *tape->loops;
    for (size_t k = 0; k < tape->n_loops; k++)
        bodies += ad_tape_bytes(tape->loops[k].body);
    return sizeof *tape + bodies + tape->n_blocks * BLOCK_SIZE * sizeof(struct node) +
           tape->max_blocks * sizeof *tape->blocks + tape->max_numbers * sizeof *tape->numbers +
           tape->max_lists * sizeof *tape->lists + tape->max_customs * sizeof *tape->customs +
           tape->max_labels * sizeof *tape->labels + tape->max_texts +
           ad_direct_bytes(tape->direct);
}

static bool is_plain(const struct node *n)
{
    return n->rows == 1 && n->cols == 1 && n->op != AD_OP_constant && n->op != AD_OP_neg &&
           n->op != AD_OP_square && n->op != AD_OP_tanh_slope;
}

ad_var ad_append(ad_tape *tape, struct node node)
{
    ad_var zero = ad_at(tape, 0);
    if (tape->error.status != AD_OK ||
        (!ad_is_shape(node.rows, node.cols) &&
         !ad_shape_fits(tape, node.op, 0, NULL, node.rows, node.cols)))
        return zero;
    if (tape->n_nodes >= UINT32_MAX - 1 ||
        (tape->n_nodes == tape->n_blocks * BLOCK_SIZE && !add_block(tape))) {
        out_of_memory(tape);
        return zero;
    }
    if (is_plain(&node))
        node.flags |= NODE_PLAIN;
    uint32_t id = (uint32_t)tape->n_nodes++;
    tape->n_scalars += tape->n_scalars == id && node.rows == 1 && node.cols == 1;
    *node_at(tape, id) = node;
    return ad_at(tape, id);
}

uint32_t ad_append_numbers(ad_tape *tape, size_t n, const double *values)
{
    if (n >= UINT32_MAX - tape->n_numbers ||
        !ad_reserve((void **)&tape->numbers, tape->n_numbers, &tape->max_numbers, n,
                    sizeof *tape->numbers)) {
        out_of_memory(tape);
        return UINT32_MAX;
    }
    memcpy(tape->numbers + tape->n_numbers, values, n * sizeof *values);
    tape->n_numbers += n;
    return (uint32_t)(tape->n_numbers - n);
}

uint32_t ad_append_list(ad_tape *tape, size_t n, const uint32_t *values)
{
    if (n + 1 >= UINT32_MAX - tape->n_lists ||
        !ad_reserve((void **)&tape->lists, tape->n_lists, &tape->max_lists, n + 1,
                    sizeof *tape->lists)) {
        out_of_memory(tape);
        return UINT32_MAX;
    }
    uint32_t *list = tape->lists + tape->n_lists;
    list[0] = (uint32_t)n;
    memcpy(list + 1, values, n * sizeof *values);
    tape->n_lists += n + 1;
    return (uint32_t)(tape->n_lists - n - 1);
}

size_t ad_rows(ad_var x) { return ad_is_current(x) ? node_at(x.tape, x.id)->rows : 0; }

size_t ad_cols(ad_var x) { return ad_is_current(x) ? node_at(x.tape, x.id)->cols : 0; }

bool ad_constant_value(ad_var x, double *value)
{
    const struct node *n = ad_is_current(x) && value ? node_at(x.tape, x.id) : NULL;
    if (!n || n->op != AD_OP_constant || node_size(n) != 1)
        return false;
    *value = x.tape->numbers[n->aux];
    return true;
}

ad_var ad_label(ad_var x, const char *label)
{
    ad_tape *tape = x.tape;
    ad_var none;
    if (!label || !ad_operands(AD_COMPOSITE_label, 1, &x, &none))
        return x;
    size_t length = strlen(label) + 1;
    if (length > UINT32_MAX - tape->n_texts ||
        !ad_reserve((void **)&tape->texts, tape->n_texts, &tape->max_texts, length, 1) ||
        !ad_reserve((void **)&tape->labels, tape->n_labels, &tape->max_labels, 1,
                    sizeof *tape->labels)) {
        out_of_memory(tape);
        return x;
    }
    memcpy(tape->texts + tape->n_texts, label, length);
    tape->labels[tape->n_labels++] = (struct label){x.id, (uint32_t)tape->n_texts};
    tape->n_texts += length;
    node_at(tape, x.id)->flags |= NODE_LABELLED;
    return x;
}
