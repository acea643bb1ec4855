/* Semi-global matching (Hirschmueller, PAMI 30(2), 2008) in one sweep over rows, three paths: from the left, from the right, and along
 * the sweep. No cost volume: a few rows of costs stay in the second-level cache.
 *
 * Some rows are worked on together, because each step of a path along the row waits for the one before: so several are under way. Both
 * horizontal paths start at the ends. Up to the middle they work on fresh costs and leave theirs behind; beyond it each adds to what
 * the other one left, and the vertical path and the least sum follow tile by tile, while the sums are in a near cache.
 *
 * One register holds the costs of one pixel for many disparities. Where it takes several registers (chunks), disparity d is lane
 * d / chunks of chunk d % chunks: so the neighbours d - 1 and d + 1 are the same lane of another chunk.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include "byte_lanes.h"
#include "costs.h"
#include "kernels.h"
#include "layout.h"
#include "parabola.h"
#include "prefilter.h"
#include "sweep_room.h"

size_t ISA_NAME(sweep_scratch)(int width, int disparities)
{
    static uint8_t nowhere[64];
    struct room room;
    return laid_out(&room, width, disparities, nowhere);
}

/* The image row that is worked on as the n-th. */
static int row_of(const struct sweep *job, int n) { return job->row_step * (job->is_upward ? job->rows - 1 - n : n); }

static void turn_row(const uint8_t *restrict from, int width, uint8_t *restrict to)
{
    for (int x = 0; x < width; x++) {
        to[x] = from[width - 1 - x];
    }
}

static inline __attribute__((always_inline)) void every(size_t step, const uint8_t *restrict from, size_t count,
                                                        uint8_t *restrict to)
{
    for (size_t i = 0; i < count; i++) {
        to[i] = from[i * step];
    }
}

/* Every `step`-th byte; the compiler can do the usual steps with registers. */
static void every_byte(size_t step, const uint8_t *from, size_t count, uint8_t *to)
{
    switch (step) {
    case 2:
        every(2, from, count, to);
        break;
    case 4:
        every(4, from, count, to);
        break;
    case 8:
        every(8, from, count, to);
        break;
    default:
        every(step, from, count, to);
        break;
    }
}

/* Fill the planes of the other image's row, each in `chunks` parts; its last pixel is repeated beyond its end. */
static void prepare_other(const struct room *room, uint8_t *const rows[5], int is_turned, uint8_t *other)
{
    const size_t chunks = (size_t)room->chunks, lanes = (size_t)room->lanes, width = (size_t)room->width;
    const int is_whole = chunks == 1;
    uint8_t *planes = is_whole ? other : room->planes;
    const size_t pitch = is_whole ? room->other_pitch : room->row_pitch;
    prefilter_row(rows, room->width, is_turned, planes, pitch);
    for (size_t plane = 0; plane < PLANES; plane++) {
        uint8_t *whole = planes + plane * pitch;
        memset(whole + width, whole[width - 1], lanes + chunks);
        for (size_t part = 0; !is_whole && part < chunks; part++) {
            every_byte(chunks, whole + part, (width + lanes) / chunks + 1, other + plane * room->other_pitch + part * room->part_pitch);
        }
    }
}

/* Fill the planes of the n-th row, and its jump costs. The right view is the left view of the mirrored pair, so the right image is
 * turned in both. */
static void prepare_row(const struct sweep *job, const struct room *room, int k, int n)
{
    const int width = job->width, y = row_of(job, n), before = row_of(job, n > 0 ? n - 1 : n);
    for (int i = 0; i < 5; i++) {
        const int line = inside_of(y + i - 2, job->height - 1);
        const uint8_t *own = job->own + line * job->own_stride, *other = job->other + line * job->other_stride;
        memcpy(room->straight[i], job->is_right ? other : own, (size_t)width);
        turn_row(job->is_right ? own : other, width, room->turned[i]);
        widen(room->straight[i], width, 2);
        widen(room->turned[i], width, 2);
    }
    uint8_t *const *own = job->is_right ? room->turned : room->straight;
    prefilter_row(own, width, job->is_right, room->own[k], room->row_pitch);
    prepare_other(room, job->is_right ? room->straight : room->turned, !job->is_right, room->other[k]);
    jump_row(own[2], own[2 + (before - y) / job->row_step], width, room->jump_down[k]);
    jump_row(own[2] - 1, own[2], width + 1, room->jump_along[k]);
}

