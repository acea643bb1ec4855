/* From the two views' raw disparities to one reliable map: the steps whose rows do not wait for each other. The bands of rows may be
 * worked on in any order and by any number of threads.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <math.h>
#include <string.h>

#include "kernels.h"
#include "match.h"
#include "word_lanes.h"

enum {
    AGREEMENT = 24, /* 1/16 px: each view rounds on its own, so less than 1.5 px would drop good slanted surfaces */
    COLUMNS = 256,  /* worked on at a time, so that what they need stays in the first-level cache */
    WINDOW = 5,     /* edge of the median's window, px */
    HELD = (WINDOW * WINDOW + 1) / 2 + 1
};

WORDS_INLINE void sort_two(words *a, words *b)
{
    const words low = words_min(*a, *b);
    *b = words_max(*a, *b);
    *a = low;
}

static const float LAST_STEP_PX = 15.0f / STEPS_PER_PX; /* less than a pixel */

/* Bring the least value to the front and the greatest to the back. */
WORDS_INLINE void find_ends(words *value, const int count)
{
#pragma GCC unroll 16
    for (int i = 0; i < count / 2; i++) {
        sort_two(&value[i], &value[count - 1 - i]);
    }
#pragma GCC unroll 16
    for (int i = 1; i < (count + 1) / 2; i++) {
        sort_two(&value[0], &value[i]);
    }
#pragma GCC unroll 16
    for (int i = count / 2; i < count - 1; i++) {
        sort_two(&value[i], &value[count - 1]);
    }
}

/* Medians of 5 x 5 windows; `corner` is the first window's. Of any 14 of the 25 values neither the least nor the greatest is the
 * median: drop both, take in one more, and so on. */
WORDS_INLINE words median_of_window(const int16_t *corner, ptrdiff_t pitch)
{
    words value[HELD];
#pragma GCC unroll 16
    for (int i = 0; i < HELD; i++) {
        value[i] = words_load(corner + (i / WINDOW) * pitch + i % WINDOW);
    }
#pragma GCC unroll 16
    for (int next = HELD; next <= WINDOW * WINDOW; next++) {
        const int count = 2 * HELD - next;
        find_ends(value, count);
        if (next < WINDOW * WINDOW) {
            value[0] = words_load(corner + (next / WINDOW) * pitch + next % WINDOW);
        }
    }
    return value[1];
}

/* Median of the 5 x 5 window around each pixel of a row; the borders are repeated. */
static void median_row(const int16_t *plane, int width, int height, int y, int16_t *median)
{
    enum { PITCH = COLUMNS + WINDOW - 1 + WORDS };
    int16_t tile[WINDOW][PITCH], found[COLUMNS + WORDS];
    memset(tile, 0, sizeof tile);
    for (int from = 0; from < width; from += COLUMNS) {
        const int count = width - from < COLUMNS ? width - from : COLUMNS;
        for (int i = 0; i < WINDOW; i++) {
            const int line = y + i - 2 < 0 ? 0 : y + i - 2 > height - 1 ? height - 1 : y + i - 2;
            const int16_t *row = plane + (ptrdiff_t)line * width;
            for (int x = 0; x < 2; x++) {
                const int right = from + count + x;
                tile[i][x] = row[from + x < 2 ? 0 : from + x - 2];
                tile[i][count + 2 + x] = row[right > width - 1 ? width - 1 : right];
            }
            memcpy(tile[i] + 2, row + from, (size_t)count * sizeof *row);
        }
        for (int x = 0; x < count; x += WORDS) {
            words_store(found + x, median_of_window(tile[0] + x, PITCH));
        }
        memcpy(median + from, found, (size_t)count * sizeof *median);
    }
}

