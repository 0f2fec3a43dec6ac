/** @file model.h
 *  @brief The f0 that the machines run, over 0 to 40 V. Of any degree: its first coefficients are
 *         Cao & Li 2019, eq. (20), the others bend it a little further.
 */
#ifndef MODEL_H
#define MODEL_H

#include "mdl_real.h"

#define MODEL_DEGREE_MAX 7

static const mdl_real model_f0[MODEL_DEGREE_MAX + 1] = {
    5.8517e-1f, 8.6444e-2f, 1.1949e-3f, -6.1876e-6f, -4.0e-7f, 8.0e-9f, 1.0e-11f, 1.0e-13f};
static const mdl_real model_range_volts = 40.0f;
static const mdl_real model_margin_volts = 6.0f;

#endif
