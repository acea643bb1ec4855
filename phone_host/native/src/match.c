/* The matcher: who works on what, and the steps that are cheap for one thread.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <string.h>

#include "crew.h"
#include "finish.h"
#include "guide.h"
#include "kernels.h"
#include "layout.h"
#include "match.h"
#include "support.h"

enum {
    STRIP = 256,   /* rows of one sweep; strips are cut by the image's height alone, so that results do not depend on threads */
    WARM_UP = 24,  /* rows that a strip's vertical path begins earlier: older rows hardly count */
    SPECKLE_AREA = 42,  /* islands of up to 42 px are mismatches more often than objects */
    GUIDE_ISLAND = 100, /* the same in the guide, px of its size */
    VOTES = 3      /* rounds: each carries a surface three pixels further; more close holes that are better left */
};

/* Pixel locking undone: 0.12 px sin(2 pi d) (Shimizu and Okutomi, IJCV 63(3), 2005), for d in sixteenths. */
static const float UNLOCKED_PX[STEPS_PER_PX] = {
    0.0f,  0.04592201f,  0.08485281f,  0.11086554f,  0.12f,  0.11086554f,  0.08485281f,  0.04592201f,
    0.0f, -0.04592201f, -0.08485281f, -0.11086554f, -0.12f, -0.11086554f, -0.08485281f, -0.04592201f};

struct work {
    const struct tandem_kernels *kernels;
    struct tandem_match_job *job;
    struct finish finish;
    int left_strips, right_strips, threads;
    size_t scratch_bytes;
    uint8_t *scratch; /* one for each thread or task of the sweeps, whichever are fewer */
    int16_t *left, *right;
    uint8_t *told;
    struct speckles speckles;
    struct bridges bridges;
    struct guide guide;
    struct support support;
    size_t support_bytes;
    uint8_t *support_scratch; /* one for each thread */
};

static int strips_of(int rows) { return (rows + STRIP - 1) / STRIP; }

static int right_rows_of(int height) { return (height + RIGHT_STEP - 1) / RIGHT_STEP; }

static int sweeps_of(const struct work *work) { return work->left_strips + work->right_strips; }

/* Lay out what guide and support need beyond the planes of the rest. */
static void guide_laid_out(struct work *work, uint8_t **at)
{
    const struct tandem_match_job *job = work->job;
    const size_t width = (size_t)job->width, pixels = width * (size_t)job->height;
    struct guide *guide = &work->guide;
    struct support *support = &work->support;
    *guide = guide_of(job->width, job->height, job->disparities);
    guide->left = job->left;
    guide->right = job->right;
    guide->left_stride = job->left_stride;
    guide->right_stride = job->right_stride;
    guide->steps = (int16_t *)(void *)taken(at, 2 * (size_t)guide->small_width * (size_t)guide->small_height);
    guide->scratch = taken(at, work->kernels->guide_scratch(guide));
    *support = (struct support){.width = job->width, .height = job->height, .left = job->left, .right = job->right,
                                .left_stride = job->left_stride, .right_stride = job->right_stride, .guide = guide,
                                .steps = work->finish.checked, .margin = job->confidence};
    support->own = (uint8_t *)work->finish.rough;
    support->other = support->own + pixels;
    support->apart = support->other + pixels;
    support->flags = support->apart + pixels;
    support->regions = (struct region *)(void *)job->disparity;
    support->region_capacity = (int32_t)(pixels * sizeof(int16_t) / sizeof(struct region));
    support->smooth = (int16_t *)(void *)job->disparity + pixels;
    support->runs = (struct region_run *)(void *)taken(at, 2 * (width + 1) * sizeof(struct region_run));
    work->support_bytes = (work->kernels->support_scratch(job->width) + 127) / 64 * 64;
    work->support_scratch = taken(at, work->support_bytes * (size_t)work->threads);
}

/* Lay the workspace out. Returns its size. What is not needed at the same time shares memory, the results' own planes included:
 *
 *     sweeps       raw disparities left, right | scratch | margins: in `confidence`
 *     check        raw disparities left, right | checked | margins
 *     speckles     parents                     | checked | margins, sizes: in `disparity`
 *     support      costs, distance, flags      | checked | margins, regions and the guide at full size: in `disparity`
 *     votes                                    | checked | margins, two more planes of steps: in `disparity`
 *     px           rough                       | steps, then margins
 *     smooth       rough                       | margins | confidence, disparity
 */
