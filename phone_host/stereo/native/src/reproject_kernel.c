/* From disparities to points in one pass: drop what cannot be told from infinity, compute, cut to the limits, count.
 *
 * The operations of stereo/reproject.py and stereo/depth_limits.py in their order, so the bits are those of numpy:
 * z = f b / (d + doffs), x = z (u - cx) / f, y = z (v - cy) / f. Compiled once per instruction set; the loop is written without
 * branches for the compiler to vectorise.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <float.h>
#include <math.h>
#include <stddef.h>

#include "kernels.h"

static inline int is_finite(float value)
{
    return fabsf(value) <= FLT_MAX;
}

static void one_row(struct tandem_reproject_job *job, int32_t y, int wide)
{
    const float *restrict disparity = job->disparity_px + (ptrdiff_t)y * job->disparity_stride;
    const float *restrict columns = job->column_slopes;
    float *restrict out = job->cloud_m + (ptrdiff_t)y * job->width * 3;
    const float row = job->row_slopes[y], doffs = job->doffs_px, product = job->product, least = job->least_px;
    const float zero = job->at_zero_px, far_m = job->far_m, near_m = job->near_m;
    int32_t found = 0, at_zero = 0, in_front = 0, too_far = 0, too_near = 0;
    for (int32_t x = 0; x < job->width; x++) {
        const float d = disparity[x];
        const int is_zero = d <= zero;
        const float shifted = d + doffs;
        const int seen = (shifted > least) & !is_zero;
        const float depth = seen ? product / shifted : NAN;
        const float px = depth * columns[x];
        const float py = depth * row;
        int beyond = depth >= far_m;
        if (wide) {
            beyond |= (fabsf(px) >= far_m) | (fabsf(py) >= far_m);
        }
        const int close = (depth < near_m) & !beyond;
        const int cut = beyond | close;
        found += is_finite(d);
        at_zero += is_zero;
        in_front += is_finite(depth);
        too_far += beyond;
        too_near += close;
        out[3 * (ptrdiff_t)x] = cut ? NAN : px;
        out[3 * (ptrdiff_t)x + 1] = cut ? NAN : py;
        out[3 * (ptrdiff_t)x + 2] = cut ? NAN : depth;
    }
    job->found += found;
    job->at_zero += at_zero;
    job->in_front += in_front;
    job->too_far += too_far;
    job->too_near += too_near;
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
