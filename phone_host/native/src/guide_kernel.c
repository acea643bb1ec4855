/* Semi-global matching of small images over eight paths, in two sweeps: down with five of the paths, whose sums are kept, and up with the
 * other three. The right view is read from the same sums.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#if defined(TANDEM_IS_AVX512) /* half as wide: small images have few disparities, and unused lanes cost as much as used ones */
#undef TANDEM_IS_AVX512
#define TANDEM_IS_AVX2 1
#endif
#include "byte_lanes.h"
#include "costs.h"
#include "guide.h"
#include "kernels.h"
#include "layout.h"
#include "match.h"
#include "parabola.h"
#include "prefilter.h"

enum { ROWS = 4, SLANTS = 3, MOST_GUIDE_CHUNKS = MOST_DISPARITIES / 2 / BYTES + 1 };

struct guide_room {
    int width, height, disparities, chunks;
    size_t lanes, columns, row_bytes;
    size_t small_pitch, own_pitch, other_pitch;
    uint8_t *left, *right;            /* the small images, the right one turned; rows `small_pitch` bytes apart, with their ends repeated */
    uint8_t *volume;                  /* (height, width, lanes): sums of the paths of the way down */
    uint8_t *own, *other[ROWS];       /* planes of the left row; of the right row, backwards */
    uint8_t *cost[ROWS], *sum[ROWS];  /* (columns, lanes) */
    uint8_t *path[2][SLANTS];         /* of the row before and of this one: a column of zeros, (columns + 1, lanes) */
    uint8_t *least[2][SLANTS];        /* the least of each, a column on both sides */
    uint8_t *total;                   /* (columns, lanes), 64 bytes before it */
    uint8_t *right_least;             /* the least sum of each pixel of the right view, backwards */
    uint8_t *low, *high, *best_sum;
    uint16_t *best;
};

static size_t laid_out(struct guide_room *room, const struct guide *job)
{
    uint8_t *at = job->scratch;
    const size_t width = (size_t)job->small_width, height = (size_t)job->small_height;
    room->width = job->small_width;
    room->height = job->small_height;
    room->disparities = job->small_disparities;
    room->lanes = ((size_t)job->small_disparities + GUIDE_LANES - 1) / GUIDE_LANES * GUIDE_LANES;
    room->chunks = (int)(room->lanes / BYTES);
    room->columns = (width + 3) / 4 * 4;
    room->row_bytes = room->columns * room->lanes;
    room->small_pitch = padded(width + MARGIN + BEYOND);
    room->own_pitch = padded(width + MARGIN + BEYOND);
    room->other_pitch = padded(width + room->lanes + MARGIN + BEYOND);
    room->left = taken(&at, height * room->small_pitch) + MARGIN;
    room->right = taken(&at, height * room->small_pitch) + MARGIN;
    room->volume = taken(&at, width * height * room->lanes);
    room->own = taken(&at, PLANES * room->own_pitch) + MARGIN;
    for (int k = 0; k < ROWS; k++) {
        room->other[k] = taken(&at, PLANES * room->other_pitch) + MARGIN;
        room->cost[k] = taken(&at, room->row_bytes);
        room->sum[k] = taken(&at, room->row_bytes);
    }
    for (int i = 0; i < 2 * SLANTS; i++) {
        room->path[i & 1][i / 2] = taken(&at, room->row_bytes + 2 * room->lanes);
        room->least[i & 1][i / 2] = taken(&at, room->columns + 2);
    }
    room->total = taken(&at, room->row_bytes + 128) + 64;
    room->right_least = taken(&at, room->columns + room->lanes);
    room->low = taken(&at, room->columns);
    room->high = taken(&at, room->columns);
    room->best_sum = taken(&at, room->columns);
    room->best = (uint16_t *)(void *)taken(&at, 2 * room->columns);
    return (size_t)(at - job->scratch);
}

size_t ISA_NAME(guide_scratch)(const struct guide *job)
{
    static uint8_t nowhere[128];
    struct guide_room room;
    struct guide unplaced = *job;
    unplaced.scratch = nowhere;
    return laid_out(&room, &unplaced);
}

