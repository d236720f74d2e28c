/* Power series of a recording: its elements become jets (build.c; elementwise.c has the rules, from
   ops.def; structure.c what moves and sums), which are carried on order by order (advance.c).
   series.c is the outside. */
#ifndef AUTODIFF_SERIES_INTERNAL_H
#define AUTODIFF_SERIES_INTERNAL_H

#include "autodiff/exec/program.h"
#include "autodiff/internal.h"
#include "autodiff/series.h"

/* How coefficient k of a jet y follows from those of a and b, and of da and db below k. */
enum jet_kind {
    JET_NUMBER,    /* number */
    JET_INPUT,     /* set by the caller */
    JET_COMBINE,   /* a + number b */
    JET_SCALE,     /* number a */
    JET_SHIFT,     /* a + number */
    JET_SLOPE,     /* k times coefficient k of a */
    JET_PRODUCT,   /* a b */
    JET_PRODUCT0,  /* the same, 0 where either coefficient is */
    JET_SQUARE,    /* a a */
    JET_QUOTIENT,  /* a / b */
    JET_RECIP,     /* 1 / a */
    JET_RECIP0,    /* the same, 0 where a is */
    JET_ROOT,      /* square root of a */
    JET_POWER,     /* a to the number */
    JET_INTEGRAL,  /* op(a, b), whose derivative is da a' + db b'; ea and eb are the slopes */
    JET_PIECEWISE, /* op(a, b), constant but for jumps */
    JET_SELECT     /* da where a is not 0, else db */
};

#define JET_NONE UINT32_MAX

struct jet {
    uint16_t kind, op;
    uint32_t a, b, da, db, ea, eb;
    double number;
};

enum { JET_OPERANDS = 6 };
/* Operand k, or JET_NONE. */
static inline uint32_t *ad_jet_operand(struct jet *it, size_t k)
{
    uint32_t *const operands[JET_OPERANDS] = {&it->a, &it->b, &it->da, &it->db, &it->ea, &it->eb};
    return operands[k];
}

struct ad_series {
    size_t order, stride; /* coefficients of jet i are those from i stride on */
    struct jet *jets;
    size_t n, max;
    double *coefficients;
    double *low;         /* [n] what rounding cut off coefficients 0 (cut.c) */
    size_t *first_input; /* [n_x]: inputs are the first jets */
    uint32_t *output;    /* the jets of all elements of y, those of y[k] from first_output[k] on */
    size_t *first_output, n_output;
    size_t branches;
    const struct jet *kink; /* the first of them */
    size_t n_input, n_flow; /* elements of x; n of ad_series_flow, once called */
    const double *cut;      /* [n_cut] of the point that ad_series_interpret is at, else NULL */
    size_t n_cut;
    struct series_code *code; /* NULL: interpreted */
    double spent;             /* seconds of the interpreter in ad_series_flow */
    double next_try;          /* compile when so much is spent; INFINITY: never */
};

/* Coefficient 0 of a jet from those of its operands: of a, b, da and db. */
double ad_jet_evaluate(const struct jet *it, const double x[4]);

/* sin x, or cos x (quarter 1): see circle.def. */
double ad_jet_circle(double x, int quarter);

/* Coefficients 1 to `order` of the flow, from those of order 0: machine code, which
   does the same operations in the same order as ad_series_advance (flow.c, emit.c, lanes.c).
   `coefficients` has inputs that are not of the flow, and receives the values of outputs that are
   not rates. */
typedef void ad_flow_code(double evaluate(const struct jet *it, const double x[4]),
                          const struct jet *jets, double *coefficients, const double *numbers,
                          double *packs, double *c, size_t order);
struct series_code {
    void *library;
    ad_flow_code *run;
    double *numbers, *packs;
};
void ad_series_code_free(struct series_code *code);
/* The source of `run`, for vectors of at most `lanes`, freed by the caller; *packs is the number of
   doubles of its memory. many: of AD_SERIES_POINTS points at once, so that every double of the
   above is a vector, and coefficients and values of jets lie without a stride; with the sums of the
   series, ad_sums_code. NULL when out of memory. */
char *ad_series_source(const ad_series *series, size_t lanes, bool many, size_t *packs);
/* Machine code of that source: from the cache; compiled if not there and `build`. NULL, with the
   reason in note. */
void *ad_series_load(const ad_series *s, bool many, bool build, size_t *packs,
                     ad_segment_code *functions[], struct ad_error *note);
/* How many of a jet's operands are of the flow and carry what rounding cut off them into the value:
   of sums and differences of two, where most of it cancels, and of one and a number. */
static inline size_t ad_jet_cuts(const struct jet *it, size_t n)
{
    if (it->kind == JET_COMBINE && (it->number == 1 || it->number == -1))
        return it->a < n && it->b < n ? 2 : 0;
    return it->kind == JET_SHIFT && it->a < n;
}
/* What rounding may have cut off x: for comparisons of machine code. */
static inline double ad_series_example_cut(double x) { return x * 0x1p-54; }
/* ad_series_flow by the interpreter. */
void ad_series_interpret(ad_series *s, size_t n, size_t order, double *c);
/* ad_points_sum and ad_points_norm; ad_points_radius. */
typedef void ad_steps_code(const struct ad_points_steps *steps, size_t most);
typedef void ad_radius_code(const struct ad_points_steps *steps, size_t first, size_t last);

/* A series being built. */
struct jet_builder {
    struct ad_series *series;
    uint32_t *table; /* of hashes; 0 is free, else 1 + a jet */
    size_t room;     /* a power of two */
    bool failed;     /* out of memory */
};

typedef struct {
    uint32_t id;
} jet;

/* Each returns the jet that is there, if there is one. */
jet ad_jet_number(struct jet_builder *b, double number);
jet ad_jet_add(struct jet_builder *b, jet x, jet y);
jet ad_jet_sub(struct jet_builder *b, jet x, jet y);
jet ad_jet_scale(struct jet_builder *b, double c, jet x);
jet ad_jet_mul(struct jet_builder *b, jet x, jet y);
jet ad_jet_square(struct jet_builder *b, jet x);
jet ad_jet_div(struct jet_builder *b, jet x, jet y);
jet ad_jet_recip(struct jet_builder *b, jet x);
jet ad_jet_slope(struct jet_builder *b, jet x);
jet ad_jet_power(struct jet_builder *b, jet x, double exponent);
jet ad_jet_select(struct jet_builder *b, jet condition, jet x, jet y);
/* Any other kind, of one or two operands; y of one is {JET_NONE}. *is_new: it was not there. */
jet ad_jet_make(struct jet_builder *b, struct jet made, bool *is_new);
bool ad_jet_is_number(const struct jet_builder *b, jet x, double *number);

/* An elementwise operation (elementwise.c), and its value. */
jet ad_jet_elementwise(struct jet_builder *b, enum ad_op op, const jet x[3]);
double ad_jet_value(enum ad_op op, double a, double b, double c);
/* The jets and outputs of s with fewer products, in `made`, freed by the caller; false: there is
   nothing to gain, or no memory (factor.c). */
bool ad_series_factor(struct ad_series *s, struct ad_series *made);
/* What a structural operation makes of its operands' elements; false if there is no rule. at[id]:
   the elements of a node. */
bool ad_jet_structure(struct jet_builder *b, const ad_tape *tape, const struct node *n,
                      jet *const at[], jet *y);

#endif
