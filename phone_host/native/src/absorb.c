/* A field taken into another at a rigid motion: values between the voxels of the one, averaged into the other by their weights.
 *
 * Each block belongs to one thread, in double precision in a fixed order, so the result does not depend on the number of threads.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <math.h>
#include <stddef.h>

#include "crew.h"
#include "volume.h"

enum { CORNERS = 8, COLOURS = 3 };

static const double NEXT_TO_NOTHING = 1e-4;

struct sample {
    double field;
    double weight;
    double tint[COLOURS];
    double tinted;
};

static int64_t voxel_of(const struct tandem_volume *volume, int32_t x, int32_t y, int32_t z)
{
    const int32_t number = volume_find(volume, x >> 3, y >> 3, z >> 3);
    return number < 0 ? -1 : (int64_t)number * BLOCK_VOXELS + (x & 7) + (ptrdiff_t)BLOCK_SIDE * ((y & 7) + BLOCK_SIDE * (z & 7));
}

/* What the field holds between eight voxels; 0: one of them is not known. */
static int sampled(const struct tandem_volume *of, const double *at, struct sample *found)
{
    const double low[3] = {floor(at[0]), floor(at[1]), floor(at[2])};
    *found = (struct sample){0};
    for (int corner = 0; corner < CORNERS; corner++) {
        const int side[3] = {corner & 1, corner >> 1 & 1, corner >> 2};
        double by = 1;
        int32_t there[3];
        for (int axis = 0; axis < 3; axis++) {
            const double share = at[axis] - low[axis];
            by *= side[axis] ? share : 1 - share;
            there[axis] = (int32_t)low[axis] + side[axis];
        }
        const int64_t voxel = voxel_of(of, there[0], there[1], there[2]);
        if (voxel < 0 || of->weights[voxel] == 0) {
            if (by < NEXT_TO_NOTHING) {
                continue;
            }
            return 0;
        }
        const int16_t value = of->field[voxel];
        found->field += by * value;
        found->weight += by * of->weights[voxel];
        if (value < FIELD_ONE && value > -FIELD_ONE) { /* elsewhere no colour was told */
            found->tinted += by;
            for (int colour = 0; colour < COLOURS; colour++) {
                found->tint[colour] += by * of->colours[COLOURS * voxel + colour];
            }
        }
    }
    return 1;
}

static void average(const struct tandem_absorb_job *job, int64_t voxel, const struct sample *coming)
{
    const struct tandem_volume *into = job->into;
    const double held = into->weights[voxel], rounded = rint(coming->weight), weight = rounded < 1 ? 1 : rounded;
    const double value = rint(coming->field), total = held + weight, before = into->field[voxel];
    const double mean = rint((before * held + (value == 0 ? 1 : value) * weight) / total);
    const double mine = before < FIELD_ONE && before > -FIELD_ONE ? held : 0;
    const double theirs = coming->tinted > 0 ? weight : 0;
    if (mine + theirs > 0) {
        for (int colour = 0; colour < COLOURS; colour++) {
            uint8_t *tint = into->colours + COLOURS * voxel + colour;
            const double other = theirs > 0 ? coming->tint[colour] / coming->tinted : 0;
            *tint = (uint8_t)rint((*tint * mine + other * theirs) / (mine + theirs));
        }
    }
    into->field[voxel] = (int16_t)(mean == 0 ? 1 : mean);
    into->weights[voxel] = (uint16_t)(total > job->most_weight ? job->most_weight : total);
}

static int tasks_of(void *context, int step)
{
    const struct tandem_absorb_job *job = context;
    (void)step;
    return job->into->count;
}

static void do_task(void *context, int step, int task, int thread)
{
    const struct tandem_absorb_job *job = context;
    const int32_t *place = job->into->places + 3 * (ptrdiff_t)task;
    (void)step;
    (void)thread;
    if (!job->chosen[task]) {
        return;
    }
    uint8_t changed = 0;
    for (int at = 0; at < BLOCK_VOXELS; at++) {
        const double world[3] = {
            (double)BLOCK_SIDE * place[0] + (at & 7),
            (double)BLOCK_SIDE * place[1] + (at >> 3 & 7),
            (double)BLOCK_SIDE * place[2] + (at >> 6),
        };
        double there[3];
        for (int axis = 0; axis < 3; axis++) {
            const double *row = job->of_into + 4 * axis;
            there[axis] = row[0] * world[0] + row[1] * world[1] + row[2] * world[2] + row[3];
        }
        struct sample coming;
        if (sampled(job->of, there, &coming)) {
            average(job, (int64_t)task * BLOCK_VOXELS + at, &coming);
            changed = 1;
        }
    }
    job->chosen[task] = changed;
}

int32_t tandem_absorb(struct tandem_absorb_job *job)
{
    if (!volume_is_sound(job->into) || !volume_is_sound(job->of) || job->most_weight < 1 || job->most_weight > UINT16_MAX) {
        return TANDEM_BAD_SIZE;
    }
    crew_works(job, 1, job->threads, tasks_of, do_task);
    return TANDEM_DONE;
}