static size_t laid_out(struct work *work, uint8_t *memory)
{
    struct tandem_match_job *job = work->job;
    const size_t width = (size_t)job->width, height = (size_t)job->height, pixels = width * height;
    uint8_t *at = memory;
    work->left_strips = strips_of(job->height);
    work->right_strips = strips_of(right_rows_of(job->height));
    const int tasks = sweeps_of(work), threads = job->threads < 1 ? 1 : job->threads;
    work->threads = threads < MOST_THREADS ? threads : MOST_THREADS;
    const int sweepers = work->threads < tasks ? work->threads : tasks;
    work->scratch_bytes = (work->kernels->sweep_scratch(job->width, job->disparities) + 127) / 64 * 64;
    const size_t guarded = rough_pitch(job->width) * (height + 2 * GUARD) * sizeof(float);
    work->finish.rough = (float *)(void *)taken(&at, guarded);
    work->left = (int16_t *)(void *)work->finish.rough;
    work->right = work->left + pixels;
    const size_t scratch = (size_t)sweepers * work->scratch_bytes, checked = pixels * sizeof(int16_t);
    work->scratch = taken(&at, scratch > checked ? scratch : checked);
    work->finish.checked = (int16_t *)(void *)work->scratch;
    work->finish.disparity = job->disparity;
    work->finish.confidence = job->confidence;
    work->told = taken(&at, height);
    work->speckles = (struct speckles){
        .width = job->width,
        .height = job->height,
        .band = BAND,
        .area = SPECKLE_AREA,
        .steps = work->finish.checked,
        .parent = (int32_t *)(void *)work->finish.rough,
        .size = (int32_t *)(void *)job->disparity,
        .run_of = (int32_t *)(void *)taken(&at, (size_t)work->threads * 2 * width * sizeof(int32_t)),
    };
    work->bridges = (struct bridges){.width = job->width, .height = job->height, .steps = work->finish.checked, .margin = job->confidence};
    if (job->guide) {
        guide_laid_out(work, &at);
        work->bridges.support = &work->support;
    }
    return (size_t)(at - memory);
}

/* ---- the steps, each a number of tasks ---- */

static void sweep_task(struct work *work, int task, int thread)
{
    const struct tandem_match_job *job = work->job;
    const int is_right = task >= work->left_strips, strip = is_right ? task - work->left_strips : task;
    const int rows = is_right ? right_rows_of(job->height) : job->height, strips = is_right ? work->right_strips : work->left_strips;
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
        .row_step = is_right ? RIGHT_STEP : 1,
        .rows = rows,
        .begin = strip * rows / strips,
        .end = (strip + 1) * rows / strips,
        .steps = is_right ? work->right : work->left,
        .margin = work->finish.confidence,
        .scratch = work->scratch + (size_t)(work->threads < sweeps_of(work) ? thread : task) * work->scratch_bytes,
    };
    const int warm_up = WARM_UP / sweep.row_step;
    sweep.first = sweep.begin > warm_up ? sweep.begin - warm_up : 0;
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

/* The steps after as many rounds of votes; each round reads what the two before it left, and writes a third plane. */
static int16_t *voted(const struct work *work, int rounds)
{
    int16_t *planes = (int16_t *)(void *)work->job->disparity;
    const size_t pixels = (size_t)work->job->width * (size_t)work->job->height;
    return rounds % 3 == 0 ? work->finish.checked : planes + (rounds % 3 - 1) * pixels;
}

static void vote_band(const struct work *work, int round, int from, int to)
{
    const struct tandem_match_job *job = work->job;
    const struct vote vote = {.width = job->width, .height = job->height, .image = job->left, .stride = job->left_stride,
                              .before = voted(work, round > 0 ? round - 1 : 0), .from = voted(work, round), .to = voted(work, round + 1),
                              .margin = job->confidence};
    work->kernels->vote_rows(&vote, from, to);
}

/* A row of nothing. */
static void clear_row(struct work *work, int y)
{
    const size_t pitch = rough_pitch(work->job->width);
    float *row = work->finish.rough + (size_t)(y + GUARD) * pitch;
    for (size_t x = 0; x < pitch; x++) {
        row[x] = NONE_PX;
    }
}

