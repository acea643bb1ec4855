/* At a step between two surfaces, which one a pixel belongs to is voted on by its neighbours: those that look like it count most. A match
 * spreads the nearer surface over the edge of the farther one; the votes take it back, and close what is left open.
 *
 * Source: the two-surface case of a bilateral median (Yoon and Kweon, PAMI 28(4), 2006, for the weights).
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <string.h>

#include "kernels.h"
#include "match.h"

enum {
    REACH = 3,
    SIDE = 2 * REACH + 1,
    STEP = 24,           /* 1/16 px: a greater difference within the window is a step between surfaces */
    ALIKE = 40,          /* grey levels: neighbours that differ by more have no vote, by less (ALIKE - difference)^2 / 32 */
    DENSE = 24,          /* of 49 neighbours must be known for a missing value to be voted on */
    MAJORITY = 3         /* so many times the votes of the other surface are needed for a value that is missing */
};

enum {
    COLUMNS = 128,
    BLOCK = 16, /* pixels whose votes are counted at a time, if any of them needs it */
    PITCH = COLUMNS + 32,
    ROWS = BAND + 2 * REACH,
    ROOM = ROWS * PITCH,
    COMPLETE = BAND * PITCH
};

/* What some pixels see. A pixel of the image has the index of the first value of its window, which is REACH rows above it and REACH columns to
 * its left. Types are as small as they can be, and loops simple, for the compiler to work on many pixels at once. */
struct tile {
    int16_t value[ROOM], grey[ROOM];
    int16_t high[ROOM]; /* the greatest value that a pixel sees */
    uint16_t low[ROOM]; /* the least; as numbers without a sign, missing values are the greatest */
    uint8_t known[ROOM]; /* how many it sees */
    uint8_t changed[ROOM]; /* how many of them the round before changed: if none, nothing but what it decided can be decided */
};

enum { CENTRE = REACH * PITCH + REACH };

/* Beyond the image nothing is known. */
static void take_tile(const struct vote *job, int x, int y, struct tile *tile)
{
    const int first = x < REACH ? REACH - x : 0;
    const int rest = job->width - (x - REACH), end = rest < PITCH ? rest : PITCH;
    for (int i = 0; i < ROWS; i++) {
        const int line = y + i - REACH;
        const ptrdiff_t from = x - REACH;
        int16_t *restrict value = tile->value + i * PITCH, *restrict grey = tile->grey + i * PITCH;
        uint8_t *restrict known = tile->known + i * PITCH, *restrict changed = tile->changed + i * PITCH;
        if (line < 0 || line >= job->height || end - first < PITCH) {
            for (int j = 0; j < PITCH; j++) {
                value[j] = NO_STEPS;
                grey[j] = 0;
                known[j] = changed[j] = 0;
            }
        }
        if (line >= 0 && line < job->height) {
            const int16_t *restrict values = job->from + (ptrdiff_t)line * job->width + from;
            const uint8_t *restrict image = job->image + line * job->stride + from;
            const int16_t *restrict before = job->before + (ptrdiff_t)line * job->width + from;
            for (int j = first; j < end; j++) {
                value[j] = values[j];
                grey[j] = image[j];
                known[j] = values[j] >= 0;
                changed[j] = values[j] != before[j];
            }
        }
    }
}

/* One step of finding the extremes of windows: each place takes the place so far ahead, too. */
static inline __attribute__((always_inline)) void take_ahead(struct tile *tile, int count, const int ahead)
{
    int16_t *high = tile->high;
    uint16_t *low = tile->low;
    for (int i = 0; i < count; i++) {
        high[i] = high[i + ahead] > high[i] ? high[i + ahead] : high[i];
    }
    for (int i = 0; i < count; i++) {
        low[i] = low[i + ahead] < low[i] ? low[i + ahead] : low[i];
    }
}

/* Seven in a row or column are two, and two of these, and two of these that overlap. */
static void find_spread(struct tile *tile)
{
    for (int i = 0; i < ROOM; i++) {
        tile->high[i] = tile->value[i];
        tile->low[i] = (uint16_t)tile->value[i];
    }
    take_ahead(tile, (ROWS - 1) * PITCH, PITCH);
    take_ahead(tile, (ROWS - 3) * PITCH, 2 * PITCH);
    take_ahead(tile, COMPLETE, 3 * PITCH);
    take_ahead(tile, COMPLETE, 1); /* what comes from the next row stays beyond COLUMNS */
    take_ahead(tile, COMPLETE, 2);
    take_ahead(tile, COMPLETE, 3);
}