void ISA_NAME(check_rows)(const struct finish *job, int from, int to)
{
    const int width = job->width;
    for (int y = from; y < to; y++) {
        int16_t *checked = job->checked + (ptrdiff_t)y * width;
        const int16_t *right = job->right + (ptrdiff_t)(y / RIGHT_STEP) * width;
        median_row(job->left, width, job->height, y, checked);
        for (int x = 0; x < width; x++) {
            const int steps = checked[x], there = (x * STEPS_PER_PX - steps + STEPS_PER_PX / 2) >> 4;
            const int back = there < 0 ? 0 : there;
            const int apart = right[back] < steps ? steps - right[back] : right[back] - steps;
            const int is_good = there >= 0 && apart <= AGREEMENT && job->told[y];
            checked[x] = (int16_t)(is_good ? steps : NO_STEPS);
        }
    }
}

/* How sure a row's values are: the mean margin of the confirmed pixels in a 9 x 9 window, the others counting as 0. A margin alone is
 * noisy; a value amid doubtful ones is doubtful itself. */
static void confidence_row(const struct finish *job, int y)
{
    enum { REACH = 4, SIDE = 2 * REACH + 1 };
    const int width = job->width, top = y > REACH ? y - REACH : 0;
    const int bottom = y + REACH < job->height - 1 ? y + REACH : job->height - 1;
    const float *rough = job->rough + (size_t)(y + GUARD) * rough_pitch(width) + GUARD;
    uint8_t *confidence = job->confidence + (ptrdiff_t)y * width;
    int16_t column[COLUMNS + 2 * REACH];
    for (int from = 0; from < width; from += COLUMNS) {
        const int count = width - from < COLUMNS ? width - from : COLUMNS;
        const int first = from > REACH ? from - REACH : 0, last = from + count + REACH < width ? from + count + REACH : width;
        memset(column, 0, sizeof column);
        int16_t *restrict sums = column + (first - from + REACH);
        for (int line = top; line <= bottom; line++) {
            const int16_t *restrict margins = job->checked + (ptrdiff_t)line * width + first;
            for (int x = 0; x < last - first; x++) {
                sums[x] = (int16_t)(sums[x] + margins[x]);
            }
        }
        int sum = 0;
        for (int i = 0; i < SIDE - 1; i++) {
            sum += column[i];
        }
        for (int x = 0; x < count; x++) {
            sum += column[x + SIDE - 1];
            const int sure = sum * 255 / (SIDE * SIDE * MARGIN_CAP);
            confidence[from + x] = (uint8_t)(rough[from + x] < 0.0f ? 0 : sure > 0 ? sure : 1);
            sum -= column[x];
        }
    }
}

/* Average each value with its neighbours of similar disparity (bilateral filter: Tomasi and Manduchi, ICCV 1998), with weights that fall
 * linearly to 0 at REACH_PX. Every second neighbour of a 9 x 9 window says as much as all. */
void ISA_NAME(smooth_rows)(const struct finish *job, int from, int to)
{
    const float reach = 1.5f;
    const int width = job->width;
    const size_t pitch = rough_pitch(width);
    float sum[COLUMNS], weights[COLUMNS];
    for (int y = from; y < to; y++) {
        float *restrict disparity = job->disparity + (ptrdiff_t)y * width;
        for (int start = 0; start < width; start += COLUMNS) {
            const int count = width - start < COLUMNS ? width - start : COLUMNS;
            const float *restrict here = job->rough + (size_t)(y + GUARD) * pitch + GUARD + (size_t)start;
            memset(sum, 0, sizeof sum);
            memset(weights, 0, sizeof weights);
            for (int dy = -4; dy <= 4; dy += 2) {
                for (int dx = -4; dx <= 4; dx += 2) {
                    const float *restrict there = here + (ptrdiff_t)dy * (ptrdiff_t)pitch + dx;
                    for (int x = 0; x < count; x++) {
                        const float apart = there[x] - here[x], weight = reach - fabsf(apart);
                        const float used = weight > 0.0f ? weight : 0.0f;
                        sum[x] += used * apart;
                        weights[x] += used;
                    }
                }
            }
            for (int x = 0; x < count; x++) {
                const float averaged = here[x] + sum[x] / weights[x], most = (float)(start + x) + LAST_STEP_PX;
                const float value = averaged < most ? averaged : most; /* its partner lies in the right image */
                disparity[start + x] = here[x] < 0.0f ? NAN : value;
            }
        }
        confidence_row(job, y);
    }
}
