/* Models: settings, parameters, the networks on a tape, their evaluation, and their files.

   Columns are samples: states x and rates are [2n x samples], row-major, n rows of q followed by n
   of p (of a Lagrangian model: of v). Units are the data's. Errors: as in hnn/hnn.h, and those
   named. Threads: as there. */
#ifndef HNN_MODEL_H
#define HNN_MODEL_H

#include "physics/physics.h"

AD_HEADER_BEGIN

/* ---- models ---- */

enum hnn_kind {
    HNN_BASELINE,    /* the network predicts dx/dt */
    HNN_HAMILTONIAN, /* the network is H; dq/dt = H_p, dp/dt = -H_q */
    /* L = E (sum of (v/scale)^2/2 + the network), with E and scale of hnn_model_normalise, else 1.
       States are (q, v), at most 32 coordinates, of a lattice 512. */
    HNN_LAGRANGIAN,
    /* A SympNet: a symplectic map of (q, p) over a time step (hnn_record_map), of `layers` gradient
       modules, 2 at least, each as wide as hidden[0]; at most 64 coordinates. It has no field and
       no H: functions that need one refuse it. */
    HNN_SYMPNET
};

/* Which gradients of its scalars form the field of a Hamiltonian model. */
enum hnn_field_type {
    HNN_SYMPLECTIC,   /* (H_p, -H_q) */
    HNN_CONSERVATIVE, /* the plain gradient (F_q, F_p) of one scalar */
    HNN_BOTH          /* their sum, F and H being two outputs of one network */
};

/* Initial weights; biases are uniform within 1/sqrt(inputs), as in the published code. */
enum hnn_start {
    HNN_ORTHOGONAL, /* rows or columns orthonormal, whichever are fewer */
    HNN_XAVIER,     /* normal, variance 2/(inputs + outputs) */
    HNN_HE          /* normal, variance 2/inputs */
};

/* A chain of equal sites, the coordinates in their order (sites a wave runs along). */
enum hnn_lattice {
    HNN_NO_LATTICE,
    HNN_RING,      /* the last site is beside the first */
    HNN_FIXED_ENDS /* beside the first and the last there are walls, where q = 0 */
};

enum { HNN_LAYERS_MOST = 16, HNN_ROLLOUT_MOST = 1 << 16, HNN_INPUTS_MOST = 32 };

/* A network of the caller's own in place of the perceptrons. Files of its models keep `name` and
   the parameters; the function stays with the program. */
struct hnn_network {
    const char *name;    /* 1 to 63 characters */
    size_t size;         /* number of parameters, 1 to 2^30 */
    const double *start; /* [size] initial parameters; NULL where a file has them */
    /* Records, at states x [2n x samples] (in units of hnn_model_normalise, if there are) with
       parameters [1 x size], H [1 x samples]; with HNN_BOTH F and H [2 x samples]; of a baseline
       the rates [2n x samples]. Column k of the value depends on column k of x alone. */
    ad_var (*record)(void *context, ad_var parameters, ad_var x);
    void *context;           /* of the caller; outlives the model */
    const void *reserved[4]; /* NULL: room for what later releases add */
};

