/* Semi-global matching (Hirschmueller, PAMI 30(2), 2008) in one sweep over rows, three paths: from the left, from the right, and along
 * the sweep. No cost volume: a few rows of costs stay in the second-level cache.
 *
 * Some rows are worked on together, in four passes: costs; both horizontal paths, several at once, because each step of a path waits
 * for the one before; the vertical path; the least sum. One register holds the costs of one pixel for many disparities.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include "byte_lanes.h"
#include "kernels.h"
#include "match.h"
#include "prefilter.h"

/* Plain C takes long to compile with everything unrolled, and so does what is sanitized. */
#if defined(__SANITIZE_ADDRESS__) || defined(TANDEM_IS_SCALAR)
#define FEW_VARIANTS
#endif

enum { MOST_CHUNKS = MOST_DISPARITIES / BYTES, MOST_ROWS = 4 };

/* Where the scratch memory's parts lie. */
struct room {
    int width, lanes, chunks, rows;
    size_t own_pitch, other_pitch;              /* from one plane to the next */
    size_t row_bytes;                           /* of a row of costs */
    uint8_t *own[MOST_ROWS];                    /* PLANES rows of `width` bytes each */
    uint8_t *other[MOST_ROWS];                  /* the same backwards, with `lanes` more */
    uint8_t *jump_along[MOST_ROWS];             /* P2 between a column and the one before it */
    uint8_t *jump_down[MOST_ROWS];              /* P2 between a pixel and the one in the row before */
    uint8_t *cost[MOST_ROWS], *sum[MOST_ROWS];  /* (width, lanes) */
    uint8_t *planes;                            /* PLANES rows and one more, while a row is prepared */
    uint8_t *down, *down_least;                 /* the vertical path: (width, lanes), (width,) */
    uint8_t *around;                            /* 255 at three places in the middle */
    uint8_t *total;                             /* four pixels' sums, each with 255 on both sides */
    size_t total_pitch;
    uint8_t *least, *low, *high, *next;         /* of a row: the least sum, those beside it, the next best */
    uint16_t *best;                             /* where the least is */
    int16_t *steps;
};

static size_t padded(size_t size) { return (size + 127) / 64 * 64; }

static size_t padded_columns(int width) { return ((size_t)width + 3) / 4 * 4; }

static uint8_t *taken(uint8_t **free_from, size_t size)
{
    uint8_t *part = *free_from;
    *free_from += padded(size);
    return part;
}

/* How many rows are worked on together: four are faster (two need one third of the cache). */
static int rows_together(size_t row_bytes)
{
#if defined(FEW_VARIANTS)
    (void)row_bytes;
    return 2;
#else
    return 9 * row_bytes <= 1536u * 1024u ? 4 : 2;
#endif
}

static size_t laid_out(struct room *room, int width, int disparities, uint8_t *scratch)
{
    uint8_t *at = scratch;
    room->width = width;
    room->chunks = (disparities + BYTES - 1) / BYTES;
    room->lanes = room->chunks * BYTES;
    room->row_bytes = padded_columns(width) * (size_t)room->lanes;
    room->rows = rows_together(room->row_bytes);
    const size_t columns = padded_columns(width); /* four at a time: the last ones may be none */
    room->own_pitch = padded(columns);
    room->other_pitch = padded(columns + (size_t)room->lanes + BYTES);
    for (int k = 0; k < room->rows; k++) {
        room->own[k] = taken(&at, PLANES * room->own_pitch);
        room->other[k] = taken(&at, PLANES * room->other_pitch);
        room->jump_along[k] = taken(&at, columns + 1);
        room->jump_down[k] = taken(&at, columns);
        room->cost[k] = taken(&at, room->row_bytes);
        room->sum[k] = taken(&at, room->row_bytes);
    }
    room->planes = taken(&at, (PLANES + 1) * padded(columns));
    room->down = taken(&at, room->row_bytes);
    room->down_least = taken(&at, columns);
    room->around = taken(&at, 2 * (size_t)room->lanes + BYTES);
    room->total_pitch = padded((size_t)room->lanes + 64);
    room->total = taken(&at, 4 * room->total_pitch + 64) + 64;
    room->least = taken(&at, columns);
    room->low = taken(&at, columns);
    room->high = taken(&at, columns);
    room->next = taken(&at, columns);
    room->best = (uint16_t *)(void *)taken(&at, 2 * columns);
    room->steps = (int16_t *)(void *)taken(&at, 2 * columns);
    return (size_t)(at - scratch);
}

size_t ISA_NAME(sweep_scratch)(int width, int disparities)
{
    static uint8_t nowhere[64];
    struct room room;
    return laid_out(&room, width, disparities, nowhere);
}

/* The image row that is worked on as the n-th. */
static int row_of(const struct sweep *job, int n) { return job->is_upward ? job->height - 1 - n : n; }

