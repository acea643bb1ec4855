/* The matcher: who works on what, and the steps that are cheap for one thread.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <math.h>
#include <stdatomic.h>
#include <string.h>

#include "crew.h"
#include "kernels.h"
#include "match.h"

enum {
    STRIP = 256,   /* rows of one sweep; strips are cut by the image's height alone, so that results do not depend on threads */
    WARM_UP = 24,  /* rows that a strip's vertical path begins earlier: older rows hardly count */
    BAND = 16,     /* rows of one task after the sweeps */
    SLAB = 64,     /* columns of one task */
    SPECKLE_AREA = 60, /* islands of up to 60 px (about 8 x 8) are mismatches more often than objects */
    SPECKLE_STEP = STEPS_PER_PX,
    GAP = 16 /* gaps of up to 16 px are bridged: three of four such pixels are right within 2 px; wider gaps do worse */
};
static const float GAP_STEP_PX = 1.0f;

/* Pixel locking undone: 0.12 px sin(2 pi d) (Shimizu and Okutomi, IJCV 63(3), 2005), for d in sixteenths. */
static const float UNLOCKED_PX[STEPS_PER_PX] = {
    0.0f,  0.04592201f,  0.08485281f,  0.11086554f,  0.12f,  0.11086554f,  0.08485281f,  0.04592201f,
    0.0f, -0.04592201f, -0.08485281f, -0.11086554f, -0.12f, -0.11086554f, -0.08485281f, -0.04592201f};

struct work {
    const struct tandem_kernels *kernels;
    struct tandem_match_job *job;
    struct finish finish;
    int strips, threads;
    size_t scratch_bytes;
    uint8_t *scratch; /* one for each thread */
    int16_t *left, *right;
    uint8_t *told;
    int32_t *parent, *size; /* of the runs of pixels that hang together; a run has the number of its first pixel */
    int32_t *run_of;        /* two rows for each thread */
};

static uint8_t *taken(uint8_t **at, size_t size)
{
    uint8_t *part = *at;
    *at += (size + 127) / 64 * 64;
    return part;
}

static int strips_of(int height) { return (height + STRIP - 1) / STRIP; }

/* Lay the workspace out. Returns its size. What is not needed at the same time shares memory, the results' own planes included:
 *
 *     sweeps       raw disparities left, right | scratch      | margins: in `confidence`
 *     check        raw disparities left, right | checked      | margins
 *     speckles     parents                     | checked      | sizes: in `disparity`
 *     px, bridges  rough                       | checked: margins
 *     smooth       rough                       | margins      | disparity, confidence
 */
static size_t laid_out(struct work *work, uint8_t *memory)
{
    struct tandem_match_job *job = work->job;
    const size_t width = (size_t)job->width, height = (size_t)job->height, pixels = width * height;
    uint8_t *at = memory;
    work->strips = strips_of(job->height);
    const int tasks = 2 * work->strips, threads = job->threads < 1 ? 1 : job->threads;
    work->threads = threads < MOST_THREADS ? threads : MOST_THREADS;
    const int sweepers = work->threads < tasks ? work->threads : tasks;
    work->scratch_bytes = (work->kernels->sweep_scratch(job->width, job->disparities) + 127) / 64 * 64;
    const size_t guarded = rough_pitch(job->width) * (height + 2 * GUARD) * sizeof(float);
    work->finish.rough = (float *)(void *)taken(&at, guarded);
    work->left = (int16_t *)(void *)work->finish.rough;
    work->right = work->left + pixels;
    work->parent = (int32_t *)(void *)work->finish.rough;
    work->size = (int32_t *)(void *)job->disparity;
    const size_t scratch = (size_t)sweepers * work->scratch_bytes, checked = pixels * sizeof(int16_t);
    work->scratch = taken(&at, scratch > checked ? scratch : checked);
    work->finish.checked = (int16_t *)(void *)work->scratch;
    work->finish.disparity = job->disparity;
    work->finish.confidence = job->confidence;
    work->told = taken(&at, height);
    work->run_of = (int32_t *)(void *)taken(&at, (size_t)work->threads * 2 * width * sizeof(int32_t));
    return (size_t)(at - memory);
}

