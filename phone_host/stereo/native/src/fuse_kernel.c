/* A depth image into the blocks that the camera sees: running means of distance and colour, weighted by the depth's noise.
 *
 * Distances are along the camera's axis, in truncations, FIELD_ONE = 1. What lies before the surface is empty, what lies more than one
 * truncation behind it stays as it is. B. Curless and M. Levoy, "A Volumetric Method for Building Complex Models from Range Images", 1996.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <math.h>
#include <stddef.h>

#include "kernels.h"
#include "volume.h"

static inline float turned(const float *row, float x, float y, float z)
{
    return row[0] * x + row[1] * y + row[2] * z;
}

/* Whether any voxel of a block can be seen: its ball against the planes of the view. */
static int is_seen(const struct tandem_fuse_job *job, const float *centre, float radius)
{
    const float wide = radius * job->focal_px, z = centre[2];
    return z + radius > 0 && z - radius < job->far_m && job->focal_px * centre[0] + (job->cx_px + 1) * z > -2 * wide &&
           job->focal_px * centre[0] - ((float)job->width - job->cx_px) * z < 2 * wide &&
           job->focal_px * centre[1] + (job->cy_px + 1) * z > -2 * wide &&
           job->focal_px * centre[1] - ((float)job->height - job->cy_px) * z < 2 * wide;
}

static inline int32_t weight_of(const struct tandem_fuse_job *job, float depth)
{
    const float sure = job->sure_m / (job->noise_per_m * depth * depth);
    const float share = sure < 1 ? sure * sure : 1;
    const int32_t weight = (int32_t)(job->weight_one * share + 0.5f);
    return weight < 1 ? 1 : weight;
}

static inline void add_colour(uint8_t *colour, const uint8_t *seen, int32_t held, int32_t weight)
{
    for (int c = 0; c < 3; c++) {
        const float mean = (float)(colour[c] * held + seen[c] * weight) / (float)(held + weight);
        colour[c] = (uint8_t)(mean + 0.5f);
    }
}

static int32_t one_row(const struct tandem_fuse_job *job, const float *start, const float *step, int64_t at)
{
    const struct tandem_volume *volume = job->volume;
    int32_t place[BLOCK_SIDE];
    float depth[BLOCK_SIDE];
    for (int i = 0; i < BLOCK_SIDE; i++) { /* vectorised: no branch leaves the loop */
        const float x = start[0] + step[0] * (float)i, y = start[1] + step[1] * (float)i;
        const float z = start[2] + step[2] * (float)i, safe = z > 1e-3f ? z : 1e-3f;
        const float u = job->focal_px * x / safe + job->cx_px + 0.5f, v = job->focal_px * y / safe + job->cy_px + 0.5f;
        const int inside = z > 1e-3f && u >= 0 && v >= 0 && u < (float)job->width && v < (float)job->height;
        place[i] = inside ? (int32_t)v * job->width + (int32_t)u : -1;
        depth[i] = z;
    }
    int32_t changed = 0;
    for (int i = 0; i < BLOCK_SIDE; i++) {
        if (place[i] < 0) {
            continue;
        }
        const float seen = job->depth_m[place[i]], distance = seen - depth[i];
        if (!(seen > 0 && seen <= job->far_m && distance >= -volume->truncation_m)) {
            continue;
        }
        const float share = distance / volume->truncation_m;
        const int32_t held = volume->weights[at + i], weight = weight_of(job, seen), total = held + weight;
        changed = 1;
        volume->weights[at + i] = (uint16_t)(total < job->most_weight ? total : job->most_weight);
        if (share >= 1 && volume->field[at + i] == FIELD_ONE) {
            continue; /* empty before and now: most voxels */
        }
        const int32_t value = (int32_t)floorf((share < 1 ? share : 1) * FIELD_ONE + 0.5f);
        const float mean = (float)(volume->field[at + i] * held + value * weight) / (float)total;
        const int32_t rounded = (int32_t)floorf(mean + 0.5f);
        volume->field[at + i] = (int16_t)(rounded != 0 ? rounded : 1); /* a node exactly on the surface would give empty triangles */
        if (share < 1) {
            add_colour(volume->colours + 3 * (at + i), job->colours + 3 * (int64_t)place[i], held, weight);
        }
    }
    return changed;
}

void ISA_NAME(fuse_blocks)(const struct tandem_fuse_job *job, int32_t from, int32_t to)
{
    const struct tandem_volume *volume = job->volume;
    const float *pose = job->camera_world, voxel = volume->voxel_m, half = 0.5f * (BLOCK_SIDE - 1) * voxel;
    const float radius = 1.7320508f * half;
    for (int32_t number = from; number < to; number++) {
        const int32_t *place = volume->places + 3 * (int64_t)number;
        float corner[3], centre[3], first[3];
        for (int axis = 0; axis < 3; axis++) {
            corner[axis] = (float)(BLOCK_SIDE * place[axis]) * voxel;
        }
        for (int axis = 0; axis < 3; axis++) {
            const float *row = pose + 4 * axis;
            first[axis] = turned(row, corner[0], corner[1], corner[2]) + row[3];
            centre[axis] = first[axis] + turned(row, half, half, half);
        }
        job->changed[number] = 0;
        if (!is_seen(job, centre, radius)) {
            continue;
        }
        const float step[3] = {pose[0] * voxel, pose[4] * voxel, pose[8] * voxel};
        for (int line = 0; line < BLOCK_SIDE * BLOCK_SIDE; line++) {
            const float y = (float)(line % BLOCK_SIDE) * voxel, z = (float)(line / BLOCK_SIDE) * voxel;
            float start[3];
            for (int axis = 0; axis < 3; axis++) {
                start[axis] = first[axis] + (pose[4 * axis + 1] * y + pose[4 * axis + 2] * z);
            }
            job->changed[number] |= (uint8_t)one_row(job, start, step, (int64_t)number * BLOCK_VOXELS + BLOCK_SIDE * line);
        }
    }
}
