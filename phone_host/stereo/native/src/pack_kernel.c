/* The finite points of a cloud image with their colours, as the vertices of a PLY file: 15 bytes each, little endian.
 *
 * Every point is written behind the last one kept, and only a finite one moves the end: no branch that the processor could
 * predict wrongly at each border of a gap. So `records` needs room for all pixels, though only `count` records are meant.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <float.h>
#include <math.h>
#include <stddef.h>
#include <string.h>

#include "kernels.h"

#define RECORD_BYTES 15

static inline int is_finite(float value)
{
    return fabsf(value) <= FLT_MAX;
}

static uint8_t *one_row(const struct tandem_pack_job *job, int32_t y, int channels, uint8_t *end)
{
    const float *cloud = job->cloud_m + (ptrdiff_t)y * job->cloud_stride;
    const uint8_t *colour = job->colours + (ptrdiff_t)y * job->colour_stride;
    const float sign_x = job->signs[0], sign_y = job->signs[1], sign_z = job->signs[2];
    for (int32_t x = 0; x < job->width; x++, cloud += 3, colour += channels) {
        const float point[3] = {cloud[0] * sign_x, cloud[1] * sign_y, cloud[2] * sign_z};
        memcpy(end, point, sizeof point);
        end[12] = colour[channels == 3 ? 2 : 0];
        end[13] = colour[channels == 3 ? 1 : 0];
        end[14] = colour[0];
        end += RECORD_BYTES * (is_finite(cloud[0]) & is_finite(cloud[1]) & is_finite(cloud[2]));
    }
    return end;
}

void ISA_NAME(pack)(struct tandem_pack_job *job)
{
    uint8_t *end = job->records;
    for (int32_t y = 0; y < job->height; y++) {
        end = job->channels == 3 ? one_row(job, y, 3, end) : one_row(job, y, 1, end);
    }
    job->count = (end - job->records) / RECORD_BYTES;
}
