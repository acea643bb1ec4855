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

/* What a view tells of some cells: 0 or 1 each. Loops over it are vectorised, and no branch leaves them. */
struct told {
    int32_t through[AT_ONCE], hidden[AT_ONCE], blank[AT_ONCE];
};

static inline void tell(const struct tandem_carve_job *job, const float *start, int32_t from, int count, struct told *to)
{
    const float *pose = job->camera_world, cell = job->cell_m, low = job->low_m[0];
    const float start_x = start[0], start_y = start[1], start_z = start[2];
    const float step_x = pose[0], step_y = pose[4], step_z = pose[8];
    const float focal = job->focal_px, cx = job->cx_px, cy = job->cy_px;
    const float width = (float)job->width, height = (float)job->height;
    const float clear_m = job->clear_m, noise_per_m = job->noise_per_m, sigmas = job->sigmas;
    int32_t place[AT_ONCE], inside[AT_ONCE];
    float depth[AT_ONCE], seen[AT_ONCE];
    for (int i = 0; i < count; i++) {
        const float along = low + (float)(from + i) * cell;
        const float x = start_x + step_x * along, y = start_y + step_y * along, z = start_z + step_z * along;
        const float safe = z > 1e-3f ? z : 1e-3f;
        const float u = focal * x / safe + cx + 0.5f, v = focal * y / safe + cy + 0.5f;
        inside[i] = (z > 1e-3f) & (u >= 0) & (v >= 0) & (u < width) & (v < height);
        const float column = inside[i] ? u : 0, line = inside[i] ? v : 0;
        place[i] = (int32_t)line * job->width + (int32_t)column;
        depth[i] = z;
    }
    for (int i = 0; i < count; i++) {
        seen[i] = job->depth_m[place[i]];
    }
    for (int i = 0; i < count; i++) {
        const float clear = clear_m + sigmas * noise_per_m * seen[i] * seen[i];
        const int known = seen[i] > 0, endless = seen[i] > FLT_MAX; /* nothing is there as far as one can see */
        to->through[i] = inside[i] & (endless | (known & (seen[i] - depth[i] > clear)));
        to->hidden[i] = inside[i] & known & !endless & (depth[i] - seen[i] > clear);
        to->blank[i] = inside[i] & !known;
    }
}

static inline void count_up(uint8_t *counters, const int32_t *by, int count)
{
    for (int i = 0; i < count; i++) {
        counters[i] = (uint8_t)(counters[i] + (by[i] & (counters[i] < UINT8_MAX)));
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
            struct told told;
            tell(job, start, from, to - from, &told);
            count_up(job->looked_through + at + from, told.through, to - from);
            count_up(job->hidden + at + from, told.hidden, to - from);
            count_up(job->blank + at + from, told.blank, to - from);
        }
    }
}
