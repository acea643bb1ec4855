/* The table of one instruction set's functions. Compiled once per set.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include "kernels.h"

extern const struct tandem_kernels ISA_NAME(kernels);

const struct tandem_kernels ISA_NAME(kernels) = {
#define TANDEM_ENTRY(name) .name = ISA_NAME(name),
    TANDEM_KERNELS(TANDEM_ENTRY)
#undef TANDEM_ENTRY
};
