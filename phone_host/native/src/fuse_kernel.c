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

enum { SLICE = BLOCK_SIDE * BLOCK_SIDE };

/* What a slice of a block gets from the depth image. Loops over it are long enough to be vectorised, and no branch leaves them. */
struct slice {
    int32_t pixel[SLICE];  /* that shows the voxel; 0 where none does */
    int32_t weight[SLICE]; /* 0: the voxel gets nothing */
    int32_t held[SLICE];   /* its weight before */
    float depth[SLICE];    /* of the voxel, m */
    float seen[SLICE];     /* of the pixel, m; 0: none */
    float share[SLICE];    /* how far it lies before the surface, in truncations */
};

/* Which pixels show the voxels, and how deep they are. */
static inline void project(const struct tandem_fuse_job *job, const float *first, const float *in_slice, struct slice *to)
{
    const float *pose = job->camera_world, voxel = job->volume->voxel_m; /* copied: what is stored might alias them */
    const float down_x = pose[1], down_y = pose[5], down_z = pose[9];
    const float right_x = pose[0] * voxel, right_y = pose[4] * voxel, right_z = pose[8] * voxel;
    const float first_x = first[0], first_y = first[1], first_z = first[2];
    const float in_x = in_slice[0], in_y = in_slice[1], in_z = in_slice[2];
    const float focal = job->focal_px, cx = job->cx_px, cy = job->cy_px;
    const float width = (float)job->width, height = (float)job->height;
    const int32_t stride = job->width;
    for (int i = 0; i < SLICE; i++) {
        const float across = (float)(i & (BLOCK_SIDE - 1)), down = (float)(i / BLOCK_SIDE) * voxel;
        const float x = first_x + (down_x * down + in_x) + right_x * across;
        const float y = first_y + (down_y * down + in_y) + right_y * across;
        const float z = first_z + (down_z * down + in_z) + right_z * across, safe = z > 1e-3f ? z : 1e-3f;
        const float u = focal * x / safe + cx + 0.5f, v = focal * y / safe + cy + 0.5f;
        const int inside = (z > 1e-3f) & (u >= 0) & (v >= 0) & (u < width) & (v < height);
        const float column = inside ? u : 0, line = inside ? v : 0;
        to->pixel[i] = (int32_t)line * stride + (int32_t)column;
        to->seen[i] = inside ? 1 : 0;
        to->depth[i] = z;
    }
    for (int i = 0; i < SLICE; i++) {
        to->seen[i] *= job->depth_m[to->pixel[i]]; /* not known stays so: NaN */
    }
}

/* How much each voxel gets: nothing, where no depth is known or the surface hides it. Returns whether any gets something. */
static inline int weigh(const struct tandem_fuse_job *job, struct slice *to)
{
    const float truncation = job->volume->truncation_m, far = job->far_m, one = (float)job->weight_one;
    const float sure_m = job->sure_m, noise_per_m = job->noise_per_m;
    int32_t any = 0;
    for (int i = 0; i < SLICE; i++) {
        const float seen = to->seen[i], distance = seen - to->depth[i];
        const int gets = (seen > 0) & (seen <= far) & (distance >= -truncation);
        const float known = gets ? seen : 1, sure = sure_m / (noise_per_m * known * known);
        const float share = sure < 1 ? sure * sure : 1;
        const int32_t weight = (int32_t)(one * share + 0.5f), least = weight < 1 ? 1 : weight;
        to->weight[i] = gets ? least : 0;
        to->share[i] = gets ? distance / truncation : 1;
        any |= gets;
    }
    return any;
}

/* Running means of the distances. Returns whether any voxel is near the surface, and gets colour. */
static inline int average(int16_t *field, uint16_t *weights, int32_t most_weight, struct slice *by)
{
    int32_t near = 0;
    for (int i = 0; i < SLICE; i++) {
        const float share = by->share[i] < 1 ? by->share[i] : 1;
        const int32_t weight = by->weight[i], before = field[i], held = weights[i], total = held + weight;
        const int32_t value = (int32_t)floorf(share * FIELD_ONE + 0.5f), parts = total > 0 ? total : 1;
        const int32_t rounded = (int32_t)floorf((float)(before * held + value * weight) / (float)parts + 0.5f);
        const int32_t other = rounded != 0 ? rounded : 1; /* a node exactly on the surface would give empty triangles */
        const int same = (weight == 0) | ((by->share[i] >= 1) & (before == FIELD_ONE)); /* empty before and now: most voxels */
        const int32_t most = weight == 0 ? total : most_weight;
        by->held[i] = held;
        weights[i] = (uint16_t)(total < most ? total : most);
        field[i] = (int16_t)(same ? before : other);
        near |= by->share[i] < 1;
    }
    return near;
}

static inline void add_colour(uint8_t *colour, const uint8_t *seen, int32_t held, int32_t weight)
{
    for (int c = 0; c < 3; c++) {
        const float mean = (float)(colour[c] * held + seen[c] * weight) / (float)(held + weight);
        colour[c] = (uint8_t)(mean + 0.5f);
    }
}

static int32_t one_slice(const struct tandem_fuse_job *job, const float *first, const float *in_slice, int64_t at)
{
    const struct tandem_volume *volume = job->volume;
    struct slice slice;
    project(job, first, in_slice, &slice);
    if (!weigh(job, &slice)) {
        return 0;
    }
    if (average(volume->field + at, volume->weights + at, job->most_weight, &slice)) {
        for (int i = 0; i < SLICE; i++) {
            if (slice.share[i] < 1) {
                add_colour(volume->colours + 3 * (at + i), job->colours + 3 * (int64_t)slice.pixel[i], slice.held[i], slice.weight[i]);
            }
        }
    }
    return 1;
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
        for (int line = 0; line < BLOCK_SIDE; line++) {
            const float z = (float)line * voxel, in_slice[3] = {pose[2] * z, pose[6] * z, pose[10] * z};
            job->changed[number] |= (uint8_t)one_slice(job, first, in_slice, (int64_t)number * BLOCK_VOXELS + SLICE * line);
        }
    }
}
