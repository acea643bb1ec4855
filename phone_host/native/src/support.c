/* The steps of the support that follow columns or whole regions; see support.h.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include "support.h"

#include <string.h>

enum {
    FAR_PX = 16,      /* a region so far behind the guide is one period off, or seen through the gaps of an object */
    FILL_COST = 135,  /* a quarter of 25 px with 21 grey levels each: where the guide costs more, it is not taken */
    UNSURE = 40,      /* mean margin: below it a region goes if the guide costs less than AS_BAD tenths of what it costs */
    AS_BAD = 11,
    WORSE = 20,       /* where the mean margin is DOUBTFUL */
    MUCH_WORSE = 30   /* where it is behind the guide */
};

/* Down, then up, through some columns. */
static void pass_columns(const struct support *job, int from, int to)
{
    uint8_t state[SLAB], step[SLAB];
    const int count = to - from, width = job->width;
    memset(state, 0, sizeof state);
    for (int y = 0; y < job->height; y++) {
        uint8_t *restrict flags = job->flags + (ptrdiff_t)y * width + from;
        for (int i = 0; i < count; i++) {
            const uint8_t flag = flags[i];
            state[i] = (uint8_t)((flag & CONFIRMS) | (state[i] & ~(flag >> 1) & ~(flag >> 3)));
            flags[i] = (uint8_t)(flag | (state[i] & 1) << 6);
        }
    }
    memset(state, 0, sizeof state);
    memset(step, 0, sizeof step);
    for (int y = job->height - 1; y >= 0; y--) {
        uint8_t *restrict flags = job->flags + (ptrdiff_t)y * width + from;
        for (int i = 0; i < count; i++) {
            const uint8_t flag = flags[i];
            state[i] = (uint8_t)((flag & CONFIRMS) | (state[i] & ~(flag >> 1) & ~step[i]));
            flags[i] = (uint8_t)(flag | (state[i] & 1) << 7);
            step[i] = flag >> 3;
        }
    }
}

/* ---- regions ---- */

static int32_t root_of(struct region *regions, int32_t region)
{
    while (regions[region].parent != region) {
        regions[region].parent = regions[regions[region].parent].parent;
        region = regions[region].parent;
    }
    return region;
}

static void join(struct region *regions, int32_t one, int32_t other)
{
    const int32_t a = root_of(regions, one), b = root_of(regions, other);
    if (a < b) {
        regions[b].parent = a;
    } else {
        regions[a].parent = b;
    }
}

/* Join the runs of a row with those above that they touch. */
static void join_rows(struct region *regions, const struct region_run *here, int count, const struct region_run *above, int count_above)
{
    for (int i = 0, j = 0; i < count && j < count_above;) {
        const int from = here[i].from > above[j].from ? here[i].from : above[j].from;
        const int to = here[i].to < above[j].to ? here[i].to : above[j].to;
        if (from < to) {
            join(regions, here[i].region, above[j].region);
        }
        if (here[i].to < above[j].to) {
            i++;
        } else {
            j++;
        }
    }
}

static int next_set(const uint8_t *row, int x, int width)
{
    uint64_t eight;
    for (; x + 8 <= width; x += 8) {
        memcpy(&eight, row + x, 8);
        if (eight != 0) {
            break;
        }
    }
    while (x < width && row[x] == 0) {
        x++;
    }
    return x;
}

static struct region summed(const struct support *job, ptrdiff_t at, int count, int32_t number)
{
    struct region sum = {.parent = number, .pixels = count};
    for (ptrdiff_t i = at; i < at + count; i++) {
        sum.margin += job->margin[i];
        sum.apart += job->apart[i];
        sum.own += job->own[i];
        sum.other += job->other[i];
    }
    return sum;
}

/* A region goes unless it explains the images better than the guide: the less sure its values are, the more so. */
static int goes(const struct region *region)
{
    const int64_t pixels = region->pixels;
    const int is_doubtful = region->margin < DOUBTFUL * pixels, is_unsure = region->margin < UNSURE * pixels;
    const int is_behind = region->apart < (AS_FAR - FAR_PX) * pixels;
    const uint32_t tenths = is_unsure && is_behind ? MUCH_WORSE : is_doubtful ? WORSE : is_unsure ? AS_BAD : 0;
    return 10 * (uint64_t)region->other < tenths * (uint64_t)region->own;
}

/* Find the regions of values far from the guide, and mark those to drop by 255. Regions beyond the table's end stay: so many are noise that is
 * dropped elsewhere. */
void support_regions(const struct support *job)
{
    const int width = job->width;
    struct region *regions = job->regions;
    struct region_run *here = job->runs, *above = job->runs + width + 1;
    int32_t made = 0;
    int count_above = 0, rows = 0;
    for (; rows < job->height && made + width / 2 + 1 <= job->region_capacity; rows++) {
        const ptrdiff_t at = (ptrdiff_t)rows * width;
        const uint8_t *row = job->apart + at;
        int count = 0;
        for (int x = next_set(row, 0, width), end; x < width; x = next_set(row, end, width)) {
            for (end = x + 1; end < width && row[end] != 0;) {
                end++;
            }
            regions[made] = summed(job, at + x, end - x, made);
            here[count++] = (struct region_run){x, end, made++};
        }
        join_rows(regions, here, count, above, count_above);
        struct region_run *swap = here;
        here = above;
        above = swap;
        count_above = count;
    }
    for (int32_t i = 0; i < made; i++) {
        const int32_t root = root_of(regions, i);
        if (root != i) {
            regions[root].pixels += regions[i].pixels;
            regions[root].margin += regions[i].margin;
            regions[root].apart += regions[i].apart;
            regions[root].own += regions[i].own;
            regions[root].other += regions[i].other;
        }
    }
    made = 0;
    for (int y = 0; y < job->height; y++) {
        uint8_t *row = job->apart + (ptrdiff_t)y * width;
        for (int x = next_set(row, 0, width), end; x < width; x = next_set(row, end, width)) {
            for (end = x + 1; end < width && row[end] != 0;) {
                end++;
            }
            memset(row + x, y < rows && goes(&regions[root_of(regions, made)]) ? DROPPED : 1, (size_t)(end - x));
            made += y < rows;
        }
    }
}

/* Complete surfaces: what is missing takes the guide's value where that is confirmed on all four sides and fits. */
void support_fill(const struct support *job, int from, int to)
{
    const int width = job->width;
    pass_columns(job, from, to);
    for (int y = 0; y < job->height; y++) {
        const ptrdiff_t at = (ptrdiff_t)y * width;
        for (int x = from; x < to; x++) {
            if (job->steps[at + x] < 0 && (job->flags[at + x] & FROM_ALL) == FROM_ALL && job->other[at + x] < FILL_COST &&
                job->smooth[at + x] <= x * STEPS_PER_PX) {
                job->steps[at + x] = job->smooth[at + x];
                job->margin[at + x] = 0; /* no cost was its own */
            }
        }
    }
}