struct hnn_settings {
    size_t size; /* sizeof(struct hnn_settings) */
    enum hnn_kind kind;
    size_t dof;                         /* n: a state has 2n components */
    size_t layers;                      /* linear maps, 1 ... HNN_LAYERS_MOST */
    size_t hidden[HNN_LAYERS_MOST - 1]; /* width after each but the last */
    const char *activation;             /* a name from hnn_activations; copied */
    enum hnn_field_type field;
    bool separable;         /* H = T(p) + V(q), with a network each; symplectic fields only */
    bool dissipation;       /* a second network D: the field is (H_p, -H_q) - (D_q, D_p) */
    enum ad_type precision; /* of the initial parameters, and of training */
    enum hnn_start start;
    uint64_t seed;
    /* Size of an observation in place of a state, such as two frames, for models with an
       autoencoder. 0: states are observed. */
    size_t pixels;
    size_t autoencoder; /* width of its hidden layers */
    /* NULL: perceptrons. Else layers, hidden, activation, start and seed are not used; for states
       alone, not separable, without dissipation. Copied, `start` included. */
    const struct hnn_network *network;
    /* Bit k: coordinate k is an angle, of which the networks see sine and cosine (not normalised):
       the field has its period. Rows of their inputs: coordinates (sines in the place of angles),
       cosines, momenta or velocities. Not for pixels, nor with `network`. */
    uint64_t angles;
    /* Of a Lagrangian model: the network sees coordinates alone and has 1 + n (n + 1)/2 outputs,
       -V/E and the upper triangle of M by rows; L = E (|u|^2/2 + u M u/2) - V, u = v/scale. Not
       with `network`. */
    bool quadratic;
    /* m, up to HNN_INPUTS_MOST: rows of x behind the state, of which the field has no derivative:
       time, parameters, controls. x is then [(2n + m) x samples] wherever a model takes it, rates
       are [2n x samples]. The networks see them but for the last `controls`, which are forces u:
       dp/dt (of a Lagrangian model, of L_v) has + G u besides, G [n x controls] learnt, and what
       has an H, the field without them. For states alone, not with `network`. */
    size_t inputs, controls;
    bool time; /* the first input is the time; inputs of a Lagrangian model that are neither this
                  nor controls are constant along a motion */
    bool control_network; /* of controls: G is that of q, by a network that sees coordinates and
                             inputs */
    /* One network for all sites: L or H is a sum over sites of the network of (q, v or p,
       q_next - q), over the first wall too; a baseline's network of (q, p, q_next - q,
       q_previous - q) gives the rates of a site. Plain models of states alone. */
    enum hnn_lattice lattice;
};

/* As published: 200 and 200 units, tanh, orthogonal, symplectic, f32, seed 0. */
void hnn_defaults_to(struct hnn_settings *settings, enum hnn_kind kind, size_t dof);
static inline struct hnn_settings hnn_defaults(enum hnn_kind kind, size_t dof)
{
    struct hnn_settings settings;
    settings.size = sizeof settings;
    hnn_defaults_to(&settings, kind, dof);
    return settings;
}
/* The same on a latent q and p, with an autoencoder of width 200. */
static inline struct hnn_settings hnn_pixel_defaults(enum hnn_kind kind, size_t pixels)
{
    struct hnn_settings s = hnn_defaults(kind, 1);
    s.pixels = pixels;
    s.autoencoder = 200;
    return s;
}

/* Names used on the command line and in files; NULL-terminated, in the order of the enums. */
extern const char *const hnn_kinds[],
    *const hnn_field_types[], *const hnn_starts[], *const hnn_precisions[], *const hnn_lattices[];

/* An activation function, applied elementwise. */
struct hnn_activation {
    const char *name;
    ad_var (*record)(ad_var x);
};
extern const struct hnn_activation hnn_activations[]; /* ends with a NULL name */

typedef struct hnn_model hnn_model;

/* In all functions below a NULL that is not allowed gives AD_E_ARGUMENT (or NaN, 0, NULL where a
   function returns no status). `error` is never NULL; what it holds already, such as the error of
   a failed look-up, is returned unchanged. */

/* A new model with random parameters. AD_E_ARGUMENT names settings that are out of range or
   contradict each other. Settings are copied. */
enum ad_status hnn_model_new(const struct hnn_settings *settings, hnn_model **model,
                             struct ad_error *error);
/* A new model in double precision whose network is the caller's own. AD_E_ARGUMENT as above.
   Settings beyond these: hnn_settings.network. */
enum ad_status hnn_model_new_network(const struct hnn_network *network, enum hnn_kind kind,
                                     size_t dof, hnn_model **model, struct ad_error *error);
void hnn_model_free(hnn_model *model); /* takes NULL */
const struct hnn_settings *
hnn_model_settings(const hnn_model *model); /* lives as long as the model */

/* All parameters as one flat vector of the model's precision, which lives as long as the model and
   changes in place; set copies its argument. */
size_t hnn_model_size(const hnn_model *model);
const void *hnn_model_parameters(const hnn_model *model);
void hnn_model_set_parameters(hnn_model *model, const void *parameters);

/* One matrix or vector of the parameters: "linear1.weight" [out x in], "linear1.bias" [out x 1];
   with the prefix "kinetic.", "potential." or "dissipation." where there are several networks. The
   last map has no bias. Module k of a sympnet: p (even k: q) += dt K^T (a . s(K q + b)), with K
   "module.linear1.weight" [width x n], b "module.linear1.bias", a "size.linear1.weight" [1 x
   width]. G of controls is "control.linear1.weight". Those of an hnn_network are
   "network.parameters" [size]. With an autoencoder all these have the prefix "hnn."; its own maps
   are "autoencoder.linear1" to "autoencoder.linear4", which encode, and 5 to 8, which decode. */
