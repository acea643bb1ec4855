/* Room for what a depth image shows: blocks along each pixel's ray, a truncation before and behind its depth.
 *
 * One thread, row by row, so that blocks always get the same numbers. A free slot is found by going on from the hashed one.
 * M. Niessner et al., "Real-time 3D Reconstruction at Scale using Voxel Hashing", 2013.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include "volume.h"

#include <stddef.h>

enum { SAMPLES = 5 }; /* along the ray: half a truncation apart, a quarter of a block at the truncation of 4 voxels */

int volume_is_sound(const struct tandem_volume *volume)
{
    const int64_t slots = volume->slot_count;
    return volume->room >= 1 && volume->count >= 0 && volume->count <= volume->room && slots >= 2 * (int64_t)volume->room &&
           slots <= INT32_MAX && (slots & (slots - 1)) == 0 && volume->voxel_m > 0 && volume->truncation_m > 0;
}

static int add(struct tandem_volume *volume, int32_t x, int32_t y, int32_t z)
{
    if (volume->count >= volume->room) {
        return 0;
    }
    const uint32_t mask = (uint32_t)volume->slot_count - 1;
    uint32_t slot = ((uint32_t)x * 73856093u ^ (uint32_t)y * 19349663u ^ (uint32_t)z * 83492791u) & mask;
    while (volume->slots[slot] != 0) {
        slot = (slot + 1) & mask;
    }
    int32_t *place = volume->places + 3 * (int64_t)volume->count;
    place[0] = x;
    place[1] = y;
    place[2] = z;
    volume->slots[slot] = ++volume->count;
    return 1;
}

int32_t tandem_touch(struct tandem_touch_job *job)
{
    struct tandem_volume *volume = job->volume;
    if (!volume_is_sound(volume) || !is_image(job->width, job->height) || job->step < 1) {
        return TANDEM_BAD_SIZE;
    }
    const float *pose = job->world_camera, scale = 1 / (BLOCK_SIDE * volume->voxel_m);
    int32_t last[3] = {INT32_MAX, INT32_MAX, INT32_MAX};
    job->missing = 0;
    for (int32_t v = 0; v < job->height; v += job->step) {
        const float *row = job->depth_m + (ptrdiff_t)v * job->width;
        const float dy = ((float)v - job->cy_px) / job->focal_px;
        for (int32_t u = 0; u < job->width; u += job->step) {
            if (!(row[u] > 0 && row[u] <= job->far_m)) {
                continue;
            }
            const float dx = ((float)u - job->cx_px) / job->focal_px;
            for (int sample = 0; sample < SAMPLES; sample++) {
                const float z = row[u] + ((float)sample * 0.5f - 1) * volume->truncation_m;
                const float x = dx * z, y = dy * z;
                int32_t place[3];
                for (int axis = 0; axis < 3; axis++) {
                    const float *turn = pose + 4 * axis;
                    place[axis] = floor_of((turn[0] * x + turn[1] * y + turn[2] * z + turn[3]) * scale);
                }
                if (place[0] == last[0] && place[1] == last[1] && place[2] == last[2]) {
                    continue;
                }
                last[0] = place[0];
                last[1] = place[1];
                last[2] = place[2];
                if (volume_find(volume, place[0], place[1], place[2]) < 0 && !add(volume, place[0], place[1], place[2])) {
                    job->missing++;
                }
            }
        }
    }
    return TANDEM_DONE;
}
