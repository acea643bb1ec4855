/* The matcher: who works on what, and the steps that are cheap for one thread.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <math.h>
#include <stdatomic.h>
#include <string.h>

#include "crew.h"
#include "kernels.h"
#include "guide.h"
#include "match.h"
#include "support.h"

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

struct run { /* of pixels of one row that hang together */
    int32_t parent, size;
    int32_t row;
    int16_t from, to;
};

struct work {
    const struct tandem_kernels *kernels;
    struct tandem_match_job *job;
    struct finish finish;
    int strips, threads;
    size_t scratch_bytes;
    uint8_t *scratch; /* one for each thread */
    int16_t *left, *right;
    uint8_t *told;
    struct run *runs;
    int32_t *run_of; /* two rows */
    struct guide guide;
    struct support support;
    int16_t *guide_rows; /* a row for each thread */
    size_t support_bytes;
    uint8_t *support_scratch; /* one for each thread */
};

static uint8_t *taken(uint8_t **at, size_t size)
{
    uint8_t *part = *at;
    *at += (size + 127) / 64 * 64;
    return part;
}

static int strips_of(int height) { return (height + STRIP - 1) / STRIP; }

/* Lay out what the support needs: its planes live after the speckles and before the values become px. Returns their end. */
static uint8_t *support_laid_out(struct work *work, uint8_t *at)
{
    const struct tandem_match_job *job = work->job;
    const size_t width = (size_t)job->width, pixels = width * (size_t)job->height;
    struct support *support = &work->support;
    *support = (struct support){.width = job->width, .height = job->height, .left = job->left, .right = job->right,
                                .left_stride = job->left_stride, .right_stride = job->right_stride, .guide = &work->guide,
                                .steps = work->finish.checked};
    support->own = (uint8_t *)work->right; /* the right view is not needed any more */
    support->other = support->own + pixels;
    support->apart = taken(&at, pixels);
    support->flags = taken(&at, pixels);
    support->region_capacity = region_capacity(job->width, job->height);
    support->regions = (struct region *)(void *)taken(&at, (size_t)support->region_capacity * sizeof(struct region));
    support->runs = (struct region_run *)(void *)taken(&at, 2 * (width + 1) * sizeof(struct region_run));
    work->support_bytes = (work->kernels->support_scratch(job->width) + 127) / 64 * 64;
    work->support_scratch = taken(&at, work->support_bytes * (size_t)work->threads);
    return at;
}

/* Lay the workspace out. Returns its size. The planes that are not needed at the same time share memory. */
static size_t laid_out(struct work *work, uint8_t *memory)
{
    const struct tandem_match_job *job = work->job;
    const size_t width = (size_t)job->width, height = (size_t)job->height, pixels = width * height;
    uint8_t *at = memory;
    work->strips = strips_of(job->height);
    const int tasks = 2 * work->strips + (job->guide != 0);
    work->threads = job->threads < 1 ? 1 : job->threads;
    const int sweepers = work->threads < tasks ? work->threads : tasks;
    work->scratch_bytes = (work->kernels->sweep_scratch(job->width, job->disparities) + 127) / 64 * 64;
    work->left = (int16_t *)(void *)taken(&at, pixels * 2);
    work->right = (int16_t *)(void *)taken(&at, pixels * 2);
    work->finish.margin = taken(&at, pixels);
    work->finish.trust = taken(&at, pixels);
    work->finish.checked = (int16_t *)(void *)taken(&at, pixels * 2);
    work->told = taken(&at, height);
    work->run_of = (int32_t *)(void *)taken(&at, 2 * width * sizeof(int32_t));
    work->guide = guide_of(job->width, job->height, job->disparities);
    if (job->guide) {
        work->guide.steps = (int16_t *)(void *)taken(&at, 2 * (size_t)work->guide.small_width * (size_t)work->guide.small_height);
        work->guide_rows = (int16_t *)(void *)taken(&at, 2 * width * (size_t)work->threads);
    }
    uint8_t *shared = at;
    work->scratch = taken(&at, (size_t)sweepers * work->scratch_bytes);
    if (job->guide) { /* matched while the sweeps are under way */
        work->guide.scratch = taken(&at, work->kernels->guide_scratch(&work->guide));
    }
    uint8_t *end = at;
    if (job->guide) {
        at = support_laid_out(work, shared);
        end = at > end ? at : end;
    }
    at = shared; /* the sweeps are over when these are needed */
    work->runs = (struct run *)(void *)taken(&at, pixels * sizeof(struct run));
    end = at > end ? at : end;
    at = shared; /* and so are the runs */
    work->finish.rough = (float *)(void *)taken(&at, rough_pitch(job->width) * (height + 2 * GUARD) * sizeof(float));
    end = at > end ? at : end;
    return (size_t)(end - memory);
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
        .margin = (uint8_t *)(uintptr_t)work->finish.margin,
        .scratch = work->scratch + (size_t)thread * work->scratch_bytes,
    };
    sweep.first = sweep.begin > WARM_UP ? sweep.begin - WARM_UP : 0;
    work->kernels->sweep(&sweep);
}