/* Make a row smaller: the mean of each factor x factor pixels; where the image has fewer, its last are repeated. */
static void shrink_row(const uint8_t *image, ptrdiff_t stride, const struct guide *job, int y, uint8_t *restrict small)
{
    const int factor = job->factor, width = job->small_width, half = factor * factor / 2;
    if (factor == 2 && job->width >= 2 && job->height >= 2) {
        const uint8_t *restrict one = image + 2 * y * stride, *restrict two = one + stride;
        for (int x = 0; x < width; x++) {
            small[x] = (uint8_t)((one[2 * x] + one[2 * x + 1] + two[2 * x] + two[2 * x + 1] + 2) >> 2);
        }
        return;
    }
    for (int x = 0; x < width; x++) {
        int sum = half;
        for (int i = 0; i < factor * factor; i++) {
            const int row = inside_of(y * factor + i / factor, job->height - 1);
            sum += image[row * stride + inside_of(x * factor + i % factor, job->width - 1)];
        }
        small[x] = (uint8_t)(sum / (factor * factor));
    }
}

static void shrink(const struct guide *job, const struct guide_room *room)
{
    const int width = job->small_width;
    for (int y = 0; y < job->small_height; y++) {
        uint8_t *left = room->left + (size_t)y * room->small_pitch, *right = room->right + (size_t)y * room->small_pitch;
        shrink_row(job->left, job->left_stride, job, y, left);
        shrink_row(job->right, job->right_stride, job, y, right);
        for (int x = 0; x < width / 2; x++) {
            const uint8_t swap = right[x];
            right[x] = right[width - 1 - x];
            right[width - 1 - x] = swap;
        }
        widen(left, width, 2);
        widen(right, width, 2);
    }
}

/* Fill the planes of a row of one of the small images. */
static void prepare(const struct guide_room *room, uint8_t *image, int is_turned, int y, uint8_t *planes, size_t pitch)
{
    uint8_t *rows[5];
    for (int i = 0; i < 5; i++) {
        rows[i] = image + (size_t)inside_of(y + i - 2, room->height - 1) * room->small_pitch;
    }
    prefilter_row(rows, room->width, is_turned, planes, pitch);
}

BYTES_INLINE void cost_row(const struct guide_room *room, int k, int y, const int chunks)
{
    const size_t own_pitch = room->own_pitch, other_pitch = room->other_pitch;
    const int unused = (int)room->lanes - room->disparities;
    const bytes cap = bytes_of(COST_CAP);
    prepare(room, room->right, 1, y, room->other[k], other_pitch);
    for (size_t plane = 0; plane < PLANES; plane++) { /* its last pixel is repeated */
        uint8_t *end = room->other[k] + plane * other_pitch + room->width;
        memset(end, end[-1], room->lanes);
    }
    prepare(room, room->left, 0, y, room->own, own_pitch);
    for (int x = 0; x < room->width; x++) {
        const uint8_t *own = room->own + x, *other = room->other[k] + (room->width - 1 - x);
        uint8_t *cost = room->cost[k] + (size_t)x * room->lanes;
        bytes value[PLANES];
        for (int plane = 0; plane < PLANES; plane++) {
            value[plane] = bytes_of(own[(size_t)plane * own_pitch]);
        }
        for (int c = 0; c < chunks; c++) {
            const uint8_t *there = other + c * BYTES;
            const bytes all = grey_and_slope(value, there, other_pitch); /* without the order of neighbours: with it twice as much was wrong on boards */
            bytes_store(cost + c * BYTES, bytes_min(all, cap));
        }
        if (unused > 0) {
            memset(cost + room->disparities, 255, (size_t)unused);
        }
    }
}

/* One step of a path: `path` holds the costs at the pixel before, whose least is `least`, and gets those at this pixel. Returns the chunks' minimum. */
BYTES_INLINE bytes path_step(const uint8_t *cost, bytes *path, bytes least, const int chunks)
{
    const bytes none = bytes_of(255), step = bytes_of(GUIDE_STEP_COST), jumped = bytes_plus(least, bytes_of(GUIDE_JUMP_COST));
    bytes below = none, best = none;
    for (int c = 0; c < chunks; c++) {
        const bytes before = path[c], above = c + 1 < chunks ? path[c + 1] : none;
        const bytes beside = bytes_min(bytes_from_below(before, below), bytes_from_above(before, above));
        const bytes cheapest = bytes_min(bytes_min(before, bytes_plus(beside, step)), jumped);
        path[c] = bytes_plus(bytes_minus(cheapest, least), bytes_load(cost + c * BYTES));
        best = c == 0 ? path[0] : bytes_min(best, path[c]);
        below = before;
    }
    return best;
}

struct along {
    bytes path[MOST_GUIDE_CHUNKS], least;
};