/* ---- the steps, each a number of tasks ---- */

static void sweep_task(struct work *work, int task, int thread)
{
    const struct tandem_match_job *job = work->job;
    const int is_right = task & 1, strip = task / 2;
    struct sweep sweep = {
        .own = is_right ? job->right : job->left,
        .other = is_right ? job->left : job->right,
        .own_stride = is_right ? job->right_stride : job->left_stride,
        .other_stride = is_right ? job->left_stride : job->right_stride,
        .width = job->width,
        .height = job->height,
        .disparities = job->disparities,
        .is_right = is_right,
        .is_upward = is_right, /* two views, two directions: mistakes that one direction makes are not made twice */
        .begin = strip * job->height / work->strips,
        .end = (strip + 1) * job->height / work->strips,
        .steps = is_right ? work->right : work->left,
        .margin = work->finish.confidence,
        .scratch = work->scratch + (size_t)thread * work->scratch_bytes,
    };
    sweep.first = sweep.begin > WARM_UP ? sweep.begin - WARM_UP : 0;
    work->kernels->sweep(&sweep);
}

/* Rows that matching can say anything about: the row, or one above it, changes somewhere from left to right in both images. On any
 * other row every disparity costs the same, and 0 would win only because it comes first. */
static void find_told_rows(struct work *work)
{
    const struct tandem_match_job *job = work->job;
    int left_told = 0, right_told = 0;
    for (int y = 0; y < job->height; y++) {
        const uint8_t *left = job->left + y * job->left_stride, *right = job->right + y * job->right_stride;
        const size_t rest = (size_t)job->width - 1;
        left_told = left_told || memcmp(left, left + 1, rest) != 0;
        right_told = right_told || memcmp(right, right + 1, rest) != 0;
        work->told[y] = (uint8_t)(left_told && right_told);
    }
}

static inline int32_t root_of(int32_t *parent, int32_t run)
{
    while (parent[run] != run) {
        parent[run] = parent[parent[run]];
        run = parent[run];
    }
    return run;
}

