/* Memory that is given as one block and laid out as many parts.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef TANDEM_LAYOUT_H
#define TANDEM_LAYOUT_H

#include <stddef.h>
#include <stdint.h>

/* A size with room for a register beyond its end, in whole cache lines. */
static inline size_t padded(size_t size) { return (size + 127) / 64 * 64; }

/* Take a part from where `at` points to. */
static inline uint8_t *taken(uint8_t **at, size_t size)
{
    uint8_t *part = *at;
    *at += padded(size);
    return part;
}

#endif