static void turn_row(const uint8_t *restrict from, int width, uint8_t *restrict to)
{
    for (int x = 0; x < width; x++) {
        to[x] = from[width - 1 - x];
    }
}

/* P2 by the difference of two grey levels. */
static void jump_row(const uint8_t *restrict one, const uint8_t *restrict another, int width, uint8_t *restrict jump)
{
    for (int x = 0; x < width; x++) {
        const int difference = one[x] < another[x] ? another[x] - one[x] : one[x] - another[x];
        const int cost = (int)((float)(JUMP_COST * JUMP_SLOPE) / (float)(difference + JUMP_SLOPE));
        jump[x] = (uint8_t)(cost < LEAST_JUMP_COST ? LEAST_JUMP_COST : cost);
    }
}

/* Fill the planes of the n-th row, and its jump costs. The right view is the left view of the mirrored pair. */
static void prepare_row(const struct sweep *job, const struct room *room, int k, int n)
{
    const int width = job->width, y = row_of(job, n), before = row_of(job, n > 0 ? n - 1 : n);
    const size_t own_pitch = room->own_pitch, other_pitch = room->other_pitch;
    uint8_t *turned = room->planes, *jump = room->planes + PLANES * own_pitch;
    const uint8_t *here = job->own + y * job->own_stride, *there = job->own + before * job->own_stride;
    if (job->is_right) {
        prefilter_row(job->own, job->own_stride, width, job->height, y, turned, own_pitch);
        prefilter_row(job->other, job->other_stride, width, job->height, y, room->other[k], other_pitch);
    } else {
        prefilter_row(job->own, job->own_stride, width, job->height, y, room->own[k], own_pitch);
        prefilter_row(job->other, job->other_stride, width, job->height, y, turned, own_pitch);
    }
    for (int plane = 0; plane < PLANES; plane++) {
        uint8_t *own = room->own[k] + (size_t)plane * own_pitch, *other = room->other[k] + (size_t)plane * other_pitch;
        turn_row(turned + (size_t)plane * own_pitch, width, job->is_right ? own : other);
        memset(other + width, other[width - 1], (size_t)room->lanes + BYTES);
    }
    if (job->is_right) {
        jump_row(here, there, width, jump);
        turn_row(jump, width, room->jump_down[k]);
        jump_row(here, here + 1, width - 1, jump);
        turn_row(jump, width - 1, room->jump_along[k] + 1);
    } else {
        jump_row(here, there, width, room->jump_down[k]);
        jump_row(here, here + 1, width - 1, room->jump_along[k] + 1);
    }
    room->jump_along[k][0] = room->jump_along[k][width] = JUMP_COST;
}

/* How far a value lies outside the other pixel's interval: one direction of Birchfield and Tomasi's measure. */
BYTES_INLINE bytes beyond(bytes value, const uint8_t *lows, const uint8_t *highs)
{
    return bytes_max(bytes_minus(value, bytes_load(highs)), bytes_minus(bytes_load(lows), value));
}

/* The costs of a row's pixels for all disparities; 255 beyond the last one. */
BYTES_INLINE void cost_row(int disparities, const struct room *room, int k, const int chunks)
{
    const size_t own_pitch = room->own_pitch, other_pitch = room->other_pitch;
    const int unused = room->lanes - disparities;
    const bytes cap = bytes_of(COST_CAP);
    for (int x = 0; x < room->width; x++) {
        const uint8_t *own = room->own[k] + x, *other = room->other[k] + (room->width - 1 - x);
        uint8_t *cost = room->cost[k] + (size_t)x * (size_t)room->lanes;
        bytes value[PLANES];
        for (int plane = 0; plane < PLANES; plane++) {
            value[plane] = bytes_of(own[(size_t)plane * own_pitch]);
        }
        for (int c = 0; c < chunks; c++) {
            const uint8_t *there = other + c * BYTES;
            const bytes grey = beyond(value[GREY], there + GREY_LOW * other_pitch, there + GREY_HIGH * other_pitch);
            const bytes slope_there = bytes_load(there + SLOPE * other_pitch);
            const bytes slope = bytes_min(
                beyond(value[SLOPE], there + SLOPE_LOW * other_pitch, there + SLOPE_HIGH * other_pitch),
                bytes_max(bytes_minus(slope_there, value[SLOPE_HIGH]), bytes_minus(value[SLOPE_LOW], slope_there)));
            const bytes order = bytes_ones(bytes_xor(value[ORDER], bytes_load(there + ORDER * other_pitch)));
            bytes_store(cost + c * BYTES, bytes_min(bytes_plus(bytes_plus(grey, slope), order), cap));
        }
        if (unused > 0) {
            memset(cost + disparities, 255, (size_t)unused);
        }
    }
}