/* How many flags each pixel sees, in place of the flags. */
static void count_seen(uint8_t *flags)
{
    uint8_t column[COMPLETE + SIDE];
    memset(column + COMPLETE, 0, SIDE);
    for (int i = 0; i < COMPLETE; i++) {
        column[i] = (uint8_t)(flags[i] + flags[i + PITCH] + flags[i + 2 * PITCH] + flags[i + 3 * PITCH] + flags[i + 4 * PITCH] +
                              flags[i + 5 * PITCH] + flags[i + 6 * PITCH]);
    }
    for (int i = 0; i < COMPLETE; i++) {
        flags[i] = (uint8_t)(column[i] + column[i + 1] + column[i + 2] + column[i + 3] + column[i + 4] + column[i + 5] + column[i + 6]);
    }
}

/* Whether any pixel of the block that begins at a place needs votes. */
static int is_needed(const struct tile *tile, int at)
{
    const int16_t *restrict value = tile->value + at + CENTRE, *restrict high = tile->high + at;
    const uint16_t *restrict low = tile->low + at;
    const uint8_t *restrict known = tile->known + at, *restrict changed = tile->changed + at;
    int16_t needed = 0;
    for (int x = 0; x < BLOCK; x++) {
        const int16_t is_step = (int16_t)(high[x] - (int16_t)low[x]) > STEP;
        needed |= (int16_t)((is_step | ((value[x] < 0) & (known[x] >= DENSE))) & (changed[x] != 0));
    }
    return needed;
}

struct votes {
    int16_t middle[BLOCK]; /* between the two surfaces */
    int16_t near[BLOCK], all[BLOCK];
};

static void count_votes(const struct tile *tile, int at, struct votes *votes)
{
    const int16_t *restrict here = tile->grey + at + CENTRE, *restrict high = tile->high + at;
    const uint16_t *restrict low = tile->low + at;
    int16_t *restrict middle = votes->middle, *restrict nears = votes->near, *restrict alls = votes->all;
    for (int x = 0; x < BLOCK; x++) {
        middle[x] = (int16_t)((high[x] + (int16_t)low[x]) >> 1);
        nears[x] = alls[x] = 0;
    }
    for (int i = 0; i < SIDE; i++) {
        const int16_t *restrict value = tile->value + at + i * PITCH, *restrict grey = tile->grey + at + i * PITCH;
        for (int x = 0; x < BLOCK; x++) {
            const int16_t brightest = (int16_t)(here[x] + ALIKE), darkest = (int16_t)(here[x] - ALIKE);
            int16_t near = 0, all = 0;
#pragma GCC unroll 7
            for (int j = 0; j < SIDE; j++) {
                const int16_t above = (int16_t)(grey[x + j] - darkest), below = (int16_t)(brightest - grey[x + j]);
                const int16_t less = above < below ? above : below, alike = less > 0 ? less : 0;
                const int16_t vote = (int16_t)((int16_t)(alike * alike) >> 5);
                all = (int16_t)(all + (value[x + j] >= 0 ? vote : 0));
                near = (int16_t)(near + (value[x + j] > middle[x] ? vote : 0));
            }
            nears[x] = (int16_t)(nears[x] + near);
            alls[x] = (int16_t)(alls[x] + all);
        }
    }
}

/* The values of a row of a window, and one more. */
typedef int16_t row_words __attribute__((vector_size(16)));
typedef int32_t row_sums __attribute__((vector_size(32)));

static inline row_words row_load(const int16_t *from)
{
    row_words row;
    memcpy(&row, from, sizeof row);
    return row;
}

