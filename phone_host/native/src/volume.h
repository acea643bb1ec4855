/* A signed distance field in blocks of 8 x 8 x 8 voxels that a hash table finds; see volume.c.
 *
 * Value number x + 8 y + 64 z of a block belongs to the voxel at ((8 place + (x, y, z)) voxel_m) in the world.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef TANDEM_VOLUME_H
#define TANDEM_VOLUME_H

#include <stdint.h>

#include "tandem.h"

enum { BLOCK_SIDE = 8, BLOCK_VOXELS = 512, FIELD_ONE = 32000 };

/* floorf as a number, without a call into the maths library where the processor has no instruction for it. */
static inline int32_t floor_of(float value)
{
    const int32_t cut = (int32_t)value;
    return cut - (value < (float)cut);
}

/* The number of the block at a place, in blocks; -1: there is none. */
static inline int32_t volume_find(const struct tandem_volume *volume, int32_t x, int32_t y, int32_t z)
{
    const uint32_t mask = (uint32_t)volume->slot_count - 1;
    uint32_t slot = ((uint32_t)x * 73856093u ^ (uint32_t)y * 19349663u ^ (uint32_t)z * 83492791u) & mask;
    for (;;) {
        const int32_t number = volume->slots[slot] - 1;
        if (number < 0) {
            return -1;
        }
        const int32_t *place = volume->places + 3 * (int64_t)number;
        if (place[0] == x && place[1] == y && place[2] == z) {
            return number;
        }
        slot = (slot + 1) & mask;
    }
}

/* Whether the numbers of a volume fit each other, so that no index leaves its arrays. */
int volume_is_sound(const struct tandem_volume *volume);

/* Whether an image's sides are 1 to 32767 px. */
static inline int is_image(int32_t width, int32_t height)
{
    return width >= 1 && height >= 1 && width <= INT16_MAX && height <= INT16_MAX;
}

#endif
