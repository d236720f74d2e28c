/* For exchange.c only: tensors of other programs, as of PyTorch's state dicts, that are the maps of
   a perceptron, and the settings of a model that has them. */
#ifndef HNN_MODEL_MAPS_H
#define HNN_MODEL_MAPS_H

#include "hnn/hnn.h"
#include "safetensors.h"

/* Tensors of the maps of a perceptron; their biases may be NULL. */
struct hnn_maps {
    size_t n;
    const struct hnn_tensor *weight[HNN_LAYERS_MOST], *bias[HNN_LAYERS_MOST];
};

/* X.weight [out x in] and X.bias [out], in the order of the numbers in their names; where these
   differ in words, too, in the one that shapes allow. AD_E_INPUT where there is none or several,
   where they do not fit, or others are there. */
enum ad_status hnn_maps_find(const struct hnn_tensors *tensors, struct hnn_maps *maps,
                             struct ad_error *error);
/* Outputs of a network of these settings, and which of the file's they are: published networks of H
   have two, F and H, whatever their field. */
size_t hnn_maps_outputs(const struct hnn_settings *settings, size_t given, size_t *first);
/* The settings of a model with these maps, whose kind, field and activation are those assumed. */
enum ad_status hnn_maps_settings(const struct hnn_tensors *tensors, const struct hnn_maps *maps,
                                 const struct hnn_settings *assumed, struct hnn_settings *settings,
                                 struct ad_error *error);

#endif
