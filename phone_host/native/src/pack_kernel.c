/* The finite points of a cloud image with their colours, as the vertices of a PLY file: 15 bytes each, little endian.
 *
 * Every point is written behind the last one kept, and only a finite one moves the end: no branch that the processor could
 * predict wrongly at each border of a gap. A point goes out as two words of 8 bytes, one byte more than it has. So `records`
 * needs room for all pixels and one more, though only `count` records are meant.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <stddef.h>
#include <string.h>

#include "kernels.h"

#define RECORD_BYTES 15
#define NO_NUMBER 0xff000000U /* bits of infinity without the sign, shifted left by 1; NaN has more */

static inline uint32_t rgb_of(const uint8_t *colour, int channels)
{
    if (channels == 1) {
        return colour[0] * 0x010101U;
    }
    return (uint32_t)colour[2] | (uint32_t)colour[1] << 8 | (uint32_t)colour[0] << 16;
}

/* Four bytes at once, the fourth being the next pixel's. */
static inline uint32_t rgb_before_another(const uint8_t *colour, int channels)
{
    uint32_t word;
    if (channels == 1) {
        return rgb_of(colour, channels);
    }
    memcpy(&word, colour, sizeof word);
    return __builtin_bswap32(word) >> 8;
}

/* One at a time: an array would be copied to the stack first. */
static inline uint32_t bits_of(const float *value)
{
    uint32_t bits;
    memcpy(&bits, value, sizeof bits);
    return bits;
}

static inline uint8_t *one_point(uint8_t *end, const float *point, const uint32_t *flips, uint32_t rgb)
{
    const uint32_t x = bits_of(point), y = bits_of(point + 1), z = bits_of(point + 2);
    const uint64_t front = (uint64_t)(x ^ flips[0]) | (uint64_t)(y ^ flips[1]) << 32;
    const uint64_t back = (uint64_t)(z ^ flips[2]) | (uint64_t)rgb << 32;
    memcpy(end, &front, sizeof front);
    memcpy(end + sizeof front, &back, sizeof back);
    const int finite = (x << 1 < NO_NUMBER) & (y << 1 < NO_NUMBER) & (z << 1 < NO_NUMBER);
    return end + (-finite & RECORD_BYTES);
}

static inline uint8_t *one_row(const struct tandem_pack_job *job, int32_t y, int channels, uint8_t *end)
{
    const float *cloud = job->cloud_m + (ptrdiff_t)y * job->cloud_stride;
    const uint8_t *colour = job->colours + (ptrdiff_t)y * job->colour_stride;
    uint32_t flips[3];
    for (int axis = 0; axis < 3; axis++) {
        flips[axis] = job->flips[axis] ? 0x80000000U : 0;
    }
    const int32_t width = job->width; /* bytes may be written to it, as far as the compiler knows */
    for (int32_t x = 0; x + 1 < width; x++, cloud += 3, colour += channels) {
        end = one_point(end, cloud, flips, rgb_before_another(colour, channels));
    }
    return width > 0 ? one_point(end, cloud, flips, rgb_of(colour, channels)) : end;
}

void ISA_NAME(pack)(struct tandem_pack_job *job)
{
    uint8_t *end = job->records;
    for (int32_t y = 0; y < job->height; y++) {
        end = job->channels == 3 ? one_row(job, y, 3, end) : one_row(job, y, 1, end);
    }
    job->count = (end - job->records) / RECORD_BYTES;
}
