/* The layers of a grid shared out among threads; each belongs to one of them, so the result doesn't depend on their number.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <stddef.h>

#include "crew.h"
#include "kernels.h"
#include "volume.h"

struct carve_work {
    const struct tandem_kernels *kernels;
    const struct tandem_carve_job *job;
};

static int tasks_of(void *context, int step)
{
    (void)step;
    return ((const struct carve_work *)context)->job->counts[2];
}

static void do_task(void *context, int step, int task, int thread)
{
    const struct carve_work *work = context;
    (void)step;
    (void)thread;
    work->kernels->carve_layer(work->job, task);
}

int32_t tandem_carve(int32_t isa, struct tandem_carve_job *job)
{
    struct carve_work work = {.kernels = tandem_kernels_of(isa), .job = job};
    if (work.kernels == NULL) {
        return TANDEM_NO_SUCH_ISA;
    }
    if (!is_image(job->width, job->height) || job->counts[0] < 1 || job->counts[1] < 1 || job->counts[2] < 1 || !(job->cell_m > 0)) {
        return TANDEM_BAD_SIZE;
    }
    crew_works(&work, 1, job->threads, tasks_of, do_task);
    return TANDEM_DONE;
}
