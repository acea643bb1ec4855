/* From the two views' raw disparities to one reliable map: the steps whose rows do not wait for each other. The bands of rows may be
 * worked on in any order and by any number of threads.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <math.h>
#include <string.h>

#include "kernels.h"
#include "match.h"

enum {
    AGREEMENT = 24, /* 1/16 px: each view rounds on its own, so less than 1.5 px would drop good slanted surfaces */
    MEDIAN = 25,
    COLUMNS = 256 /* worked on at a time, so that the window of the median stays in the first-level cache */
};

static inline int16_t less(int16_t a, int16_t b) { return a < b ? a : b; }
static inline int16_t more(int16_t a, int16_t b) { return a < b ? b : a; }

/* Sort two rows of values, value by value. */
static inline void sort_two(int16_t *restrict a, int16_t *restrict b, int count)
{
    for (int i = 0; i < count; i++) {
        const int16_t low = less(a[i], b[i]), high = more(a[i], b[i]);
        a[i] = low;
        b[i] = high;
    }
}

/* Median of the 5 x 5 window around each pixel of a row; the borders are repeated. Forgetful selection: of any 14 of 25 values neither the
 * least nor the greatest is the median; drop both and take in one more. */
static void median_row(const int16_t *plane, int width, int height, int y, int16_t *median)
{
    int16_t window[MEDIAN][COLUMNS];
    for (int from = 0; from < width; from += COLUMNS) {
        const int count = width - from < COLUMNS ? width - from : COLUMNS;
        for (int i = 0; i < MEDIAN; i++) {
            const int dy = i / 5 - 2, dx = i % 5 - 2;
            const int line = y + dy < 0 ? 0 : y + dy > height - 1 ? height - 1 : y + dy;
            const int16_t *row = plane + (ptrdiff_t)line * width;
            for (int x = 0; x < count; x++) {
                const int column = from + x + dx;
                window[i][x] = row[column < 0 ? 0 : column > width - 1 ? width - 1 : column];
            }
        }
        int held = 14, next = 14;
        while (held > 1) {
            /* the least to the front, the greatest to the back */
            for (int i = 0; i < held / 2; i++) {
                sort_two(window[i], window[held - 1 - i], count);
            }
            for (int i = 1; i < (held + 1) / 2; i++) {
                sort_two(window[0], window[i], count);
            }
            for (int i = held / 2; i < held - 1; i++) {
                sort_two(window[i], window[held - 1], count);
            }
            if (next < MEDIAN) {
                memcpy(window[0], window[next], (size_t)count * sizeof window[0][0]);
                next++;
                held--;
            } else {
                for (int i = 1; i < held - 1; i++) {
                    memcpy(window[i - 1], window[i], (size_t)count * sizeof window[0][0]);
                }
                held -= 2;
            }
        }
        memcpy(median + from, window[0], (size_t)count * sizeof *median);
    }
}

void ISA_NAME(check_rows)(const struct finish *job, int from, int to)
{
    const int width = job->width;
    for (int y = from; y < to; y++) {
        int16_t *checked = job->checked + (ptrdiff_t)y * width;
        const int16_t *right = job->right + (ptrdiff_t)y * width;
        const uint8_t *margin = job->margin + (ptrdiff_t)y * width;
        uint8_t *trust = job->trust + (ptrdiff_t)y * width;
        median_row(job->left, width, job->height, y, checked);
        for (int x = 0; x < width; x++) {
            const int steps = checked[x], there = (x * STEPS_PER_PX - steps + STEPS_PER_PX / 2) >> 4;
            const int back = there < 0 ? 0 : there;
            const int apart = right[back] < steps ? steps - right[back] : right[back] - steps;
            const int is_good = there >= 0 && apart <= AGREEMENT && job->told[y];
            checked[x] = (int16_t)(is_good ? steps : NO_STEPS);
            trust[x] = margin[x];
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
                const float value = here[x] + sum[x] / weights[x];
                disparity[start + x] = here[x] < 0.0f ? NAN : value;
            }
        }
        const uint8_t *restrict trust = job->trust + (ptrdiff_t)y * width;
        uint8_t *restrict confidence = job->confidence + (ptrdiff_t)y * width;
        const float *restrict rough = job->rough + (size_t)(y + GUARD) * pitch + GUARD;
        for (int x = 0; x < width; x++) {
            const uint8_t least = trust[x] > 0 ? trust[x] : 1;
            confidence[x] = rough[x] < 0.0f ? 0 : least;
        }
    }
}