/* Rows of steps become px, and their margins are limited. The first and the last band have the rows of nothing beside the image, too. */
static void band_to_px(struct work *work, int from, int to)
{
    const int width = work->job->width, height = work->job->height;
    for (int y = -GUARD; y < 0 && from == 0; y++) {
        clear_row(work, y);
    }
    for (int y = height; y < height + GUARD && to == height; y++) {
        clear_row(work, y);
    }
    for (int y = from; y < to; y++) {
        const ptrdiff_t at = (ptrdiff_t)y * width;
        const int16_t *steps = voted(work, work->job->guide ? VOTES : 0) + at;
        const uint8_t *margin = work->finish.confidence + at;
        int16_t *limited = work->finish.checked + at;
        float *row = work->finish.rough + (size_t)(y + GUARD) * rough_pitch(width);
        for (int x = 0; x < GUARD; x++) {
            row[x] = row[(size_t)x + GUARD + (size_t)width] = NONE_PX;
        }
        row += GUARD;
        for (int x = 0; x < width; x++) {
            const int value = steps[x];
            row[x] = value < 0 ? NONE_PX : (float)value * (1.0f / STEPS_PER_PX) + UNLOCKED_PX[value & (STEPS_PER_PX - 1)];
            limited[x] = (int16_t)(value < 0 ? 0 : margin[x] < MARGIN_CAP ? margin[x] : MARGIN_CAP);
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
    /* Its islands go, too. Its volume, of 32 bytes a pixel at least, is not needed any more. */
    const int width = guide->small_width, height = guide->small_height;
    int32_t *memory = (int32_t *)(void *)guide->scratch, pixels = width * height;
    const struct speckles islands = {.width = width, .height = height, .band = height, .area = GUIDE_ISLAND, .steps = guide->steps,
                                     .parent = memory, .size = memory + pixels, .run_of = memory + 2 * pixels};
    speckles_label_rows(&islands, 0, height, 0);
    speckles_drop_rows(&islands, 0, height);
}

enum step {
    SWEEP,
    CHECK,
    LABEL,
    JOIN,
    SPECKLES,
    GUIDE, /* this and the next four: the support, see support.h */
    FIT,
    REGIONS,
    DROP,
    FILL,
    ROWS_BRIDGED,
    COLUMNS_BRIDGED,
    VOTE,
    TO_PX = VOTE + VOTES,
    SMOOTH,
    STEPS
};
_Static_assert((int)STEPS <= (int)MOST_STEPS, "the crew counts the tasks of each step");

static int tasks_of(void *context, int step)
{
    const struct work *work = context;
    const int bands = (work->job->height + BAND - 1) / BAND, slabs = (work->job->width + SLAB - 1) / SLAB;
    const int is_guided = work->job->guide != 0;
    switch (step) {
    case SWEEP:
        return sweeps_of(work) + is_guided;
    case JOIN:
        return 1;
    case REGIONS:
        return is_guided;
    case FILL:
        return is_guided ? slabs : 0;
    case COLUMNS_BRIDGED:
        return slabs;
    default:
        return !is_guided && (step == GUIDE || step == FIT || step == DROP || (step >= VOTE && step < TO_PX)) ? 0 : bands;
    }
}

static void do_task(void *context, int step, int task, int thread)
{
    struct work *work = context;
    const int height = work->job->height, from = task * BAND, to = from + BAND < height ? from + BAND : height;
    const int left = task * SLAB, right = left + SLAB < work->job->width ? left + SLAB : work->job->width;
    uint8_t *scratch = work->support_scratch + (size_t)thread * work->support_bytes;
    switch (step) {
    case SWEEP:
        if (work->job->guide && task == 0) { /* first: it takes longer than a sweep */
            guide_task(work);
        } else {
            sweep_task(work, task - (work->job->guide != 0), thread);
        }
        break;
    case CHECK:
        work->kernels->check_rows(&work->finish, from, to);
        break;
    case LABEL:
        speckles_label_rows(&work->speckles, from, to, thread);
        break;
    case JOIN:
        speckles_join_bands(&work->speckles);
        break;
    case SPECKLES:
        speckles_drop_rows(&work->speckles, from, to);
        break;
    case GUIDE:
        work->kernels->support_smooth_rows(&work->support, from, to, scratch);
        break;
    case FIT:
        work->kernels->support_cost_rows(&work->support, from, to, scratch);
        break;
    case REGIONS:
        support_regions(&work->support);
        break;
    case DROP:
        work->kernels->support_drop_rows(&work->support, from, to);
        break;
    case FILL:
        support_fill(&work->support, left, right);
        break;
    case ROWS_BRIDGED:
        bridge_rows(&work->bridges, from, to);
        break;
    case COLUMNS_BRIDGED:
        bridge_columns(&work->bridges, left, right);
        break;
    case TO_PX:
        band_to_px(work, from, to);
        break;
    case SMOOTH:
        work->kernels->smooth_rows(&work->finish, from, to);
        break;
    default:
        vote_band(work, step - VOTE, from, to);
        break;
    }
}

static int is_size(const struct tandem_match_job *job)
{
    return job->width >= 1 && job->height >= 1 && job->width <= INT16_MAX && job->height <= INT16_MAX && job->disparities >= 1 &&
           job->disparities <= MOST_DISPARITIES;
}

int64_t tandem_match_bytes(int32_t isa, const struct tandem_match_job *job)
{
    struct work work = {.kernels = tandem_kernels_of(isa), .job = (struct tandem_match_job *)(uintptr_t)job};
    return work.kernels == NULL || !is_size(job) ? -1 : (int64_t)laid_out(&work, NULL) + 64;
}

int32_t tandem_match(int32_t isa, struct tandem_match_job *job)
{
    struct work work = {.kernels = tandem_kernels_of(isa), .job = job};
    if (work.kernels == NULL) {
        return TANDEM_NO_SUCH_ISA;
    }
    if (!is_size(job)) {
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
