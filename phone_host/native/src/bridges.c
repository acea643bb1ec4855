/* Bridges over narrow gaps.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include "finish.h"

#include "match.h"
#include "support.h"

enum {
    GAP = 16, /* px: three of four such pixels are right within 2 px; wider gaps do worse */
    GAP_STEP = STEPS_PER_PX
};

/* Close the gap between two known pixels of a line if they agree: the disparity of a plane is linear. `stride` leads from one to the next. */
static inline void bridge(const struct bridges *job, ptrdiff_t before, ptrdiff_t stride, int gap)
{
    int16_t *steps = job->steps + before;
    const int start = steps[0], rise = steps[(gap + 1) * stride] - start;
    if (rise > GAP_STEP || rise < -GAP_STEP) {
        return;
    }
    for (int i = 1; i <= gap; i++) {
        const int part = 2 * rise * i, half = rise < 0 ? -(gap + 1) : gap + 1;
        const int value = start + (part + half) / (2 * (gap + 1));
        const ptrdiff_t at = before + i * stride;
        if (job->support == NULL || support_allows(job->support, at, value)) {
            job->steps[at] = (int16_t)value;
            job->margin[at] = 0; /* no cost was its own */
        }
    }
}

void bridge_rows(const struct bridges *job, int from, int to)
{
    for (int y = from; y < to; y++) {
        const ptrdiff_t row = (ptrdiff_t)y * job->width;
        int known = -GAP - 2;
        for (int x = 0; x < job->width; x++) {
            if (job->steps[row + x] >= 0) {
                const int gap = x - known - 1;
                if (gap > 0 && gap <= GAP) {
                    bridge(job, row + known, 1, gap);
                }
                known = x;
            }
        }
    }
}

void bridge_columns(const struct bridges *job, int from, int to)
{
    const int count = to - from;
    int16_t known[SLAB]; /* the last row with a value; before the first one: far above, so that no gap is bridged */
    for (int x = 0; x < count; x++) {
        known[x] = -GAP - 2;
    }
    for (int y = 0; y < job->height; y++) {
        const int16_t *row = job->steps + (ptrdiff_t)y * job->width + from;
        int16_t ends = 0; /* most rows end no gap: that is found out for all columns at once */
        for (int x = 0; x < count; x++) {
            const uint16_t gap = (uint16_t)(y - 1 - known[x]);
            ends |= (int16_t)((row[x] >= 0) & ((uint16_t)(gap - 1) < GAP));
        }
        for (int x = 0; x < count && ends; x++) {
            const int gap = y - 1 - known[x];
            if (row[x] >= 0 && gap > 0 && gap <= GAP) {
                bridge(job, (ptrdiff_t)known[x] * job->width + from + x, job->width, gap);
            }
        }
        for (int x = 0; x < count; x++) {
            known[x] = row[x] >= 0 ? (int16_t)y : known[x];
        }
    }
}
