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
    BLOCK = 32,          /* pixels at a time */
    WIDE = BLOCK + 2 * REACH,
    STEP = 24,           /* 1/16 px: a greater difference within the window is a step between surfaces */
    ALIKE = 40,          /* grey levels: neighbours that differ by more have no vote, by less (ALIKE - difference)^2 / 32 */
    DENSE = 24,          /* of 49 neighbours must be known for a missing value to be voted on */
    MAJORITY = 3         /* so many times the votes of the other surface are needed for a value that is missing */
};

struct window {
    int16_t value[SIDE][WIDE];
    uint8_t grey[SIDE][WIDE];
    int16_t high[BLOCK], low[BLOCK], known[BLOCK];
    uint16_t near[BLOCK], all[BLOCK];
};

/* What the pixels of a block see; beyond the image nothing is known. */
static void take_window(const struct vote *job, int x, int y, struct window *window)
{
    const int first = x - REACH < 0 ? REACH - x : 0;
    const int end = job->width - (x - REACH) < WIDE ? job->width - (x - REACH) : WIDE;
    for (int i = 0; i < SIDE; i++) {
        const int line = y + i - REACH;
        int16_t *value = window->value[i];
        if (line < 0 || line >= job->height) {
            for (int j = 0; j < WIDE; j++) {
                value[j] = NO_STEPS;
            }
            continue;
        }
        const ptrdiff_t from = x - REACH + first;
        if (end - first < WIDE) {
            for (int j = 0; j < WIDE; j++) {
                value[j] = NO_STEPS;
            }
        }
        memcpy(value + first, job->from + (ptrdiff_t)line * job->width + from, (size_t)(end - first) * sizeof *value);
        memcpy(window->grey[i] + first, job->image + line * job->stride + from, (size_t)(end - first));
    }
}

/* The greatest and the least value that a pixel sees, and how many. Returns whether any of them needs a vote. */
static int find_spread(struct window *window)
{
    int16_t high[WIDE], known[WIDE];
    uint16_t low[WIDE]; /* as numbers without a sign, missing values are the greatest */
    for (int j = 0; j < WIDE; j++) {
        high[j] = window->value[0][j];
        low[j] = (uint16_t)window->value[0][j];
        known[j] = window->value[0][j] >= 0;
    }
    for (int i = 1; i < SIDE; i++) {
        for (int j = 0; j < WIDE; j++) {
            const int16_t value = window->value[i][j];
            const uint16_t plain = (uint16_t)value;
            high[j] = value > high[j] ? value : high[j];
            low[j] = plain < low[j] ? plain : low[j];
            known[j] = (int16_t)(known[j] + (value >= 0));
        }
    }
    int16_t needed = 0;
    for (int x = 0; x < BLOCK; x++) {
        int16_t most = high[x], count = known[x];
        uint16_t least = low[x];
        for (int j = 1; j < SIDE; j++) {
            most = high[x + j] > most ? high[x + j] : most;
            least = low[x + j] < least ? low[x + j] : least;
            count = (int16_t)(count + known[x + j]);
        }
        window->high[x] = most;
        window->low[x] = (int16_t)least;
        window->known[x] = count;
        const int16_t is_missing = window->value[REACH][x + REACH] < 0, is_step = (int16_t)(most - (int16_t)least) > STEP;
        needed |= (int16_t)((is_missing & (count >= DENSE)) | ((count > 1) & is_step));
    }
    return needed;
}

static void count_votes(struct window *window)
{
    int16_t middle[BLOCK];
    for (int x = 0; x < BLOCK; x++) {
        middle[x] = (int16_t)((window->high[x] + window->low[x]) >> 1);
        window->near[x] = window->all[x] = 0;
    }
    const uint8_t *restrict here = window->grey[REACH] + REACH;
    uint16_t *restrict near = window->near, *restrict all = window->all;
    for (int i = 0; i < SIDE; i++) {
        for (int j = 0; j < SIDE; j++) {
            const int16_t *restrict value = window->value[i] + j;
            const uint8_t *restrict grey = window->grey[i] + j;
            for (int x = 0; x < BLOCK; x++) {
                const int16_t apart = (int16_t)(grey[x] > here[x] ? grey[x] - here[x] : here[x] - grey[x]);
                const int16_t alike = (int16_t)(apart < ALIKE ? ALIKE - apart : 0);
                const uint16_t vote = (uint16_t)(value[x] >= 0 ? (uint16_t)(alike * alike) >> 5 : 0);
                all[x] = (uint16_t)(all[x] + vote);
                near[x] = (uint16_t)(near[x] + (value[x] > middle[x] ? vote : 0));
            }
        }
    }
}

/* The mean of the values of one surface, weighted as they vote. */
static int value_of(const struct window *window, int x, int is_near)
{
    const int middle = (window->high[x] + window->low[x]) >> 1, here = window->grey[REACH][x + REACH];
    int32_t sum = 0, votes = 0;
    for (int i = 0; i < SIDE; i++) {
        for (int j = 0; j < SIDE; j++) {
            const int value = window->value[i][x + j], grey = window->grey[i][x + j];
            const int apart = grey > here ? grey - here : here - grey, alike = apart < ALIKE ? ALIKE - apart : 0;
            const int vote = value >= 0 && (value > middle) == is_near ? (alike * alike) >> 5 : 0;
            sum += vote * value;
            votes += vote;
        }
    }
    return votes > 0 ? (sum + votes / 2) / votes : NO_STEPS;
}

static void decide(const struct vote *job, const struct window *window, int x, int y, int count)
{
    int16_t *to = job->to + (ptrdiff_t)y * job->width + x;
    uint8_t *margin = job->margin + (ptrdiff_t)y * job->width + x;
    for (int i = 0; i < count; i++) {
        const int value = window->value[REACH][i + REACH], near = window->near[i], far = window->all[i] - near;
        const int is_step = window->high[i] - window->low[i] > STEP, is_near = near > far;
        const int middle = (window->high[i] + window->low[i]) >> 1;
        int is_voted;
        if (value < 0) {
            const int more = is_near ? near : far, less = is_near ? far : near;
            is_voted = window->known[i] >= DENSE && (!is_step || more > MAJORITY * less);
        } else {
            is_voted = is_step && (value > middle) != is_near && near != far;
        }
        if (is_voted) {
            const int found = value_of(window, i, is_near);
            if (found >= 0 && found <= (x + i) * STEPS_PER_PX) {
                to[i] = (int16_t)found;
                margin[i] = 0; /* no cost was its own */
            }
        }
    }
}

void ISA_NAME(vote_rows)(const struct vote *job, int from, int to)
{
    struct window window;
    memset(&window, 0, sizeof window);
    for (int y = from; y < to; y++) {
        memcpy(job->to + (ptrdiff_t)y * job->width, job->from + (ptrdiff_t)y * job->width, (size_t)job->width * sizeof *job->to);
        for (int x = 0; x < job->width; x += BLOCK) {
            take_window(job, x, y, &window);
            if (find_spread(&window)) {
                count_votes(&window);
                decide(job, &window, x, y, job->width - x < BLOCK ? job->width - x : BLOCK);
            }
        }
    }
}
