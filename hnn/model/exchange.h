/* Models in files of other programs: safetensors, as of PyTorch's state dicts. */
#ifndef HNN_MODEL_EXCHANGE_H
#define HNN_MODEL_EXCHANGE_H

#include "hnn/hnn.h"

/* What settings of a model cannot hold of a foreign file. */
struct hnn_exchange {
    bool own;    /* written by hnn_model_export: it has all settings */
    double bias; /* of the last map, left out: it changes no motion */
};

/* Writes a model: tensors named as in hnn_blocks, normalisation and range of training, and the
   settings and notes as texts in __metadata__. Equal models give equal bytes. AD_E_ARGUMENT for a
   network of the caller's own. */
enum ad_status hnn_model_export(const hnn_model *model, const char *file, struct ad_error *error);
/* Reads one, for hnn_model_free. Of files that hnn_model_export did not write, `assumed` says kind,
   field and activation; the rest follows from the tensors, which must be those of one perceptron,
   X.weight [out x in] and X.bias [out], in the order of the numbers in their names. The precision
   is f64 where a tensor is F64. AD_E_INPUT. */
enum ad_status hnn_model_import(const char *file, const struct hnn_settings *assumed,
                                hnn_model **model, struct hnn_exchange *exchange,
                                struct ad_error *error);

#endif
