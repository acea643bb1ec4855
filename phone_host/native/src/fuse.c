/* Blocks shared out among threads; each belongs to one of them, so the result doesn't depend on their number.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <stddef.h>

#include "crew.h"
#include "kernels.h"
#include "volume.h"

enum { AT_ONCE = 32 };

struct fuse_work {
    const struct tandem_kernels *kernels;
    const struct tandem_fuse_job *job;
};

static int tasks_of(void *context, int step)
{
    const struct fuse_work *work = context;
    (void)step;
    return (work->job->volume->count + AT_ONCE - 1) / AT_ONCE;
}

static void do_task(void *context, int step, int task, int thread)
{
    const struct fuse_work *work = context;
    const int32_t from = task * AT_ONCE, count = work->job->volume->count;
    (void)step;
    (void)thread;
    work->kernels->fuse_blocks(work->job, from, from + AT_ONCE < count ? from + AT_ONCE : count);
}

int32_t tandem_fuse(int32_t isa, struct tandem_fuse_job *job)
{
    struct fuse_work work = {.kernels = tandem_kernels_of(isa), .job = job};
    if (work.kernels == NULL) {
        return TANDEM_NO_SUCH_ISA;
    }
    if (!volume_is_sound(job->volume) || !is_image(job->width, job->height) || job->most_weight < 1 || job->most_weight > UINT16_MAX) {
        return TANDEM_BAD_SIZE;
    }
    crew_works(&work, 1, job->threads, tasks_of, do_task);
    return TANDEM_DONE;
}