/* The costs of some of a row's pixels for all disparities. */
BYTES_INLINE void cost_columns(const struct room *room, int k, int from, int to, const int chunks)
{
    const size_t row_pitch = room->row_pitch, other_pitch = room->other_pitch;
    const bytes cap = bytes_of(COST_CAP);
    const int has_unused = room->disparities < room->lanes;
    const int end = to < room->width ? to : room->width;
    for (int x = from; x < end; x++) {
        const uint8_t *own = room->own[k] + x;
        uint8_t *cost = room->cost[k] + (size_t)x * (size_t)room->lanes;
        unsigned at = (unsigned)(room->width - 1 - x) / (unsigned)chunks, part = (unsigned)(room->width - 1 - x) % (unsigned)chunks;
        bytes value[PLANES];
        for (int plane = 0; plane < PLANES; plane++) {
            value[plane] = bytes_of(own[(size_t)plane * row_pitch]);
        }
        for (int c = 0; c < chunks; c++) {
            const uint8_t *there = room->other[k] + part * room->part_pitch + at;
            const bytes order = bytes_ones(bytes_xor(value[ORDER], bytes_load(there + ORDER * other_pitch)));
            const bytes all = bytes_min(bytes_add(grey_and_slope(value, there, other_pitch), order), cap);
            bytes_store(cost + c * BYTES, has_unused ? bytes_max(all, bytes_load(room->unused + c * BYTES)) : all);
            part = part + 1 < (unsigned)chunks ? part + 1 : 0;
            at += part == 0;
        }
    }
}

/* One step of a path but for the least of its costs, which the next step needs: `path` holds the costs at the pixel before, whose
 * least is `least`, and gets those at this pixel; `jump` is P2 - P1. Returns the chunks' minimum. */
BYTES_INLINE bytes path_step(const uint8_t *cost, bytes *path, bytes least, bytes jump, const int chunks)
{
    const bytes none = bytes_of(255), step = bytes_of(STEP_COST);
    bytes before[MOST_CHUNKS], best = none;
    for (int c = 0; c < chunks; c++) {
        before[c] = bytes_sub(path[c], least);
    }
    for (int c = 0; c < chunks; c++) {
        const bytes below = c > 0 ? before[c - 1] : bytes_from_below(before[chunks - 1], none);
        const bytes above = c + 1 < chunks ? before[c + 1] : bytes_from_above(before[0], none);
        const bytes changed = bytes_add(bytes_min(bytes_min(below, above), jump), step);
        path[c] = bytes_add(bytes_min(before[c], changed), bytes_load(cost + c * BYTES));
        best = c == 0 ? path[0] : bytes_min(best, path[c]);
    }
    return best;
}

/* A horizontal path on its way through a row. */
struct along {
    const uint8_t *cost, *jump;
    uint8_t *sum;
    bytes path[MOST_CHUNKS];
};

/* One step of four paths, whose least costs are in `least`; the costs are stored in the sum, or added to those of the other
 * direction. */
BYTES_INLINE void four_steps(struct along *four, uint8_t *least, ptrdiff_t forth, ptrdiff_t back, size_t lanes,
                             const int is_second, const int chunks)
{
    bytes best[4];
#pragma GCC unroll 4
    for (int i = 0; i < 4; i++) {
        struct along *one = &four[i];
        const ptrdiff_t x = i < 2 ? forth : back;
        const ptrdiff_t at = x * (ptrdiff_t)lanes;
        best[i] = path_step(one->cost + at, one->path, bytes_of(least[i]), bytes_of(one->jump[x]), chunks);
        for (int c = 0; c < chunks; c++) {
            uint8_t *sum = one->sum + at + c * BYTES;
            bytes_store(sum, is_second ? bytes_plus(bytes_load(sum), one->path[c]) : one->path[c]);
        }
    }
    least_of_four(best, least);
}

/* `count` steps of all paths along the rows. */
BYTES_INLINE void along_columns(const struct room *room, struct along paths[2][4], ptrdiff_t from, ptrdiff_t count,
                                const int is_second, const int rows, const int chunks)
{
    const ptrdiff_t last = room->columns - 1;
    for (ptrdiff_t x = from; x < from + count; x++) {
#pragma GCC unroll 2
        for (int group = 0; group < rows / 2; group++) {
            four_steps(paths[group], room->along_least + 4 * group, x, last - x, (size_t)room->lanes, is_second, chunks);
        }
    }
}

