/* The surface of a volume as a camera sees it: where the field changes its sign along each pixel's ray, and the normals there.
 *
 * A depth that is known from elsewhere is a seed: the ray is searched only near it. Without one it is searched as a whole, or not at all.
 * R. A. Newcombe et al., "KinectFusion", 2011.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <math.h>
#include <stddef.h>

#include "kernels.h"
#include "volume.h"

#define SEED_TRUNCATIONS 1.5f
#define JUMP 0.025f /* a point this share off the middle of its neighbours' depths lies beside a step, not on a slope */
#define KNOWN 0.75f /* least share of a place between eight voxels that must be known */

enum {
    MAX_STEPS = 1 << 17, /* of a ray: 130 m in voxels of 1 mm. Far from the volume, steps vanish in the rounding of the depth */
    ROOT_STEPS = 2, /* of the false position: the field is nearly linear there */
    MEMORY = 2      /* unknown voxels after one before the surface: at a slant, views leave single ones out */
};

struct walk {
    const struct tandem_volume *volume;
    int32_t place[3]; /* of the block that was looked up last */
    int32_t number;
};

/* The voxel's index in the volume's arrays; -1: nothing was fused there. */
static int64_t voxel_at(struct walk *walk, int32_t x, int32_t y, int32_t z)
{
    const int32_t place[3] = {x >> 3, y >> 3, z >> 3}; /* arithmetic shift: floor */
    if (place[0] != walk->place[0] || place[1] != walk->place[1] || place[2] != walk->place[2]) {
        for (int axis = 0; axis < 3; axis++) {
            walk->place[axis] = place[axis];
        }
        walk->number = volume_find(walk->volume, place[0], place[1], place[2]);
    }
    if (walk->number < 0) {
        return -1;
    }
    return (int64_t)walk->number * BLOCK_VOXELS + (x & 7) + 8 * (y & 7) + 64 * (z & 7);
}

/* The field between voxels, trilinear among those that are known; NAN where less than three quarters of the place are. */
static float between(struct walk *walk, const float *at)
{
    int32_t low[3];
    float share[3], sum = 0, known = 0;
    for (int axis = 0; axis < 3; axis++) {
        low[axis] = floor_of(at[axis]);
        share[axis] = at[axis] - (float)low[axis];
    }
    const int in_one = (low[0] & 7) < 7 && (low[1] & 7) < 7 && (low[2] & 7) < 7; /* block: two in three */
    const int64_t first = voxel_at(walk, low[0], low[1], low[2]);
    if (in_one && first < 0) {
        return NAN;
    }
    for (int corner = 0; corner < 8; corner++) {
        const int dx = corner & 1, dy = corner >> 1 & 1, dz = corner >> 2;
        const int64_t voxel = in_one ? first + dx + 8 * dy + 64 * dz : voxel_at(walk, low[0] + dx, low[1] + dy, low[2] + dz);
        if (voxel < 0 || walk->volume->weights[voxel] == 0) {
            continue;
        }
        const float x = dx ? share[0] : 1 - share[0], y = dy ? share[1] : 1 - share[1], z = dz ? share[2] : 1 - share[2];
        sum += x * y * z * (float)walk->volume->field[voxel];
        known += x * y * z;
    }
    return known >= KNOWN ? sum / known : NAN;
}

static void point_at(const struct tandem_cast_job *job, const float *ray, float depth, float *at)
{
    const float scale = 1 / job->volume->voxel_m;
    for (int axis = 0; axis < 3; axis++) {
        at[axis] = (job->world_camera[4 * axis + 3] + depth * ray[axis]) * scale;
    }
}

/* Where the field is 0 between a depth before the surface and one behind it; NAN: it isn't known well enough there. */
static float root(const struct tandem_cast_job *job, struct walk *walk, const float *ray, float before, float behind)
{
    float at[3], middle = NAN;
    point_at(job, ray, before, at);
    float first = between(walk, at);
    point_at(job, ray, behind, at);
    float second = between(walk, at);
    for (int i = 0; i < ROOT_STEPS && first > 0 && second <= 0; i++) {
        middle = before + (behind - before) * (first / (first - second));
        if (i + 1 == ROOT_STEPS) {
            break;
        }
        point_at(job, ray, middle, at);
        const float value = between(walk, at);
        if (value > 0) {
            before = middle;
            first = value;
        } else {
            behind = middle;
            second = value;
        }
    }
    return middle;
}