/* One step of a path but for the least of its costs, which the next step needs: `path` holds the costs at the pixel before, whose
 * least is `least`, and gets those at this pixel. Returns the chunks' minimum. */
BYTES_INLINE bytes path_step(const uint8_t *cost, bytes *path, bytes least, bytes jump, const int chunks)
{
    const bytes none = bytes_of(255), step = bytes_of(STEP_COST), jumped = bytes_plus(least, jump);
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

/* A horizontal path on its way through a row. */
struct along {
    const uint8_t *cost, *jump;
    uint8_t *sum;
    bytes path[MOST_CHUNKS], least;
};

/* One step of four paths; the costs are stored in the sum, or added to those of the other direction. */
BYTES_INLINE void four_steps(struct along *four, ptrdiff_t forth, ptrdiff_t back, size_t lanes, const int is_second,
                             const int chunks)
{
    bytes best[4];
#pragma GCC unroll 4
    for (int i = 0; i < 4; i++) {
        struct along *one = &four[i];
        const ptrdiff_t x = i < 2 ? forth : back;
        const ptrdiff_t at = x * (ptrdiff_t)lanes;
        best[i] = path_step(one->cost + at, one->path, one->least, bytes_of(one->jump[x]), chunks);
        for (int c = 0; c < chunks; c++) {
            uint8_t *sum = one->sum + at + c * BYTES;
            bytes_store(sum, is_second ? bytes_plus(bytes_load(sum), one->path[c]) : one->path[c]);
        }
    }
    const quad least = quad_least(best[0], best[1], best[2], best[3]);
    four[0].least = quad_bytes(least, 0);
    four[1].least = quad_bytes(least, 1);
    four[2].least = quad_bytes(least, 2);
    four[3].least = quad_bytes(least, 3);
}

/* The paths from the left and from the right through some rows at once: each step of a path waits for the one before, so several are
 * under way. Until they meet they write the sums, then they add to what the other one wrote. */
BYTES_INLINE void along_rows(const struct room *room, const int rows, const int chunks)
{
    const size_t lanes = (size_t)room->lanes;
    const ptrdiff_t last = room->width - 1, half = room->width / 2;
    struct along paths[2][4];
#pragma GCC unroll 2
    for (int group = 0; group < rows / 2; group++) {
#pragma GCC unroll 4
        for (int i = 0; i < 4; i++) {
            struct along *one = &paths[group][i];
            const int k = 2 * group + (i & 1);
            one->cost = room->cost[k];
            one->sum = room->sum[k];
            one->jump = room->jump_along[k] + (i < 2 ? 0 : 1); /* the way back pays for the same edge */
            one->least = bytes_of(0);
            for (int c = 0; c < chunks; c++) {
                one->path[c] = bytes_of(0);
            }
        }
    }
    for (ptrdiff_t x = 0; x < half; x++) {
#pragma GCC unroll 2
        for (int group = 0; group < rows / 2; group++) {
            four_steps(paths[group], x, last - x, lanes, 0, chunks);
        }
    }
    if (room->width & 1) { /* both are at the middle: clear it, so that both add */
        for (int k = 0; k < rows; k++) {
            memset(room->sum[k] + (size_t)half * lanes, 0, lanes);
        }
    }
    for (ptrdiff_t x = half; x <= last; x++) {
#pragma GCC unroll 2
        for (int group = 0; group < rows / 2; group++) {
            four_steps(paths[group], x, last - x, lanes, 1, chunks);
        }
    }
}

/* The vertical path through a row: columns do not wait for each other. */
BYTES_INLINE void down_row(const struct room *room, int k, const int chunks)
{
    const size_t lanes = (size_t)room->lanes;
    const uint8_t *cost = room->cost[k], *jump = room->jump_down[k];
    uint8_t *down = room->down, *least = room->down_least;
    for (size_t x = 0; x < padded_columns(room->width); x += 4) {
        bytes best[4];
#pragma GCC unroll 4
        for (size_t i = 0; i < 4; i++) {
            const size_t at = (x + i) * lanes;
            bytes path[MOST_CHUNKS];
            for (int c = 0; c < chunks; c++) {
                path[c] = bytes_load(down + at + c * BYTES);
            }
            best[i] = path_step(cost + at, path, bytes_of(least[x + i]), bytes_of(jump[x + i]), chunks);
            for (int c = 0; c < chunks; c++) {
                bytes_store(down + at + c * BYTES, path[c]);
            }
        }
        const uint32_t packed = quad_packed(quad_least(best[0], best[1], best[2], best[3]));
        memcpy(least + x, &packed, 4);
    }
}

/* The best disparities of a row: the least sum of all paths, its neighbours, and the next best beyond them. */
BYTES_INLINE void best_row(const struct room *room, int k, int disparities, const int wants_next, const int chunks)
{
    const size_t lanes = (size_t)room->lanes;
    const uint8_t *sums = room->sum[k], *down = room->down;
    uint8_t *total = room->total;
    uint16_t *best_at = room->best;
    for (size_t x = 0; x < padded_columns(room->width); x += 4) {
        bytes best[4] = {bytes_of(255), bytes_of(255), bytes_of(255), bytes_of(255)};
#pragma GCC unroll 4
        for (size_t i = 0; i < 4; i++) {
            const size_t at = (x + i) * lanes;
            for (int c = 0; c < chunks; c++) {
                const bytes sum = bytes_plus(bytes_load(sums + at + c * BYTES), bytes_load(down + at + c * BYTES));
                bytes_store(total + i * room->total_pitch + c * BYTES, sum);
                best[i] = c == 0 ? sum : bytes_min(best[i], sum);
            }
        }
        const quad least = quad_least(best[0], best[1], best[2], best[3]);
        const uint32_t packed = quad_packed(least);
        memcpy(room->least + x, &packed, 4);
        const bytes value[4] = {quad_bytes(least, 0), quad_bytes(least, 1), quad_bytes(least, 2), quad_bytes(least, 3)};
#pragma GCC unroll 4
        for (size_t i = 0; i < 4; i++) {
            const uint8_t *sum = total + i * room->total_pitch;
            int d = disparities;
            for (int c = chunks - 1; c >= 0; c--) {
                const int found = bytes_find(bytes_load(sum + c * BYTES), value[i]);
                d = found < BYTES ? c * BYTES + found : d;
            }
            best_at[x + i] = (uint16_t)d;
            room->low[x + i] = sum[d - 1];
            room->high[x + i] = sum[d + 1];
            if (wants_next) {
                const uint8_t *around = room->around + lanes - d;
                for (int c = 0; c < chunks; c++) {
                    const bytes other = bytes_max(bytes_load(sum + c * BYTES), bytes_load(around + c * BYTES));
                    best[i] = c == 0 ? other : bytes_min(best[i], other);
                }
            }
        }
        if (wants_next) {
            const uint32_t next = quad_packed(quad_least(best[0], best[1], best[2], best[3]));
            memcpy(room->next + x, &next, 4);
        }
    }
}

/* Sub-pixel steps of a row by a parabola through the sums beside the least. */
static void write_row(const struct sweep *job, const struct room *room, int n)
{
    const int width = room->width, y = row_of(job, n), last = job->disparities - 1;
    int16_t *restrict steps = room->steps;
    const uint8_t *restrict low = room->low, *restrict high = room->high;
    const uint8_t *restrict least = room->least, *restrict next = room->next;
    const uint16_t *restrict best = room->best;
    for (int x = 0; x < width; x++) {
        const int is_inside = best[x] > 0 && best[x] < last;
        const int a = is_inside ? low[x] - least[x] : 0, b = is_inside ? high[x] - least[x] : 0, bend = a + b;
        const float over = (float)((a - b) * STEPS_PER_PX + bend), under = (float)(bend > 0 ? 2 * bend : 1);
        steps[x] = (int16_t)(best[x] * STEPS_PER_PX + (int)(over / under));
    }
    int16_t *restrict to = job->steps + (ptrdiff_t)y * width;
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

/* Work on `rows` rows together, of which the first is the n-th and some may lie beyond the end. */
BYTES_INLINE void sweep_rows(const struct sweep *job, const struct room *memory, int n, const int rows, const int chunks)
{
    const struct room copy = *memory, *room = &copy; /* so that the compiler knows that no store changes it */
    for (int k = 0; k < rows; k++) {
        prepare_row(job, memory, k, n + k < job->end ? n + k : job->end - 1);
        cost_row(job->disparities, room, k, chunks);
    }
    if (n + rows > job->begin) { /* else the vertical path only warms up */
        along_rows(room, rows, chunks);
    }
    for (int k = 0; k < rows && n + k < job->end; k++) {
        down_row(room, k, chunks);
        if (n + k >= job->begin) {
            if (job->is_right) {
                best_row(room, k, job->disparities, 0, chunks);
            } else {
                best_row(room, k, job->disparities, 1, chunks);
            }
            write_row(job, memory, n + k);
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

void ISA_NAME(sweep)(const struct sweep *job)
{
    struct room room;
    laid_out(&room, job->width, job->disparities, job->scratch);
    memset(room.down, 0, room.row_bytes);
    memset(room.down_least, 0, (size_t)room.width);
    memset(room.around, 0, 2 * (size_t)room.lanes + BYTES);
    memset(room.around + room.lanes - 1, 255, 3);
    memset(room.total - 64, 255, 4 * room.total_pitch + 64);
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