/* The paths from the left and from the right through some rows, before their first steps. */
BYTES_INLINE void start_along(const struct room *room, struct along paths[2][4], const int rows, const int chunks)
{
#pragma GCC unroll 8
    for (int i = 0; i < 2 * rows; i++) {
        struct along *one = &paths[i / 4][i % 4];
        const int k = i / 4 * 2 + i % 2, is_back = i % 4 / 2;
        one->cost = room->cost[k];
        one->sum = room->sum[k];
        one->jump = room->jump_along[k] + is_back; /* the way back pays for the same edge */
        room->along_least[i] = 0;
        for (int c = 0; c < chunks; c++) {
            one->path[c] = bytes_of(0);
        }
    }
}

/* The vertical path at some of a row's columns, which do not wait for each other, and the sums of all paths. */
BYTES_INLINE void down_columns(const struct room *room, int k, int from, int to, const int chunks)
{
    const size_t lanes = (size_t)room->lanes;
    const uint8_t *jump = room->jump_down[k];
    uint8_t *total = room->total;
    for (int x = from; x < to; x += GROUP) {
        bytes best[GROUP], best_total[GROUP] = {bytes_of(255), bytes_of(255), bytes_of(255), bytes_of(255)};
#pragma GCC unroll 4
        for (int i = 0; i < GROUP; i++) {
            const size_t at = (size_t)(x + i) * lanes;
            uint8_t *down = room->down + at;
            bytes path[MOST_CHUNKS];
            for (int c = 0; c < chunks; c++) {
                path[c] = bytes_load(down + c * BYTES);
            }
            best[i] = path_step(room->cost[k] + at, path, bytes_of(room->down_least[x + i]), bytes_of(jump[x + i]), chunks);
            for (int c = 0; c < chunks; c++) {
                const bytes sum = bytes_plus(bytes_load(room->sum[k] + at + c * BYTES), path[c]);
                bytes_store(down + c * BYTES, path[c]);
                bytes_store(total + c * BYTES, sum);
                best_total[i] = c == 0 ? sum : bytes_min(best_total[i], sum);
            }
            total += room->total_pitch;
        }
        least_of_four(best, room->down_least + x);
        least_of_four(best_total, room->least[k] + x);
    }
}

/* The best disparities of some of a row's pixels by the sums of all paths: the first least sum, and its neighbours. They are struck
 * out if the next best is wanted. */
BYTES_INLINE void find_columns(const struct room *room, int k, int from, int to, int is_struck, const int chunks)
{
    uint8_t *total = room->total;
    for (int x = from; x < to; x++) {
        const bytes value = bytes_of(room->least[k][x]);
        int d = 0;
        for (int c = 0; c < chunks; c++) {
            const int found = bytes_find(bytes_load(total + c * BYTES), value) * chunks + c;
            d = c == 0 || found < d ? found : d;
        }
        const uint16_t *place = room->place + d; /* of d - 1, d and d + 1 */
        room->best[k][x] = (uint16_t)d;
        room->low[k][x] = total[place[0]];
        room->high[k][x] = total[place[2]];
        if (is_struck) {
            total[place[0]] = total[place[1]] = total[place[2]] = 255;
        }
        total += room->total_pitch;
    }
}

/* The least sums that are left. */
BYTES_INLINE void next_columns(const struct room *room, int k, int from, int to, const int chunks)
{
    const uint8_t *total = room->total;
    for (int x = from; x < to; x += GROUP) {
        bytes best[GROUP] = {bytes_of(255), bytes_of(255), bytes_of(255), bytes_of(255)};
#pragma GCC unroll 4
        for (int i = 0; i < GROUP; i++) {
            for (int c = 0; c < chunks; c++) {
                const bytes sum = bytes_load(total + c * BYTES);
                best[i] = c == 0 ? sum : bytes_min(best[i], sum);
            }
            total += room->total_pitch;
        }
        least_of_four(best, room->next[k] + x);
    }
}

/* Sub-pixel steps of a row by a parabola through the sums beside the least. */
static void write_row(const struct sweep *job, const struct room *room, int k, int n)
{
    const int width = room->width, y = row_of(job, n), last = job->disparities - 1;
    int16_t *restrict steps = room->steps;
    const uint8_t *restrict low = room->low[k], *restrict high = room->high[k];
    const uint8_t *restrict least = room->least[k], *restrict next = room->next[k];
    const uint16_t *restrict best = room->best[k];
    for (int x = 0; x < width; x++) {
        const int is_inside = best[x] > 0 && best[x] < last, sum = least[x];
        steps[x] = parabola_steps(best[x], is_inside ? low[x] : sum, sum, is_inside ? high[x] : sum);
    }
    int16_t *restrict to = job->steps + (ptrdiff_t)(y / job->row_step) * width;
    if (job->is_right) {
        for (int x = 0; x < width; x++) {
            to[x] = steps[width - 1 - x];
        }
    } else {
        uint8_t *restrict margin = job->margin + (ptrdiff_t)y * width;
        memcpy(to, steps, (size_t)width * sizeof *to);
        for (int x = 0; x < width; x++) {
            margin[x] = (uint8_t)(next[x] - least[x]);
        }
    }
}