static void join(struct work *work, int32_t one, int32_t other)
{
    const int32_t a = root_of(work->parent, one), b = root_of(work->parent, other);
    if (a != b) { /* the earlier run leads, so that chains stay short */
        const int32_t first = a < b ? a : b, second = a < b ? b : a;
        work->parent[second] = first;
        work->size[first] += work->size[second];
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
static void number_runs(struct work *work, int y, int is_new, int32_t *run_of)
{
    const int width = work->job->width;
    const int16_t *row = work->finish.checked + (ptrdiff_t)y * width;
    for (int x = 0; x < width;) {
        if (row[x] < 0) {
            run_of[x++] = -1;
            continue;
        }
        const int32_t run = y * width + x;
        const int end = end_of_run(row, x, width);
        if (is_new) {
            work->parent[run] = run;
            work->size[run] = end - x;
            if (end - x > 1) {
                work->parent[run + 1] = end; /* no run begins there, so that its end may be noted */
            }
        }
        for (; x < end; x++) {
            run_of[x] = run;
        }
    }
}

/* Join the runs of row y with those of the row above that they touch. */
static void join_rows(struct work *work, int y, const int32_t *here, const int32_t *there)
{
    const int width = work->job->width;
    const int16_t *row = work->finish.checked + (ptrdiff_t)y * width, *above = row - width;
    int32_t last_here = -1, last_there = -1;
    for (int x = 0; x < width; x++) {
        if (here[x] >= 0 && there[x] >= 0 && (here[x] != last_here || there[x] != last_there) && near(row[x], above[x])) {
            last_here = here[x];
            last_there = there[x];
            join(work, last_here, last_there);
        }
    }
}

/* Connected areas, with at most SPECKLE_STEP between neighbours: within a band of rows, ... */
static void label_band(struct work *work, int from, int to, int thread)
{
    const int width = work->job->width;
    int32_t *here = work->run_of + 2 * (size_t)thread * (size_t)width, *there = here + width;
    for (int y = from; y < to; y++) {
        number_runs(work, y, 1, here);
        if (y > from) {
            join_rows(work, y, here, there);
        }
        int32_t *const swap = here;
        here = there;
        there = swap;
    }
}

/* ... across the bands' borders, ... */
static void join_bands(struct work *work)
{
    const int width = work->job->width;
    int32_t *here = work->run_of, *there = here + width;
    for (int y = BAND; y < work->job->height; y += BAND) {
        number_runs(work, y - 1, 0, there);
        number_runs(work, y, 0, here);
        join_rows(work, y, here, there);
    }
}

/* ... and what is too small to be an object goes. */
static void drop_speckles(struct work *work, int from, int to)
{
    const int width = work->job->width;
    for (int y = from; y < to; y++) {
        int16_t *row = work->finish.checked + (ptrdiff_t)y * width;
        for (int x = 0; x < width;) {
            if (row[x] < 0) {
                x++;
                continue;
            }
            const int is_long = x + 1 < width && row[x + 1] >= 0 && near(row[x + 1], row[x]);
            int32_t root = y * width + x;
            const int end = is_long ? work->parent[root + 1] : x + 1;
            while (work->parent[root] != root) { /* other bands read, too: nothing is shortened here */
                root = work->parent[root];
            }
            if (work->size[root] <= SPECKLE_AREA) {
                for (; x < end; x++) {
                    row[x] = NO_STEPS;
                }
            }
            x = end;
        }
    }
}

/* Close a gap between two known values along a line if they agree: the disparity of a plane is linear. */
static inline void bridge(float *values, ptrdiff_t stride, int before, int after)
{
    const int gap = after - before - 1;
    if (gap < 1 || gap > GAP) {
        return;
    }
    const float start = values[before * stride], rise = values[after * stride] - start;
    if (fabsf(rise) <= GAP_STEP_PX) {
        for (int i = 1; i <= gap; i++) {
            values[(before + i) * stride] = start + rise * ((float)i / (float)(gap + 1));
        }
    }
}

/* Rows of steps become px, and their gaps are bridged; their margins take their place. */
static void band_to_px(struct work *work, int task)
{
    const int width = work->job->width, height = work->job->height;
    const size_t pitch = rough_pitch(width);
    const int from = task * BAND, to = from + BAND < height ? from + BAND : height;
    for (int y = from; y < to; y++) {
        int16_t *steps = work->finish.checked + (ptrdiff_t)y * width;
        const uint8_t *margin = work->finish.confidence + (ptrdiff_t)y * width;
        float *row = work->finish.rough + (size_t)(y + GUARD) * pitch;
        for (int x = 0; x < GUARD; x++) {
            row[x] = row[(size_t)x + GUARD + (size_t)width] = NONE_PX;
        }
        row += GUARD;
        for (int x = 0; x < width; x++) {
            const int value = steps[x];
            row[x] = value < 0 ? NONE_PX : (float)value * (1.0f / STEPS_PER_PX) + UNLOCKED_PX[value & (STEPS_PER_PX - 1)];
        }
        for (int x = 1; x < width; x++) {
            if (steps[x] < 0 && steps[x - 1] >= 0) { /* a gap begins */
                const int known = x - 1;
                while (x < width && steps[x] < 0) {
                    x++;
                }
                if (x < width) {
                    bridge(row, 1, known, x);
                }
            }
        }
        for (int x = 0; x < width; x++) {
            const int sure = margin[x] < MARGIN_CAP ? margin[x] : MARGIN_CAP;
            steps[x] = (int16_t)(steps[x] < 0 ? 0 : sure);
        }
    }
}

/* Bridge the gaps that end in row y. */
static void bridge_row(float *row, ptrdiff_t pitch, const int *known, int count, int y)
{
    for (int x = 0; x < count; x++) {
        if (row[x] >= 0.0f && y - 1 - known[x] > 0) {
            bridge(row + x - y * pitch, pitch, known[x], y);
        }
    }
}

static void bridge_columns(struct work *work, int task)
{
    const int width = work->job->width, height = work->job->height;
    const size_t pitch = rough_pitch(width);
    const int from = task * SLAB, count = from + SLAB < width ? SLAB : width - from;
    int known[SLAB]; /* the last row with a value; before the first one: far above, so that no gap is bridged */
    float *row = work->finish.rough + GUARD * pitch + GUARD + (size_t)from;
    for (int i = 0; i < SLAB; i++) {
        known[i] = -GAP - 2;
    }
    for (int y = 0; y < height; y++, row += pitch) {
        int ends = 0; /* most rows end no gap: that is found out for all columns at once */
        for (int x = 0; x < count; x++) {
            const int is_known = -(row[x] >= 0.0f), gap = y - 1 - known[x];
            ends |= is_known & -((unsigned)(gap - 1) < GAP);
        }
        if (ends != 0) {
            bridge_row(row, (ptrdiff_t)pitch, known, count, y);
        }
        for (int x = 0; x < count; x++) {
            known[x] = row[x] >= 0.0f ? y : known[x];
        }
    }
}

/* The rows above and below the image, which hold nothing. */
static void clear_guards(struct work *work)
{
    const int height = work->job->height;
    const size_t pitch = rough_pitch(work->job->width);
    for (int y = -GUARD; y < height + GUARD; y++) {
        if (y < 0 || y >= height) {
            float *row = work->finish.rough + (size_t)(y + GUARD) * pitch;
            for (size_t x = 0; x < pitch; x++) {
                row[x] = NONE_PX;
            }
        }
    }
}

enum step { SWEEP, CHECK, LABEL, JOIN, SPECKLES, TO_PX, COLUMNS_BRIDGED, SMOOTH, STEPS };

static int tasks_of(void *context, int step)
{
    const struct work *work = context;
    const int bands = (work->job->height + BAND - 1) / BAND;
    switch (step) {
    case SWEEP:
        return 2 * work->strips;
    case JOIN:
        return 1;
    case COLUMNS_BRIDGED:
        return (work->job->width + SLAB - 1) / SLAB;
    default:
        return bands;
    }
}

static void do_task(void *context, int step, int task, int thread)
{
    struct work *work = context;
    const int height = work->job->height, from = task * BAND, to = from + BAND < height ? from + BAND : height;
    switch (step) {
    case SWEEP:
        sweep_task(work, task, thread);
        break;
    case CHECK:
        work->kernels->check_rows(&work->finish, from, to);
        break;
    case LABEL:
        label_band(work, from, to, thread);
        break;
    case JOIN:
        join_bands(work);
        break;
    case SPECKLES:
        drop_speckles(work, from, to);
        break;
    case TO_PX:
        if (task == 0) {
            clear_guards(work);
        }
        band_to_px(work, task);
        break;
    case COLUMNS_BRIDGED:
        bridge_columns(work, task);
        break;
    default:
        work->kernels->smooth_rows(&work->finish, from, to);
        break;
    }
}

int64_t tandem_match_bytes(int32_t isa, const struct tandem_match_job *job)
{
    struct work work = {.kernels = tandem_kernels_of(isa), .job = (struct tandem_match_job *)(uintptr_t)job};
    return work.kernels == NULL ? -1 : (int64_t)laid_out(&work, NULL) + 64;
}

int32_t tandem_match(int32_t isa, struct tandem_match_job *job)
{
    struct work work = {.kernels = tandem_kernels_of(isa), .job = job};
    if (work.kernels == NULL) {
        return TANDEM_NO_SUCH_ISA;
    }
    if (job->width < 1 || job->height < 1 || job->width > INT16_MAX || job->disparities < 1 ||
        job->disparities > MOST_DISPARITIES) {
        return TANDEM_BAD_SIZE;
    }
    if (job->workspace_bytes < tandem_match_bytes(isa, job)) {
        return TANDEM_NO_ROOM;
    }
    laid_out(&work, (uint8_t *)(((uintptr_t)job->workspace + 63) / 64 * 64));
    work.finish.width = job->width;
    work.finish.height = job->height;
    work.finish.left = work.left;
    work.finish.right = work.right;
    work.finish.told = work.told;
    find_told_rows(&work);
    crew_works(&work, STEPS, work.threads, tasks_of, do_task);
    return TANDEM_DONE;
}
