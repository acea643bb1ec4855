/* Normal equations of a depth image against the surface that was cast: point to plane, partners where they project to.
 *
 * Sums are kept per row of the image, in float64, and added up by the caller in the order of the rows: whoever computed which row, the
 * result is the same. Y. Chen and G. Medioni, "Object modelling by registration of multiple range images", 1992.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <math.h>
#include <stddef.h>
#include <string.h>

#include "crew.h"
#include "volume.h"

enum { UPPER = 21, NEAR = 27, OFF_M = 28, PARTNERS = 29, VISIBLE = 30, SUMS = 31 };

static void add(const struct tandem_register_job *job, double *sums, const float *point, const float *model, const float *normal)
{
    const double jacobian[6] = {
        point[1] * normal[2] - point[2] * normal[1],
        point[2] * normal[0] - point[0] * normal[2],
        point[0] * normal[1] - point[1] * normal[0],
        normal[0],
        normal[1],
        normal[2],
    };
    const double off = (double)normal[0] * (model[0] - point[0]) + (double)normal[1] * (model[1] - point[1]) +
                       (double)normal[2] * (model[2] - point[2]);
    const double sigma = job->floor_m + job->noise_per_m * point[2] * point[2], sigmas = fabs(off) / sigma;
    const double weight = (sigmas > job->huber_sigmas ? job->huber_sigmas / sigmas : 1) / (sigma * sigma);
    int at = 0;
    for (int i = 0; i < 6; i++) {
        for (int j = i; j < 6; j++) {
            sums[at++] += weight * jacobian[i] * jacobian[j];
        }
        sums[UPPER + i] += weight * jacobian[i] * off;
    }
    sums[NEAR] += sigmas < 3 ? 1 : 0;
    sums[OFF_M] += fabs(off);
    sums[PARTNERS] += 1;
}

static void register_row(const struct tandem_register_job *job, int32_t task)
{
    double *sums = job->sums + (ptrdiff_t)SUMS * task;
    memset(sums, 0, SUMS * sizeof *sums);
    const int32_t v = task * job->step;
    const float *pose = job->model_camera, dy = ((float)v - job->cy_px) / job->focal_px;
    for (int32_t u = 0; u < job->width; u += job->step) {
        const float depth = job->depth_m[(ptrdiff_t)v * job->width + u];
        if (!(depth > 0)) {
            continue;
        }
        const float x = ((float)u - job->cx_px) / job->focal_px * depth, y = dy * depth;
        float point[3];
        for (int axis = 0; axis < 3; axis++) {
            const float *row = pose + 4 * axis;
            point[axis] = row[0] * x + row[1] * y + row[2] * depth + row[3];
        }
        if (!(point[2] > 1e-3f)) {
            continue;
        }
        const float across = job->focal_px * point[0] / point[2] + job->cx_px + 0.5f;
        const float down = job->focal_px * point[1] / point[2] + job->cy_px + 0.5f;
        if (!(across >= 0 && down >= 0 && across < (float)job->width && down < (float)job->height)) {
            continue;
        }
        sums[VISIBLE] += 1;
        const ptrdiff_t at = 3 * ((ptrdiff_t)(int32_t)down * job->width + (int32_t)across);
        const float *model = job->points_m + at, *normal = job->normals + at;
        const float a = model[0] - point[0], b = model[1] - point[1], c = model[2] - point[2];
        if (a * a + b * b + c * c <= job->most_m * job->most_m && normal[0] == normal[0]) { /* both false for NAN */
            add(job, sums, point, model, normal);
        }
    }
}

static int tasks_of(void *context, int step)
{
    const struct tandem_register_job *job = context;
    (void)step;
    return (job->height + job->step - 1) / job->step;
}

static void do_task(void *context, int step, int task, int thread)
{
    (void)step;
    (void)thread;
    register_row(context, task);
}

int32_t tandem_register(struct tandem_register_job *job)
{
    if (!is_image(job->width, job->height) || job->step < 1 || job->step > INT16_MAX) {
        return TANDEM_BAD_SIZE;
    }
    crew_works(job, 1, job->threads, tasks_of, do_task);
    return TANDEM_DONE;
}