static float found(const struct tandem_cast_job *job, struct walk *walk, const float *ray, float from, float to)
{
    const float voxel = job->volume->voxel_m, truncation = job->volume->truncation_m;
    float depth = from;
    int before = 0;
    for (int step = 0; step < MAX_STEPS && depth < to; step++) {
        float at[3];
        point_at(job, ray, depth, at);
        const int64_t place = voxel_at(walk, floor_of(at[0] + 0.5f), floor_of(at[1] + 0.5f), floor_of(at[2] + 0.5f));
        if (place < 0 || job->volume->weights[place] == 0) {
            before -= before > 0;
            depth += place < 0 ? 0.5f * truncation : voxel; /* farther would jump over the front of a surface */
            continue;
        }
        const float value = (float)job->volume->field[place] / FIELD_ONE;
        if (value <= 0) {
            /* the nearest voxel lies up to 0.87 voxels off: the sign changes about so far before or behind */
            return before ? root(job, walk, ray, depth - 2 * voxel, depth + voxel) : NAN;
        }
        before = MEMORY;
        const float stride = 0.8f * value * truncation;
        depth += stride > voxel ? stride : voxel;
    }
    return NAN;
}

void ISA_NAME(cast_row)(const struct tandem_cast_job *job, int32_t v)
{
    struct walk walk = {.volume = job->volume, .place = {INT32_MAX, INT32_MAX, INT32_MAX}, .number = -1};
    const float *pose = job->world_camera, dy = ((float)v - job->cy_px) / job->focal_px;
    const float reach = SEED_TRUNCATIONS * job->volume->truncation_m;
    for (int32_t u = 0; u < job->width; u++) {
        const ptrdiff_t at = (ptrdiff_t)v * job->width + u;
        const float seed = job->seeds_m == NULL ? NAN : job->seeds_m[at], dx = ((float)u - job->cx_px) / job->focal_px;
        float from = job->near_m, to = job->far_m, depth = NAN;
        if (seed > 0) {
            from = seed - reach > from ? seed - reach : from;
            to = seed + reach < to ? seed + reach : to;
        }
        if (seed > 0 || job->search) {
            float ray[3];
            for (int axis = 0; axis < 3; axis++) {
                ray[axis] = pose[4 * axis] * dx + pose[4 * axis + 1] * dy + pose[4 * axis + 2];
            }
            depth = found(job, &walk, ray, from, to);
        }
        job->points_m[3 * at] = dx * depth;
        job->points_m[3 * at + 1] = dy * depth;
        job->points_m[3 * at + 2] = depth;
    }
}

/* How the points go on from a pixel along a row or column: to the neighbours on both sides if they lie on one slope, else to the one that
 * does. 0: neither does. */
static int slope(const float *points, ptrdiff_t at, ptrdiff_t next, float *way)
{
    const float *here = points + 3 * at, *low = here - 3 * next, *high = here + 3 * next;
    const float most = JUMP * here[2];
    const float *from = here, *to = here;
    if (fabsf((low[2] + high[2]) * 0.5f - here[2]) <= most) {
        from = low;
        to = high;
    } else if (fabsf(high[2] - here[2]) <= most) {
        to = high;
    } else if (fabsf(low[2] - here[2]) <= most) {
        from = low;
    }
    for (int axis = 0; axis < 3; axis++) {
        way[axis] = to[axis] - from[axis];
    }
    return from != to;
}

/* From the neighbours' points; NAN at the border and where a step lies on both sides. */
void ISA_NAME(cast_normals)(const struct tandem_cast_job *job, int32_t v)
{
    const ptrdiff_t wide = job->width;
    for (int32_t u = 0; u < job->width; u++) {
        const ptrdiff_t at = v * wide + u;
        float *normal = job->normals + 3 * at, a[3], b[3];
        normal[0] = normal[1] = normal[2] = NAN;
        if (u == 0 || v == 0 || u + 1 == job->width || v + 1 == job->height) {
            continue;
        }
        if (!slope(job->points_m, at, 1, a) || !slope(job->points_m, at, wide, b)) {
            continue;
        }
        /* b x a: towards the camera */
        const float x = b[1] * a[2] - b[2] * a[1], y = b[2] * a[0] - b[0] * a[2], z = b[0] * a[1] - b[1] * a[0];
        const float length = sqrtf(x * x + y * y + z * z);
        if (length > 0) {
            normal[0] = x / length;
            normal[1] = y / length;
            normal[2] = z / length;
        }
    }
}