struct hnn_block {
    char name[40];
    bool bias;
    size_t rows, cols, offset; /* offset: in elements of the flat vector */
};
/* The blocks [*n] of a model, in the order of the flat vector; they live as long as the model. */
const struct hnn_block *hnn_model_blocks(const hnn_model *model, size_t *n);

/* Normalises the networks: their input becomes (x - centre)/scale, [2n + m] each, controls u/scale;
   their output is scaled to the size of `rate` [2n]; all are positive except centre. Of a lattice
   centre and scale have one number more, of the differences q_next - q, and sites have one centre,
   scale and rate of q, one of p or v: those of all sites together. It is part of the model from
   then on; the field is still that of a Hamiltonian in x. Losses are then of rates in units of
   `rate`. */
enum ad_status hnn_model_normalise(hnn_model *model, const double *centre, const double *scale,
                                   const double *rate, struct ad_error *error);

/* The range of training: least and largest value of every component of the state, of every input,
   and of H (NaN where the model has none). */
struct hnn_range {
    const double *low, *high; /* [2n + m + 1], H last */
};
/* Sets the range from states x [(2n + m) x n], that of H from some thousands of them. Training does
   this itself; for pixels from the latent states of some thousands of its observations. Part of the
   model from then on. AD_E_MEMORY. */
enum ad_status hnn_model_see(hnn_model *model, size_t n, const double *x, struct ad_error *error);
/* The range; low is NULL if there is none. Valid until hnn_model_see or the model is freed. */
struct hnn_range hnn_model_range(const hnn_model *model);

/* A note stored with the model, as an attribute of that name: names of columns, units, the origin
   of the data. Both strings are copied; a NULL text removes the note. AD_E_MEMORY beyond 16 notes.
 */
enum ad_status hnn_model_note(hnn_model *model, const char *name, const char *text,
                              struct ad_error *error);
/* NULL: no such note. Valid until that note changes. */
const char *hnn_model_noted(const hnn_model *model, const char *name);

/* The name of component k of the state: its column's, if the note "state" has plain names separated
   by commas; else q1, q2, ..., p1, ... */
void hnn_model_component(const hnn_model *model, size_t k, char *name, size_t size);

/* ---- a model on a tape ---- */

struct hnn_record {
    ad_var field;       /* [2n x samples] */
    ad_var energy;      /* H [1 x samples]; tape NULL where the model has none */
    ad_var dissipation; /* D [1 x samples]; likewise */
};
/* Records the model at states x [(2n + m) x samples] with parameters [1 x hnn_model_size], on a
   tape of any precision. Errors stay in the tape. */
struct hnn_record hnn_model_record(const hnn_model *model, ad_var parameters, ad_var x);

/* Records the states x [2n x samples] after a step dt [1 x samples] of a sympnet; `back`: before
   it, by the inverse map. */
ad_var hnn_record_map(const hnn_model *model, ad_var parameters, ad_var x, ad_var dt, bool back);

/* ---- evaluating a model ---- */

/* Precision of the evaluations below; AD_F64 unless set, whatever the precision of the parameters.
   An unknown type changes nothing. */
void hnn_model_evaluate_in(hnn_model *model, enum ad_type type);
/* rate [2n] at one state x [2n + m]. AD_E_MEMORY, AD_E_ARGUMENT; AD_E_NONFINITE if x is not finite.
 */
enum ad_status hnn_model_field(hnn_model *model, const double *x, double *rate);
/* H at one state x [2n + m]; NaN if the model has none. */
double hnn_model_energy(hnn_model *model, const double *x);
/* rate [2n x samples] and H [1 x samples] at x [(2n + m) x samples]; either may be NULL.
   AD_E_NONFINITE names the first coordinate and sample that is not finite. */
enum ad_status hnn_model_evaluate(hnn_model *model, size_t samples, const double *x, double *rate,
                                  double *energy, struct ad_error *error);
/* L_vv of a Lagrangian model, its rows and columns scaled to a largest element of 1. */
struct hnn_mass {
    double condition; /* the largest condition number of any state ... */
    size_t worst;     /* ... and which */
    /* Of negative eigenvalues, the least and the largest number: where they differ, L_vv is
       singular somewhere between two of the states. */
    size_t negative_least, negative_most; /* of a lattice: of any one site */
};
/* Over states x [(2n + m) x n]. AD_E_ARGUMENT for other models. */
enum ad_status hnn_model_mass(const hnn_model *model, size_t n, const double *x,
                              struct hnn_mass *mass, struct ad_error *error);
