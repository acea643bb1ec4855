/* A depth image into a grid of cells: where the camera looked through, and what lies hidden behind something.
 *
 * A cell is looked through where the depth at its middle's pixel is clearly beyond it, hidden where it is clearly before it.
 * K. N. Kutulakos and S. M. Seitz, "A Theory of Shape by Space Carving", 2000.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <float.h>
#include <stddef.h>

#include "kernels.h"
#include "volume.h"

enum { AT_ONCE = 64 };

static inline void count_up(uint8_t *counter)
{
    *counter += *counter < UINT8_MAX;
}

static void some_cells(const struct tandem_carve_job *job, const float *start, int32_t from, int32_t to, ptrdiff_t at)
{
    uint8_t *looked = job->looked_through + at, *hidden = job->hidden + at, *blank = job->blank + at;
    const float *pose = job->camera_world, cell = job->cell_m;
    const float step[3] = {pose[0], pose[4], pose[8]};
    int32_t place[AT_ONCE];
    float depth[AT_ONCE];
    for (int i = 0; i < to - from; i++) { /* vectorised: no branch leaves the loop */
        const float along = job->low_m[0] + (float)(from + i) * cell;
        const float x = start[0] + step[0] * along, y = start[1] + step[1] * along, z = start[2] + step[2] * along;
        const float safe = z > 1e-3f ? z : 1e-3f;
        const float u = job->focal_px * x / safe + job->cx_px + 0.5f, v = job->focal_px * y / safe + job->cy_px + 0.5f;
        const int inside = z > 1e-3f && u >= 0 && v >= 0 && u < (float)job->width && v < (float)job->height;
        place[i] = inside ? (int32_t)v * job->width + (int32_t)u : -1;
        depth[i] = z;
    }
    for (int i = 0; i < to - from; i++) {
        if (place[i] < 0) {
            continue;
        }
        const float seen = job->depth_m[place[i]];
        if (seen > FLT_MAX) { /* nothing is there as far as one can see */
            count_up(looked + from + i);
            continue;
        }
        if (!(seen > 0)) {
            count_up(blank + from + i);
            continue;
        }
        const float clear = job->clear_m + job->sigmas * job->noise_per_m * seen * seen;
        if (seen - depth[i] > clear) {
            count_up(looked + from + i);
        } else if (depth[i] - seen > clear) {
            count_up(hidden + from + i);
        }
    }
}

void ISA_NAME(carve_layer)(const struct tandem_carve_job *job, int32_t layer)
{
    const float *pose = job->camera_world, z = job->low_m[2] + (float)layer * job->cell_m;
    for (int32_t line = 0; line < job->counts[1]; line++) {
        const float y = job->low_m[1] + (float)line * job->cell_m;
        const ptrdiff_t at = ((ptrdiff_t)layer * job->counts[1] + line) * job->counts[0];
        float start[3];
        for (int axis = 0; axis < 3; axis++) {
            start[axis] = pose[4 * axis + 1] * y + pose[4 * axis + 2] * z + pose[4 * axis + 3];
        }
        for (int32_t from = 0; from < job->counts[0]; from += AT_ONCE) {
            const int32_t to = from + AT_ONCE < job->counts[0] ? from + AT_ONCE : job->counts[0];
            some_cells(job, start, from, to, at);
        }
    }
}
