/* The rows of a cast shared out among threads: first all points, then the normals, which need their neighbours' points.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <stddef.h>

#include "crew.h"
#include "kernels.h"
#include "volume.h"

struct cast_work {
    const struct tandem_kernels *kernels;
    const struct tandem_cast_job *job;
};

static int tasks_of(void *context, int step)
{
    (void)step;
    return ((const struct cast_work *)context)->job->height;
}

static void do_task(void *context, int step, int task, int thread)
{
    const struct cast_work *work = context;
    (void)thread;
    (step == 0 ? work->kernels->cast_row : work->kernels->cast_normals)(work->job, task);
}

int32_t tandem_cast(int32_t isa, struct tandem_cast_job *job)
{
    struct cast_work work = {.kernels = tandem_kernels_of(isa), .job = job};
    if (work.kernels == NULL) {
        return TANDEM_NO_SUCH_ISA;
    }
    if (!volume_is_sound(job->volume) || !is_image(job->width, job->height)) {
        return TANDEM_BAD_SIZE;
    }
    crew_works(&work, 2, job->threads, tasks_of, do_task);
    return TANDEM_DONE;
}
