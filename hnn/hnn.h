/* Hamiltonian neural networks: a network gives a scalar H(q, p), and the field is its symplectic
   gradient, recorded on the tape (S. Greydanus, M. Dzamba, J. Yosinski, "Hamiltonian Neural
   Networks", NeurIPS 2019, arXiv 1906.01563). A baseline predicts the rates directly. Lagrangian
   networks: a network gives L(q, v), the field is v and L_vv^-1 (L_q - L_vq v) (M. Cranmer et al.,
   "Lagrangian Neural Networks", arXiv 2003.04630).

       hnn_model *model;
       if (hnn_model_load("pendulum.h5", &model, &error) == AD_OK)
           hnn_model_field(model, (double[]){1, 0}, rate);           dq/dt, dp/dt at q = 1, p = 0
       hnn_model_free(model);

   Columns are samples: states x and rates are [2n x samples], row-major, n rows of q followed by n
   of p (of a Lagrangian model: of v). Units are the data's. Errors: AD_E_ARGUMENT for NULL and
   settings out of range, AD_E_MEMORY, AD_E_IO and AD_E_INPUT of files, and those named. Threads:
   handles share nothing, and one handle is used by one thread at a time; models and data may be
   read and written at once, HDF5 calls wait for each other (those of the caller's own do not). */
#ifndef HNN_HNN_H
#define HNN_HNN_H

#include "hnn/model.h"
#include "hnn/trainer.h"

#endif
