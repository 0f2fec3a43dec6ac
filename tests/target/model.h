/** @file model.h
 *  @brief The model that the machines run: Cao & Li 2019, eq. (20), over 0 to 40 V.
 */
#ifndef MODEL_H
#define MODEL_H

#include "mdl_real.h"

#define MODEL_DEGREE 3

static const mdl_real model_f0[MODEL_DEGREE + 1] = {5.8517e-1f, 8.6444e-2f, 1.1949e-3f,
                                                    -6.1876e-6f};
static const mdl_real model_range_volts = 40.0f;
static const mdl_real model_margin_volts = 6.0f;

#endif