/* The mean of the values of one surface, weighted as they vote. */
static int value_of(const struct tile *tile, int at, int middle, int is_near)
{
    const row_words none = {0}, window = {-1, -1, -1, -1, -1, -1, -1, 0}, other_side = none - (int16_t)(1 - is_near);
    const int16_t here = tile->grey[at + CENTRE];
    row_sums sums = {0};
    row_words votes = {0};
    for (int i = 0; i < SIDE; i++) {
        const row_words value = row_load(tile->value + at + i * PITCH), grey = row_load(tile->grey + at + i * PITCH);
        const row_words above = grey - (int16_t)(here - ALIKE), below = (int16_t)(here + ALIKE) - grey;
        const row_words is_less = above < below, less = (above & is_less) | (below & ~is_less), alike = less & (less > 0);
        const row_words vote = ((alike * alike) >> 5) & (value >= 0) & ((value > (int16_t)middle) ^ other_side) & window;
        sums += __builtin_convertvector(vote, row_sums) * __builtin_convertvector(value, row_sums);
        votes += vote;
    }
    int32_t sum = 0, all = 0;
    for (int j = 0; j < SIDE; j++) {
        sum += sums[j];
        all += votes[j];
    }
    return all > 0 ? (sum + all / 2) / all : NO_STEPS;
}

/* Note which pixels of a block get the value of the surface that most of their votes are for: 1 the far one, 2 the near one. */
static void decide(const struct tile *tile, int at, const struct votes *votes, uint8_t *restrict voted)
{
    const int16_t *restrict value = tile->value + at + CENTRE, *restrict high = tile->high + at;
    const uint16_t *restrict low = tile->low + at;
    const uint8_t *restrict known = tile->known + at;
    for (int x = 0; x < BLOCK; x++) {
        const int16_t near = votes->near[x], far = (int16_t)(votes->all[x] - near);
        const int16_t more = near > far ? near : far, less = near > far ? far : near;
        const int16_t is_step = (int16_t)(high[x] - (int16_t)low[x]) > STEP, is_near = near > far, was_near = value[x] > votes->middle[x];
        const int16_t is_closed = (int16_t)((known[x] >= DENSE) & (!is_step | (more > (int16_t)(MAJORITY * less))));
        const int16_t is_moved = (int16_t)(is_step & (was_near != is_near) & (near != far));
        voted[x] = (uint8_t)((value[x] < 0 ? is_closed : is_moved) << is_near);
    }
}

/* Give the pixels of the block at (x, y) that were voted on their values. */
static void write_voted(const struct vote *job, const struct tile *tile, int at, int x, int y)
{
    struct votes votes;
    uint8_t voted[BLOCK];
    count_votes(tile, at, &votes);
    decide(tile, at, &votes, voted);
    const int count = job->width - x < BLOCK ? job->width - x : BLOCK;
    const ptrdiff_t row = (ptrdiff_t)y * job->width;
    for (int i = 0; i < count; i++) {
        if (voted[i]) {
            const int found = value_of(tile, at + i, votes.middle[i], voted[i] - 1);
            if (found >= 0 && found <= (x + i) * STEPS_PER_PX) {
                job->to[row + x + i] = (int16_t)found;
                job->margin[row + x + i] = 0; /* no cost was its own */
            }
        }
    }
}

static void vote_tile(const struct vote *job, int x, int from, int to, struct tile *tile)
{
    take_tile(job, x, from, tile);
    if (job->before == job->from) { /* the first round */
        memset(tile->changed, 1, sizeof tile->changed);
    } else {
        count_seen(tile->changed);
    }
    find_spread(tile);
    count_seen(tile->known);
    const int end = job->width - x < COLUMNS ? job->width - x : COLUMNS;
    for (int y = from; y < to; y++) {
        for (int i = 0; i < end; i += BLOCK) {
            const int at = (y - from) * PITCH + i;
            if (is_needed(tile, at)) {
                write_voted(job, tile, at, x + i, y);
            }
        }
    }
}

void ISA_NAME(vote_rows)(const struct vote *job, int from, int to)
{
    struct tile tile;
    const ptrdiff_t row = (ptrdiff_t)from * job->width;
    memcpy(job->to + row, job->from + row, (size_t)(to - from) * (size_t)job->width * sizeof *job->to);
    memset(&tile, 0, sizeof tile);
    for (int x = 0; x < job->width; x += COLUMNS) {
        vote_tile(job, x, from, to, &tile);
    }
}
