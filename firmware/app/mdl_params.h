/**
 * @file mdl_params.h
 * @brief The parameters of the firmware. Written by `madelung export`; do not edit.
 */
#ifndef MDL_PARAMS_H
#define MDL_PARAMS_H

#include "mdl_app.h"

extern const mdl_app_params mdl_params;

#endif
