/* Internals of a model, for the folders of hnn: settings, layout of the parameters, networks on a
   tape, evaluation, range of training, model files. Other programs use hnn/hnn.h. Folders of
   hnn, each including only those before it (train/ only model/):

       model/      networks and their files            hnn.h
       data/       data sets from files                data.h; inside: data_table.h
       tasks/      published systems                   data.h; inside: task.h
       rollout/    motion by a model, its errors       rollout.h
       pixels/     frames, rendering, prediction       pixels.h, latent.h, pixel_energy.h
       train/      losses, optimisers, checkpoints     hnn.h; inside: train.h */
#ifndef HNN_MODEL_INTERNAL_H
#define HNN_MODEL_INTERNAL_H

#include "hnn/hnn.h"
#include "physics/io/random.h"
#include "physics/io/hdf5_file.h"
#include "physics/system/internal.h"

#define LENGTH(a) (sizeof(a) / sizeof(a)[0])

enum { HNN_NETS_MOST = 4, HNN_NOTES_MOST = 16, HNN_NETWORK_NAME = 64, HNN_PROBES = 3 };
enum { HNN_SYMPNET_MOST = 64 };                          /* coordinates */
enum { HNN_CONTROLLED_MOST = 64 };                       /* coordinates that G(q) pushes */
enum { HNN_LATTICE_MOST = 512 };                         /* sites */
enum { HNN_LAGRANGIAN_MOST = 32, HNN_ANGLES_MOST = 52 }; /* coordinates of such models */
enum { HNN_CODER_LAYERS = 4, HNN_ENCODE_MOST = 2 };
enum { HNN_BLOCKS_MOST = HNN_NETS_MOST * 2 * HNN_LAYERS_MOST + 2 * 2 * HNN_CODER_LAYERS + 1 };

/* One multilayer perceptron of a model: it reads rows first ... first+inputs-1 of what is seen. */
struct hnn_net {
    const char *prefix; /* of its blocks' names */
    size_t first, inputs, outputs;
    size_t block; /* its first block; two a layer, the last layer one */
};

/* What the networks see and say in other units than the data's. */
struct hnn_scaling {
    /* [hnn_scaled] each, in one allocation at `centre`, rates but those of states 1; NULL: none */
    double *centre, *scale, *rate;
    double energy; /* size of H, so that its gradient has the size of the rates */
};

struct hnn_evaluator; /* evaluate.c */

struct hnn_model {
    struct hnn_settings settings;
    const struct hnn_activation *activation;
    struct hnn_network network; /* settings.network, or unused */
    char network_name[HNN_NETWORK_NAME];
    size_t n_nets, n_blocks, size;
    struct hnn_net net[HNN_NETS_MOST];
    size_t control;          /* first block of G, the matrix of controls */
    size_t encoder, decoder; /* first blocks of an autoencoder; two a layer, all layers */
    size_t seen;             /* inputs of the encoder: pixels, or those not always dark */
    size_t shift;            /* of these, those of one frame: known in training */
    struct hnn_block block[HNN_BLOCKS_MOST];
    struct hnn_scaling scaling;
    uint64_t normalised;    /* counts changes of scaling, which recordings hold as constants */
    double *range;          /* low [2n + m + 1], then high, H last; NULL: not known */
    struct hnn_drive drive; /* at NULL: none */
    void *parameters;       /* [size] of settings.precision */
    uint64_t version;       /* counts changes of the parameters */
    enum ad_type evaluate_in;
    struct hnn_evaluator *one, *many; /* one state; the last number of them; NULL until needed */
    struct note {
        char *name, *text;
    } note[HNN_NOTES_MOST];
    size_t n_notes;
};

static inline size_t hnn_states(const hnn_model *model) { return 2 * model->settings.dof; }
/* Rows of x: the state, then the inputs. */
static inline size_t hnn_rows(const hnn_model *model)
{
    return hnn_states(model) + model->settings.inputs;
}
/* Numbers that are normalised: those rows, and the differences of a lattice. */
static inline size_t hnn_scaled(const hnn_model *model)
{
    return hnn_rows(model) + (model->settings.lattice != HNN_NO_LATTICE);
}
/* The letter of component k: q, and p or v. */
static inline char hnn_letter(const hnn_model *model, size_t k)
{
    return k < model->settings.dof ? 'q' : model->settings.kind == HNN_LAGRANGIAN ? 'v' : 'p';
}
/* d scalar / dx, recorded; x where the tape has an error. */
static inline ad_var hnn_gradient(ad_var scalar, ad_var x)
{
    ad_var g = x;
    ad_grad(scalar, 1, &x, &g);
    return g;
}
static inline size_t hnn_type_bytes(enum ad_type type)
{
    return type == AD_F32 ? sizeof(float) : sizeof(double);
}

/* Index of `name` in a NULL-terminated table; AD_E_ARGUMENT, naming the nearest, if it is not
   there. `what` is what they are names of. */
enum ad_status hnn_find(const char *what, const char *name, const char *const names[],
                        size_t *index, struct ad_error *error);