/* Rows that matching can say anything about: the row, or one above it, changes somewhere from left to right in both images. On any other
 * row every disparity costs the same, and 0 would win only because it comes first. */
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

static int32_t root_of(struct run *runs, int32_t run)
{
    while (runs[run].parent != run) {
        runs[run].parent = runs[runs[run].parent].parent;
        run = runs[run].parent;
    }
    return run;
}

static void join(struct run *runs, int32_t one, int32_t other)
{
    int32_t a = root_of(runs, one), b = root_of(runs, other);
    if (a != b) {
        if (runs[a].size < runs[b].size) {
            const int32_t swap = a;
            a = b;
            b = swap;
        }
        runs[b].parent = a;
        runs[a].size += runs[b].size;
    }
}

static inline int near(int a, int b) { return a - b <= SPECKLE_STEP && b - a <= SPECKLE_STEP; }

/* Drop connected areas, with at most SPECKLE_STEP between neighbours, that are too small to be an object. */
static void drop_speckles(struct work *work)
{
    const int width = work->job->width, height = work->job->height;
    int16_t *plane = work->finish.checked;
    struct run *runs = work->runs;
    int32_t count = 0;
    for (int y = 0; y < height; y++) {
        int16_t *row = plane + (ptrdiff_t)y * width;
        const int16_t *above = row - width;
        int32_t *here = work->run_of + (y & 1 ? width : 0), *there = work->run_of + (y & 1 ? 0 : width);
        int32_t last_here = -1, last_there = -1;
        for (int x = 0; x < width; x++) {
            if (row[x] < 0) {
                here[x] = -1;
                continue;
            }
            if (x > 0 && row[x - 1] >= 0 && near(row[x], row[x - 1])) {
                here[x] = here[x - 1];
                runs[here[x]].to = (int16_t)(x + 1);
            } else {
                runs[count] = (struct run){.parent = count, .size = 0, .row = y, .from = (int16_t)x, .to = (int16_t)(x + 1)};
                here[x] = count++;
            }
            runs[root_of(runs, here[x])].size++;
            if (y > 0 && there[x] >= 0 && near(row[x], above[x]) && !(last_here == here[x] && last_there == there[x])) {
                join(runs, here[x], there[x]);
                last_here = here[x];
                last_there = there[x];
            }
        }
    }
    for (int32_t i = 0; i < count; i++) {
        if (runs[root_of(runs, i)].size <= SPECKLE_AREA) {
            int16_t *row = plane + (ptrdiff_t)runs[i].row * width;
            for (int x = runs[i].from; x < runs[i].to; x++) {
                row[x] = NO_STEPS;
            }
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

/* Rows of steps become px, and their gaps are bridged. */
static void band_to_px(struct work *work, int task)
{
    const int width = work->job->width, height = work->job->height;
    const size_t pitch = rough_pitch(width);
    const int from = task * BAND, to = from + BAND < height ? from + BAND : height;
    for (int y = from; y < to; y++) {
        const int16_t *steps = work->finish.checked + (ptrdiff_t)y * width;
        float *row = work->finish.rough + (size_t)(y + GUARD) * pitch;
        for (int x = 0; x < GUARD; x++) {
            row[x] = row[(size_t)x + GUARD + (size_t)width] = NONE_PX;
        }
        row += GUARD;
        for (int x = 0; x < width; x++) {
            const int value = steps[x];
            row[x] = value < 0 ? NONE_PX : (float)value * (1.0f / STEPS_PER_PX) + UNLOCKED_PX[value & (STEPS_PER_PX - 1)];
        }
        int known = -1;
        for (int x = 0; x < width; x++) {
            if (steps[x] >= 0) {
                if (known >= 0 && x - known > 1) {
                    bridge(row, 1, known, x);
                }
                known = x;
            }
        }
    }
}

static void bridge_columns(struct work *work, int task)
{
    const int width = work->job->width, height = work->job->height;
    const size_t pitch = rough_pitch(width);
    const int from = task * SLAB, to = from + SLAB < width ? from + SLAB : width;
    int known[SLAB];
    float *plane = work->finish.rough + GUARD * pitch + GUARD;
    for (int i = 0; i < SLAB; i++) {
        known[i] = -1;
    }
    for (int y = 0; y < height; y++) {
        const float *row = plane + (size_t)y * pitch;
        for (int x = from; x < to; x++) {
            if (row[x] >= 0.0f) {
                const int last = known[x - from];
                if (last >= 0 && y - last > 1) {
                    bridge(plane + x, (ptrdiff_t)pitch, last, y);
                }
                known[x - from] = y;
            }
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

/* The guide's own checks but that of the right view. */
static void guide_task(struct work *work)
{
    struct guide *guide = &work->guide;
    work->kernels->guide(guide);
    for (int y = 0; y < guide->small_height; y++) {
        const int last = (y + 1) * guide->factor - 1;
        if (!work->told[last < guide->height ? last : guide->height - 1]) {
            for (int x = 0; x < guide->small_width; x++) {
                guide->steps[(ptrdiff_t)y * guide->small_width + x] = NO_STEPS;
            }
        }
    }
    /* Its volume, of 32 bytes a pixel at least, is not needed any more. */
    const size_t pixels = (size_t)guide->small_width * (size_t)guide->small_height;
    struct region_run *runs = (struct region_run *)(void *)(guide->scratch + (pixels * sizeof(struct region) + 63) / 64 * 64);
    support_drop_islands(guide, (struct region *)(void *)guide->scratch, runs);
}

enum step {
    SWEEP,
    CHECK,
    SPECKLES,
    FIT, /* this and the next four: the support, see support.h */
    SIDES,
    REGIONS,
    DROP,
    FILL,
    TO_PX,
    COLUMNS_BRIDGED,
    OPEN,
    SMOOTH,
    STEPS
};

static int tasks_of(void *context, int step)
{
    const struct work *work = context;
    const int bands = (work->job->height + BAND - 1) / BAND, slabs = (work->job->width + SLAB - 1) / SLAB;
    const int is_guided = work->job->guide != 0;
    switch (step) {
    case SWEEP:
        return 2 * work->strips + is_guided;
    case FIT:
    case DROP:
    case OPEN:
        return is_guided ? bands : 0;
    case SIDES:
    case FILL:
        return is_guided ? slabs : 0;
    case REGIONS:
        return is_guided;
    case SPECKLES:
        return 1;
    case COLUMNS_BRIDGED:
        return slabs;
    default:
        return bands;
    }
}

static void do_task(void *context, int step, int task, int thread)
{
    struct work *work = context;
    const int height = work->job->height, from = task * BAND, to = from + BAND < height ? from + BAND : height;
    const int left = task * SLAB, right = left + SLAB < work->job->width ? left + SLAB : work->job->width;
    int16_t *row = work->guide_rows + (ptrdiff_t)thread * work->job->width;
    switch (step) {
    case SWEEP:
        if (task == 2 * work->strips) {
            guide_task(work);
        } else {
            sweep_task(work, task, thread);
        }
        break;
    case FIT:
        work->kernels->support_cost_rows(&work->support, from, to, work->support_scratch + (size_t)thread * work->support_bytes);
        break;
    case SIDES:
        support_columns(&work->support, left, right);
        break;
    case REGIONS:
        support_regions(&work->support);
        break;
    case DROP:
        support_drop_rows(&work->support, from, to, row);
        break;
    case FILL:
        support_fill(&work->support, left, right);
        break;
    case OPEN:
        support_open_rows(&work->support, work->finish.rough, from, to, row);
        break;
    case CHECK:
        work->kernels->check_rows(&work->finish, from, to);
        break;
    case SPECKLES:
        drop_speckles(work);
        clear_guards(work);
        break;
    case TO_PX:
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
    work.guide.left = job->left;
    work.guide.right = job->right;
    work.guide.left_stride = job->left_stride;
    work.guide.right_stride = job->right_stride;
    work.finish.width = job->width;
    work.finish.height = job->height;
    work.finish.left = work.left;
    work.finish.right = work.right;
    work.finish.told = work.told;
    work.finish.disparity = job->disparity;
    work.finish.confidence = job->confidence;
    find_told_rows(&work);
    crew_works(&work, STEPS, work.threads, tasks_of, do_task);
    return TANDEM_DONE;
}