/* What gives the inputs of a model along a motion. */
struct hnn_drive {
    /* u [m] at time t, the time among them. AD_E_INPUT where they are not known. */
    enum ad_status (*at)(void *context, double t, double *u, struct ad_error *error);
    void *context; /* of the caller; outlives its use by the model */
    bool constant; /* no input but the time depends on t */
    /* Of hnn_system_drive: records input k at times t [1 x n], [1 x n]; tape NULL: it is a
       parameter of the scene. */
    ad_var (*record)(void *context, size_t k, ad_var t);
};
/* From now on the model's motions have these inputs; NULL: none, or the time alone. Copied. */
void hnn_model_drive(hnn_model *model, const struct hnn_drive *drive);
/* H is the same along motions: one without time, controls and changing inputs. */
bool hnn_model_conserves(const hnn_model *model);
/* The inputs u [m] at time t. AD_E_ARGUMENT for those that nothing gives. */
enum ad_status hnn_model_inputs(const hnn_model *model, double t, double *u,
                                struct ad_error *error);
/* The name of input k, as hnn_model_component by the note "inputs"; else u1, u2, ... */
void hnn_model_input(const hnn_model *model, size_t k, char *name, size_t size);

/* The model as a vector field for phys_simulate, y = (q, p) or (q, v): canonical if the field is
   symplectic, with kick and drift if H separates. The model must outlive it. AD_E_ARGUMENT for a
   model with inputs that nothing gives (hnn_model_drive). */
enum ad_status hnn_model_ode(hnn_model *model, struct phys_ode *ode, struct ad_error *error);

/* ---- a model as a scene ---- */

/* phys_system_open, which also takes a model by its file, NAME.h5: L of a Lagrangian model, or
   the L that goes with H of a symplectic one, p = L_v being its momenta, in which it moves. It
   starts in the middle of its range of training (parameters NAME0 and v_NAME0); units are the
   data's. The L is NaN where H_p(q, p) = v has no solution near the range. AD_E_INPUT for models
   without L or H: baselines, other fields, learnt dissipation, relu, pixels; for over 32
   coordinates, but of a lattice. */
enum ad_status hnn_system_open(const char *name, struct phys_system *system,
                               struct ad_error *error);
/* From now on the inputs that drive->record gives take the place of parameters of the scene, in
   what is recorded of its L; NULL: none do. Copied; its context outlives the system. AD_E_ARGUMENT
   for scenes that are no models with inputs. */
enum ad_status hnn_system_drive(struct phys_system *system, const struct hnn_drive *drive,
                                struct ad_error *error);
/* The model of such a system, which owns it; NULL: another scene. */
hnn_model *hnn_system_model(const struct phys_system *system);

/* ---- the autoencoder of a model of pixels (x above is its latent state) ---- */

/* On a tape: states [2n x samples] from observations [samples x pixels], contiguous as frames are
   in memory, and back. */
ad_var hnn_record_encode(const hnn_model *model, ad_var parameters, ad_var pixels);
ad_var hnn_record_decode(const hnn_model *model, ad_var parameters, ad_var x);
/* The same on arrays. AD_E_ARGUMENT if the model has no autoencoder, AD_E_NONFINITE as above. */
enum ad_status hnn_model_encode(const hnn_model *model, size_t samples, const double *pixels,
                                double *x, struct ad_error *error);
enum ad_status hnn_model_decode(const hnn_model *model, size_t samples, const double *x,
                                double *pixels, struct ad_error *error);

/* ---- files (HDF5, readable with h5py; replaced atomically) ---- */

/* Saves the model; `command` is stored as an attribute; NULL: none. */
enum ad_status hnn_model_save(const hnn_model *model, const char *file, const char *command,
                              struct ad_error *error);
/* Loads a model, for hnn_model_free. AD_E_INPUT if the file is damaged or not a model. */
enum ad_status hnn_model_load(const char *file, hnn_model **model, struct ad_error *error);
/* Loads a model with a network of the caller's own. AD_E_INPUT if the file's has another name or
   size, or had another field at the states stored with it. */
enum ad_status hnn_model_load_network(const char *file, const struct hnn_network *network,
                                      hnn_model **model, struct ad_error *error);

AD_HEADER_END
#endif