/* What follows at columns that both horizontal paths have passed. Rows before the first that is written only warm up. */
BYTES_INLINE void finish_columns(const struct sweep *job, const struct room *room, int n, int from, int to, const int rows,
                                 const int chunks)
{
    for (int k = 0; k < rows && n + k < job->end; k++) {
        down_columns(room, k, from, to, chunks);
        if (n + k >= job->begin) {
            find_columns(room, k, from, to, !job->is_right, chunks);
            if (!job->is_right) {
                next_columns(room, k, from, to, chunks);
            }
        }
    }
}

/* Work on `rows` rows together, of which the first is the n-th and some may lie beyond the end. */
BYTES_INLINE void sweep_rows(const struct sweep *job, const struct room *memory, int n, const int rows, const int chunks)
{
    const struct room copy = *memory, *room = &copy; /* so that the compiler knows that no store changes it */
    const int columns = room->columns, half = columns / 2, is_written = n + rows > job->begin;
    struct along paths[2][4];
    start_along(room, paths, rows, chunks);
    for (int k = 0; k < rows; k++) {
        prepare_row(job, memory, k, n + k < job->end ? n + k : job->end - 1);
    }
    for (int from = 0; from < half; from += TILE) {
        const int to = from + TILE < half ? from + TILE : half;
        for (int k = 0; k < rows; k++) {
            cost_columns(room, k, from, to, chunks);
            cost_columns(room, k, columns - to, columns - from, chunks);
        }
        if (is_written) {
            along_columns(room, paths, from, to - from, 0, rows, chunks);
        }
    }
    for (int from = half; from < columns; from += TILE) {
        const int to = from + TILE < columns ? from + TILE : columns;
        if (is_written) {
            along_columns(room, paths, from, to - from, 1, rows, chunks);
        }
        finish_columns(job, room, n, from, to, rows, chunks);
        finish_columns(job, room, n, columns - to, columns - from, rows, chunks);
    }
    for (int k = 0; k < rows && n + k < job->end; k++) {
        if (n + k >= job->begin) {
            write_row(job, memory, k, n + k);
        }
    }
}

#define SWEEP(rows, name, chunks)                                                                                         \
    static __attribute__((noinline)) void sweep_##rows##_##name(const struct sweep *job, const struct room *room, int n) \
    {                                                                                                                     \
        sweep_rows(job, room, n, rows, chunks);                                                                           \
    }
SWEEP(2, n, room->chunks)
#if !defined(FEW_VARIANTS)
enum { FEW = BYTES >= 64 ? 1 : 64 / BYTES, MANY = 2 * FEW }; /* 64 and 128 disparities */
SWEEP(4, few, FEW)
SWEEP(4, many, MANY)
SWEEP(4, n, room->chunks)
#endif

/* Fill what stays the same in all rows. */
static void set_up(const struct room *room)
{
    const size_t lanes = (size_t)room->lanes, chunks = (size_t)room->chunks;
    for (size_t d = 0; d < lanes; d++) {
        const size_t place = d % chunks * BYTES + d / chunks;
        room->place[d + 1] = (uint16_t)place;
        room->unused[place] = d < (size_t)room->disparities ? 0 : UNUSED_COST;
    }
    room->place[0] = room->place[lanes + 1] = (uint16_t)lanes; /* beside the sums */
    memset(room->total, 255, TILE * room->total_pitch);
    memset(room->down, 0, (size_t)room->columns * lanes);
    memset(room->down_least, 0, (size_t)room->columns);
    for (int k = 0; k < room->rows; k++) {
        memset(room->cost[k] + (size_t)room->width * lanes, 0, (size_t)(room->columns - room->width) * lanes);
        memset(room->sum[k], 0, (size_t)room->columns * lanes); /* read, though not used, while rows only warm up */
    }
}

void ISA_NAME(sweep)(const struct sweep *job)
{
    struct room room;
    laid_out(&room, job->width, job->disparities, job->scratch);
    set_up(&room);
    for (int n = job->first; n < job->end; n += room.rows) {
#if !defined(FEW_VARIANTS)
        if (room.rows == 4) {
            (room.chunks == FEW ? sweep_4_few : room.chunks == MANY ? sweep_4_many : sweep_4_n)(job, &room, n);
            continue;
        }
#endif
        sweep_2_n(job, &room, n);
    }
}