enum ad_status hnn_activation_find(const char *name, const struct hnn_activation **activation,
                                   struct ad_error *error);
/* AD_E_ARGUMENT says what is out of range or at odds. */
enum ad_status hnn_settings_check(const struct hnn_settings *settings, struct ad_error *error);
/* Networks, names, shapes and offsets of all parameters from the settings (layout.c). */
void hnn_layout(hnn_model *model);
/* A model without parameters, then room for them, all 0: for those of a file, which may ask for a
   size that takes hours to draw, or that nothing holds. */
enum ad_status hnn_model_blank(const struct hnn_settings *settings, hnn_model **model,
                               struct ad_error *error);
enum ad_status hnn_model_make_room(hnn_model *model, struct ad_error *error);
/* The matrix or column of block k, a view of the flat parameters (field.c). */
ad_var hnn_record_block(const hnn_model *model, ad_var parameters, size_t k);
/* Outputs [outputs x samples] of a network at what it sees (field.c). */
ad_var hnn_record_network(const hnn_model *model, const struct hnn_net *net, ad_var parameters,
                          ad_var seen);
/* G u [n x samples] of a model with controls (field.c). */
ad_var hnn_record_force(const hnn_model *model, ad_var parameters, ad_var x);
/* Of a lattice (lattice.c): the sum of its network over sites [1 x samples]; a baseline's rates in
   their units [2n x samples]; and all of a Lagrangian one, returning L_vv of the sites, which are
   uncoupled, [n x samples]. */
ad_var hnn_lattice_sum(const hnn_model *model, ad_var parameters, ad_var x);
ad_var hnn_lattice_rates(const hnn_model *model, ad_var parameters, ad_var x);
ad_var hnn_lattice_lagrangian(const hnn_model *model, ad_var parameters, ad_var x,
                              struct hnn_record *r);
/* L [1 x samples] of a Lagrangian model (field.c). */
ad_var hnn_record_L(const hnn_model *model, ad_var parameters, ad_var x);
/* Of a Lagrangian model: *r, and its L_vv [n*n x samples], row i*n + j element (i, j), or that of
   hnn_lattice_lagrangian (field.c). */
ad_var hnn_record_lagrangian(const hnn_model *model, ad_var parameters, ad_var x,
                             struct hnn_record *r);
/* States [2n x samples] of n batches of observations, those of the first batch first; the columns
   are theirs one after another (autoencoder.c). */
ad_var hnn_record_encode_all(const hnn_model *model, ad_var parameters, size_t n,
                             const ad_var pixels[]);
/* Draws all parameters, `values` [size] (initial_weights.c). AD_E_MEMORY. */
enum ad_status hnn_start_draw(const hnn_model *model, double *values, struct ad_error *error);
/* Elements as doubles and back, whatever their type. */
void hnn_to_double(enum ad_type type, size_t n, const void *from, double *to);
void hnn_from_double(enum ad_type type, size_t n, const double *from, void *to);

/* What hnn_model_see does, in two parts: from all states x [2n + m x n], behind which are the m
   inputs after each of `steps`, and from H at some of them, of any type, with the present
   parameters (range.c). */
enum { HNN_RANGE_ENERGIES = 4096 }; /* most states at which H is evaluated */
enum ad_status hnn_range_states(hnn_model *model, size_t n, size_t steps, const double *x,
                                struct ad_error *error);
enum ad_status hnn_range_energy(hnn_model *model, size_t n, const double *x,
                                struct ad_error *error);

/* ---- a network of the caller's own (network.c) ---- */

enum ad_status hnn_network_check(const struct hnn_settings *settings, struct ad_error *error);
/* Its value [outputs x samples]; AD_E_SHAPE in the tape where it has another shape. */
ad_var hnn_network_record(const hnn_model *model, size_t outputs, ad_var parameters, ad_var x);
/* AD_E_ARGUMENT where the field of several states is not that of each alone. */
enum ad_status hnn_network_check_columns(const hnn_model *model, struct ad_error *error);
/* The field [2n x n] at fixed states `first` ..., with these parameters, in f64. */
enum ad_status hnn_probe(const hnn_model *model, const double *parameters, size_t first, size_t n,
                         double *field, struct ad_error *error);
/* In a file: its name and its field; whether the name, and then the field, are the caller's:
   AD_E_INPUT. `name` is the file's; network NULL: perceptrons. */
enum ad_status hnn_network_write(const hnn_model *model, phys_hdf5 *file, struct ad_error *error);
void hnn_network_expect(const struct hnn_network *network, const char *name, phys_hdf5 *file,
                        struct ad_error *error);
void hnn_network_verify(const hnn_model *model, const char *name, phys_hdf5 *file,
                        struct ad_error *error);
/* Whether values [n] agree but for rounding; NaN agrees with NaN. */
bool hnn_agree(size_t n, const double *a, const double *b, double tolerance);

void hnn_evaluator_free(struct hnn_evaluator *evaluator);

/* The model's part of a checkpoint (checkpoint.c). */
enum ad_status hnn_model_write(const hnn_model *model, phys_hdf5 *file, const char *command,
                               struct ad_error *error);
#endif