/* The path through four rows from one side. A row is a place of its own, so four paths are under way at once. */
BYTES_INLINE void along_rows(const struct guide_room *room, const int is_back, const int chunks)
{
    struct along rows[ROWS];
    for (int k = 0; k < ROWS; k++) {
        rows[k].least = bytes_of(0);
        for (int c = 0; c < chunks; c++) {
            rows[k].path[c] = bytes_of(0);
        }
    }
    for (int i = 0; i < room->width; i++) {
        const size_t at = (size_t)(is_back ? room->width - 1 - i : i) * room->lanes;
        bytes best[ROWS];
#pragma GCC unroll 4
        for (int k = 0; k < ROWS; k++) {
            uint8_t *sum = room->sum[k] + at;
            best[k] = path_step(room->cost[k] + at, rows[k].path, rows[k].least, chunks);
            for (int c = 0; c < chunks; c++) {
                const bytes path = bytes_half(rows[k].path[c]);
                bytes_store(sum + c * BYTES, is_back ? bytes_plus(bytes_load(sum + c * BYTES), path) : path);
            }
        }
        uint8_t least[ROWS];
        least_of_four(best, least);
        for (int k = 0; k < ROWS; k++) {
            rows[k].least = bytes_of(least[k]);
        }
    }
}

/* The three paths from the row before: from the left, straight, from the right. Their sum is added to `from`, and stored. */
BYTES_INLINE void slanted_row(const struct guide_room *room, int k, int turn, const uint8_t *from, uint8_t *to, const int chunks)
{
    const size_t lanes = room->lanes;
    const uint8_t *cost = room->cost[k];
    for (size_t x = 0; x < room->columns; x += 4) {
        bytes sum[4][MOST_GUIDE_CHUNKS];
        for (size_t i = 0; i < 4; i++) {
            for (int c = 0; c < chunks; c++) {
                sum[i][c] = x + i < (size_t)room->width ? bytes_load(from + (x + i) * lanes + c * BYTES) : bytes_of(0);
            }
        }
#pragma GCC unroll 3
        for (size_t slant = 0; slant < SLANTS; slant++) {
            const uint8_t *before = room->path[turn][slant], *least_before = room->least[turn][slant];
            uint8_t *now = room->path[1 - turn][slant];
            bytes best[4];
#pragma GCC unroll 4
            for (size_t i = 0; i < 4; i++) {
                bytes path[MOST_GUIDE_CHUNKS];
                const size_t column = x + i + slant; /* counted with the column of zeros on the left: that of x + i + slant - 1 */
                for (int c = 0; c < chunks; c++) {
                    path[c] = bytes_load(before + column * lanes + c * BYTES);
                }
                best[i] = path_step(cost + (x + i) * lanes, path, bytes_of(least_before[column]), chunks);
                for (int c = 0; c < chunks; c++) {
                    bytes_store(now + (x + i + 1) * lanes + c * BYTES, path[c]);
                    sum[i][c] = bytes_plus(sum[i][c], bytes_half(path[c]));
                }
            }
            least_of_four(best, room->least[1 - turn][slant] + x + 1);
        }
        for (size_t i = 0; i < 4 && x + i < (size_t)room->width; i++) {
            for (int c = 0; c < chunks; c++) {
                bytes_store(to + (x + i) * lanes + c * BYTES, sum[i][c]);
            }
        }
    }
    for (int slant = 0; slant < SLANTS; slant++) { /* beyond the image no path has come from anywhere */
        const size_t end = (size_t)room->width + 1;
        memset(room->path[1 - turn][slant] + end * lanes, 0, lanes);
        room->least[1 - turn][slant][end] = 0;
    }
}

/* The least sums of a row in the left view, with their places and neighbours, and in the right view. */
BYTES_INLINE void best_row(const struct guide_room *room, const int chunks)
{
    const size_t lanes = room->lanes;
    const ptrdiff_t width = room->width;
    bytes window[MOST_GUIDE_CHUNKS]; /* lane d: what is known of the right view's pixel x - d */
    for (int c = 0; c < chunks; c++) {
        window[c] = bytes_of(255);
    }
    for (ptrdiff_t x = 0; x < width; x++) {
        const uint8_t *total = room->total + (size_t)x * lanes;
        for (int c = chunks - 1; c >= 0; c--) {
            window[c] = bytes_min(bytes_from_below(window[c], c > 0 ? window[c - 1] : bytes_of(255)), bytes_load(total + c * BYTES));
            bytes_store(room->right_least + (width - 1 - x) + c * BYTES, window[c]);
        }
    }
    for (size_t x = 0; x < room->columns; x += 4) {
        bytes best[4];
#pragma GCC unroll 4
        for (size_t i = 0; i < 4; i++) {
            const uint8_t *total = room->total + (x + i) * lanes;
            best[i] = bytes_load(total);
            for (int c = 1; c < chunks; c++) {
                best[i] = bytes_min(best[i], bytes_load(total + c * BYTES));
            }
        }
        least_of_four(best, room->best_sum + x);
#pragma GCC unroll 4
        for (size_t i = 0; i < 4; i++) {
            const uint8_t *total = room->total + (x + i) * lanes;
            int d = 0;
            for (int c = chunks - 1; c >= 0; c--) {
                const int found = bytes_find(bytes_load(total + c * BYTES), bytes_of(room->best_sum[x + i]));
                d = found < BYTES ? c * BYTES + found : d;
            }
            room->best[x + i] = (uint16_t)d;
            room->low[x + i] = total[d - 1];
            room->high[x + i] = total[d + 1];
        }
    }
}

