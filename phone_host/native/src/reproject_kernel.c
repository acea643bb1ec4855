/* From disparities to points in one pass: drop what cannot be told from infinity, compute, cut to the limits, count.
 *
 * The operations of stereo/reproject.py and stereo/depth_limits.py in their order, so the bits are those of numpy:
 * z = f b / (d + doffs), x = z (u - cx) / f, y = z (v - cy) / f. Compiled once per instruction set; a row goes through in
 * blocks of three short arrays, which are then interleaved.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <math.h>
#include <stddef.h>

#include "kernels.h"
#include "lanes.h"

#define BLOCK 64 /* pixels; a multiple of all LANES */

struct counts {
    lanes_i found, at_zero, in_front, too_far, too_near; /* minus the counts: a mask's lanes are -1 */
};

struct block {
    float x[BLOCK], y[BLOCK], z[BLOCK];
};

/* One block of a row; `wide` and the loop's end are constants where it is inlined. */
static inline void compute(const struct tandem_reproject_job *job, const float *disparity, const float *columns, float row,
                           int wide, struct block *out, struct counts *counts)
{
    const lanes_f none = lanes_of(NAN), far_m = lanes_of(job->far_m), near_m = lanes_of(job->near_m);
    const lanes_f zero = lanes_of(job->at_zero_px), least = lanes_of(job->least_px);
    for (int i = 0; i < BLOCK; i += LANES) {
        const lanes_f d = lanes_load(disparity + i);
        const lanes_i is_zero = d <= zero;
        const lanes_f shifted = d + lanes_of(job->doffs_px);
        const lanes_i seen = (shifted > least) & ~is_zero;
        const lanes_f z = lanes_choose(seen, lanes_of(job->product) / shifted, none);
        const lanes_f x = z * lanes_load(columns + i);
        const lanes_f y = z * lanes_of(row);
        lanes_i beyond = z >= far_m;
        if (wide) {
            beyond |= (lanes_abs(x) >= far_m) | (lanes_abs(y) >= far_m);
        }
        const lanes_i close = (z < near_m) & ~beyond;
        const lanes_i cut = beyond | close;
        counts->found += lanes_finite(d);
        counts->at_zero += is_zero;
        counts->in_front += lanes_finite(z);
        counts->too_far += beyond;
        counts->too_near += close;
        lanes_store(out->x + i, lanes_choose(cut, none, x));
        lanes_store(out->y + i, lanes_choose(cut, none, y));
        lanes_store(out->z + i, lanes_choose(cut, none, z));
    }
}

static inline void interleave(float *restrict to, const struct block *from, int32_t count)
{
    for (int32_t i = 0; i < count; i++) {
        to[3 * i] = from->x[i];
        to[3 * i + 1] = from->y[i];
        to[3 * i + 2] = from->z[i];
    }
}

static inline void one_row(struct tandem_reproject_job *job, int32_t at_row, int wide)
{
    const float *disparity = job->disparity_px + (ptrdiff_t)at_row * job->disparity_stride;
    const float row = job->row_slopes[at_row];
    float *out = job->cloud_m + (ptrdiff_t)at_row * job->width * 3;
    struct counts counts = {{0}, {0}, {0}, {0}, {0}};
    struct block block;
    int32_t x = 0;
    for (; x + BLOCK <= job->width; x += BLOCK) {
        compute(job, disparity + x, job->column_slopes + x, row, wide, &block, &counts);
        interleave(out + 3 * (ptrdiff_t)x, &block, BLOCK);
    }
    if (x < job->width) {
        const size_t rest = (size_t)(job->width - x);
        float disparities[BLOCK], columns[BLOCK];
        for (int i = 0; i < BLOCK; i++) {
            disparities[i] = NAN; /* neither found nor counted */
            columns[i] = 0;
        }
        memcpy(disparities, disparity + x, rest * sizeof(float));
        memcpy(columns, job->column_slopes + x, rest * sizeof(float));
        compute(job, disparities, columns, row, wide, &block, &counts);
        interleave(out + 3 * (ptrdiff_t)x, &block, (int32_t)rest);
    }
    job->found -= lanes_sum(counts.found);
    job->at_zero -= lanes_sum(counts.at_zero);
    job->in_front -= lanes_sum(counts.in_front);
    job->too_far -= lanes_sum(counts.too_far);
    job->too_near -= lanes_sum(counts.too_near);
}

void ISA_NAME(reproject)(struct tandem_reproject_job *job)
{
    job->found = job->at_zero = job->in_front = job->too_far = job->too_near = 0;
    for (int32_t y = 0; y < job->height; y++) {
        if (job->wide) {
            one_row(job, y, 1);
        } else {
            one_row(job, y, 0);
        }
    }
}
