/* Speckles: connected areas that are too small to be an object.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include "finish.h"

#include "match.h"

enum { SPECKLE_STEP = STEPS_PER_PX };

static inline int32_t root_of(int32_t *parent, int32_t run)
{
    while (parent[run] != run) {
        parent[run] = parent[parent[run]];
        run = parent[run];
    }
    return run;
}

static void join(const struct speckles *job, int32_t one, int32_t other)
{
    const int32_t a = root_of(job->parent, one), b = root_of(job->parent, other);
    if (a != b) { /* the earlier run leads, so that chains stay short */
        const int32_t first = a < b ? a : b, second = a < b ? b : a;
        job->parent[second] = first;
        job->size[first] += job->size[second];
    }
}

static inline int near(int a, int b) { return a - b <= SPECKLE_STEP && b - a <= SPECKLE_STEP; }

/* Where the run that begins at x ends. */
static inline int end_of_run(const int16_t *row, int x, int width)
{
    x++;
    while (x < width && row[x] >= 0 && near(row[x], row[x - 1])) {
        x++;
    }
    return x;
}

/* Write for each pixel of row y the run that it belongs to, -1 for none; new runs hang together with nothing yet. */
static void number_runs(const struct speckles *job, int y, int is_new, int32_t *run_of)
{
    const int width = job->width;
    const int16_t *row = job->steps + (ptrdiff_t)y * width;
    for (int x = 0; x < width;) {
        if (row[x] < 0) {
            run_of[x++] = -1;
            continue;
        }
        const int32_t run = y * width + x;
        const int end = end_of_run(row, x, width);
        if (is_new) {
            job->parent[run] = run;
            job->size[run] = end - x;
            if (end - x > 1) {
                job->parent[run + 1] = end; /* no run begins there, so that its end may be noted */
            }
        }
        for (; x < end; x++) {
            run_of[x] = run;
        }
    }
}

/* Join the runs of row y with those of the row above that they touch. */
static void join_rows(const struct speckles *job, int y, const int32_t *here, const int32_t *there)
{
    const int width = job->width;
    const int16_t *row = job->steps + (ptrdiff_t)y * width, *above = row - width;
    int32_t last_here = -1, last_there = -1;
    for (int x = 0; x < width; x++) {
        if (here[x] >= 0 && there[x] >= 0 && (here[x] != last_here || there[x] != last_there) && near(row[x], above[x])) {
            last_here = here[x];
            last_there = there[x];
            join(job, last_here, last_there);
        }
    }
}

/* Connected areas, with at most SPECKLE_STEP between neighbours: within a band of rows, ... */
void speckles_label_rows(const struct speckles *job, int from, int to, int thread)
{
    const int width = job->width;
    int32_t *here = job->run_of + 2 * (size_t)thread * (size_t)width, *there = here + width;
    for (int y = from; y < to; y++) {
        number_runs(job, y, 1, here);
        if (y > from) {
            join_rows(job, y, here, there);
        }
        int32_t *const swap = here;
        here = there;
        there = swap;
    }
}

/* ... across the bands' borders, ... */
void speckles_join_bands(const struct speckles *job)
{
    const int width = job->width;
    int32_t *here = job->run_of, *there = here + width;
    for (int y = job->band; y < job->height; y += job->band) {
        number_runs(job, y - 1, 0, there);
        number_runs(job, y, 0, here);
        join_rows(job, y, here, there);
    }
}

/* ... and what is too small to be an object goes. */
void speckles_drop_rows(const struct speckles *job, int from, int to)
{
    const int width = job->width;
    for (int y = from; y < to; y++) {
        int16_t *row = job->steps + (ptrdiff_t)y * width;
        for (int x = 0; x < width;) {
            if (row[x] < 0) {
                x++;
                continue;
            }
            const int is_long = x + 1 < width && row[x + 1] >= 0 && near(row[x + 1], row[x]);
            int32_t root = y * width + x;
            const int end = is_long ? job->parent[root + 1] : x + 1;
            while (job->parent[root] != root) { /* other bands read, too: nothing is shortened here */
                root = job->parent[root];
            }
            if (job->size[root] <= job->area) {
                for (; x < end; x++) {
                    row[x] = NO_STEPS;
                }
            }
            x = end;
        }
    }
}