/* A row's sub-pixel steps, where the right view agrees within a pixel. */
static void write_row(const struct guide *job, const struct guide_room *room, int y)
{
    const int width = room->width, last = room->disparities - 1;
    const ptrdiff_t slanted = (ptrdiff_t)room->lanes + 1; /* one column and one disparity further: the same pixel of the right view */
    int16_t *steps = job->steps + (ptrdiff_t)y * width;
    for (int x = 0; x < width; x++) {
        const int d = room->best[x], there = x - d, sum = room->best_sum[x];
        const uint8_t *total = room->total + (size_t)x * room->lanes + d;
        steps[x] = NO_STEPS;
        if (there < 0 || sum == 255) {
            continue;
        }
        const int least = room->right_least[width - 1 - there];
        if (least == sum || (d < last && x + 1 < width && total[slanted] == least) || (d > 0 && total[-slanted] == least)) {
            const int is_inside = d > 0 && d < last;
            const int found = parabola_steps(d, is_inside ? room->low[x] : sum, sum, is_inside ? room->high[x] : sum);
            steps[x] = (int16_t)(found * job->factor <= (job->disparities - 1) * STEPS_PER_PX ? found : NO_STEPS);
        }
    }
}

BYTES_INLINE void guide_rows(const struct guide *job, const struct guide_room *memory, const int chunks)
{
    const struct guide_room copy = *memory, *room = &copy;
    const size_t row_bytes = (size_t)room->width * room->lanes;
    for (int is_up = 0; is_up < 2; is_up++) {
        for (int i = 0; i < 2 * SLANTS; i++) {
            memset(room->path[i & 1][i / 2], 0, room->row_bytes + 2 * room->lanes);
            memset(room->least[i & 1][i / 2], 0, room->columns + 2);
        }
        for (int n = 0; n < room->height; n += ROWS) {
            for (int k = 0; k < ROWS; k++) {
                const int inside = n + k < room->height ? n + k : room->height - 1;
                cost_row(room, k, is_up ? room->height - 1 - inside : inside, chunks);
            }
            if (!is_up) {
                along_rows(room, 0, chunks);
                along_rows(room, 1, chunks);
            }
            for (int k = 0; k < ROWS && n + k < room->height; k++) {
                const int turn = (n + k) & 1;
                if (is_up) {
                    const int y = room->height - 1 - n - k;
                    slanted_row(room, k, turn, room->volume + (size_t)y * row_bytes, room->total, chunks);
                    best_row(room, chunks);
                    write_row(job, memory, y);
                } else {
                    slanted_row(room, k, turn, room->sum[k], room->volume + (size_t)(n + k) * row_bytes, chunks);
                }
            }
        }
    }
}

#define GUIDE_ROWS(name, chunks)                                                                                             \
    static __attribute__((noinline)) void guide_rows_##name(const struct guide *job, const struct guide_room *room) \
    {                                                                                                                        \
        guide_rows(job, room, chunks);                                                                                       \
    }
#ifndef TANDEM_IS_SCALAR /* without registers of bytes a known number gains little, and takes long to compile */
enum { FEW = GUIDE_LANES / BYTES, MANY = 2 * FEW };
GUIDE_ROWS(few, FEW)
GUIDE_ROWS(many, MANY)
#endif
GUIDE_ROWS(n, room->chunks)

void ISA_NAME(guide)(const struct guide *job)
{
    struct guide_room room;
    laid_out(&room, job);
    for (int k = 0; k < ROWS; k++) { /* the columns beyond the image are computed, too */
        memset(room.cost[k], 0, room.row_bytes);
        memset(room.sum[k], 0, room.row_bytes);
    }
    memset(room.total - 64, 255, room.row_bytes + 128);
    memset(room.right_least, 255, room.columns + room.lanes);
    shrink(job, &room);
#ifndef TANDEM_IS_SCALAR
    (room.chunks == FEW ? guide_rows_few : room.chunks == MANY ? guide_rows_many : guide_rows_n)(job, &room);
#else
    guide_rows_n(job, &room);
#endif
}
