/* Single steps of a training, for measurements of speed (apps/bench). */
#ifndef HNN_TRAIN_TRAIN_SPEED_H
#define HNN_TRAIN_TRAIN_SPEED_H

#include "hnn/hnn.h"

/* One step, after which neither model nor history has the result; hnn_trainer_train_loss is then
   the loss after it. AD_E_NONFINITE as of hnn_trainer_run. */
enum ad_status hnn_trainer_take_step(hnn_trainer *trainer, struct ad_error *error);
/* The share of time in matrix products, inside OpenBLAS: of loss and gradient at the present point,
   on one thread. */
double hnn_trainer_product_share(hnn_trainer *trainer);

#endif
