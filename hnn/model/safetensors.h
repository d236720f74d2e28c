/* Files of the safetensors format (https://github.com/huggingface/safetensors): the length of a
   header, 8 bytes, least first; the header, a JSON object of names with dtype, shape and
   data_offsets, and `__metadata__`, texts; then the elements. What the format forbids is refused:
   lengths that do not agree, gaps, overlaps, names that come twice, a header of over 100 MB. */
#ifndef HNN_MODEL_SAFETENSORS_H
#define HNN_MODEL_SAFETENSORS_H

#include "autodiff/autodiff.h"

enum { HNN_TENSOR_RANK = 4 };

struct hnn_tensor {
    char *name;
    const char *dtype; /* "F64", "F32", "F16" or "BF16"; others are kept as NULL */
    size_t rank, dims[HNN_TENSOR_RANK], n; /* n: elements */
    uint64_t begin, end;                   /* bytes of the data */
};

struct hnn_metadata {
    char *key, *text;
};

struct hnn_tensors {
    const char *file;
    size_t n, n_metadata;
    struct hnn_tensor *tensor;     /* in the order of the file */
    struct hnn_metadata *metadata; /* likewise */
    unsigned char *bytes;          /* of the data */
};

/* Reads a whole file; ends with hnn_tensors_free, whatever it returned. AD_E_IO, AD_E_INPUT, which
   says where in the header. `file` must outlive the tensors. */
enum ad_status hnn_tensors_read(const char *file, struct hnn_tensors *tensors,
                                struct ad_error *error);
void hnn_tensors_free(struct hnn_tensors *tensors);
/* Adds what the header says to an empty one; for safetensors.c only. */
enum ad_status hnn_tensors_header(struct hnn_tensors *tensors, const char *header, size_t length,
                                  struct ad_error *error);
/* NULL: none of that name. */
const struct hnn_tensor *hnn_tensor_find(const struct hnn_tensors *tensors, const char *name);
const char *hnn_metadata_find(const struct hnn_tensors *tensors, const char *key);
/* Elements first ... first + n - 1 as doubles, which hold all of these types. AD_E_INPUT for
   another dtype. */
enum ad_status hnn_tensor_values(const struct hnn_tensors *tensors, const struct hnn_tensor *tensor,
                                 size_t first, size_t n, double *values, struct ad_error *error);

/* What is to be written: elements of type F32 or F64, of the caller. */
struct hnn_tensor_source {
    const char *name;
    enum ad_type type;
    size_t rank, dims[HNN_TENSOR_RANK];
    const void *values;
};
/* Replaces `file` atomically. Equal arguments give equal bytes. AD_E_IO, AD_E_MEMORY. */
enum ad_status hnn_tensors_write(const char *file, size_t n,
                                 const struct hnn_tensor_source tensor[], size_t n_metadata,
                                 const struct hnn_metadata metadata[], struct ad_error *error);

#endif
