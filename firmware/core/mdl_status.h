/**
 * @file mdl_status.h
 * @brief What the functions of the core return.
 *
 * Negative: an error, nothing was changed. Zero: fine. Positive: the call did its work, and the
 * bits that are set say under which condition; bits of several blocks are combined with |.
 */
#ifndef MDL_STATUS_H
#define MDL_STATUS_H

typedef enum {
    MDL_OK = 0,
    MDL_EXTRAPOLATED = 1, /**< input outside the identified range, f0 was extrapolated */
    MDL_CLAMPED = 2,      /**< input beyond the extrapolation margin, the margin's edge was used */
    MDL_MEMORY_FULL = 4,  /**< a turning point was not recorded: the arrays are full */
    MDL_ERR_NOT_FINITE = -1, /**< NaN or infinity */
    MDL_ERR_PARAMETER = -2,  /**< a parameter is out of its documented range */
    MDL_ERR_CAPACITY = -3,   /**< an array of the caller, or of the core, is too short */
    MDL_ERR_STATE = -4       /**< a saved state is not one that the model can be in */
} mdl_status;

#endif
