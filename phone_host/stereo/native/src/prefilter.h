/* What a pixel is compared by: grey level, slope and the order of its neighbours, each as one byte.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef TANDEM_PREFILTER_H
#define TANDEM_PREFILTER_H

#include <stddef.h>
#include <stdint.h>

#include "match.h"

enum plane {
    GREY,       /* grey level, weighted */
    GREY_LOW,   /* the least of the pixel and the two half-way points beside it: Birchfield and Tomasi's interval */
    GREY_HIGH,
    SLOPE,      /* from left to right, weighted, capped, SLOPE_CAP = none */
    SLOPE_LOW,
    SLOPE_HIGH,
    ORDER,      /* which of eight neighbours, two pixels away, are darker: census (Zabih and Woodfill, ECCV 1994) */
    PLANES
};

static inline int inside_of(int value, int most) { return value < 0 ? 0 : value > most ? most : value; }

static inline void interval(const uint8_t *value, int x, int left, int right, uint8_t *low, uint8_t *high)
{
    const int here = value[x], a = (here + value[left]) >> 1, b = (here + value[right]) >> 1;
    const int less = a < b ? a : b, more = a < b ? b : a;
    low[x] = (uint8_t)(here < less ? here : less);
    high[x] = (uint8_t)(here > more ? here : more);
}

/* The interval that each value and the half-way points to its neighbours span. */
static void interval_row(const uint8_t *restrict value, int width, uint8_t *restrict low, uint8_t *restrict high)
{
    interval(value, 0, 0, width > 1, low, high);
    for (int x = 1; x < width - 1; x++) {
        interval(value, x, x - 1, x + 1, low, high);
    }
    if (width > 1) {
        interval(value, width - 1, width - 2, width - 1, low, high);
    }
}

static inline uint8_t slope_at(const uint8_t *up, const uint8_t *here, const uint8_t *down, int left, int right)
{
    const int slope = (up[right] - up[left]) + 2 * (here[right] - here[left]) + (down[right] - down[left]);
    return (uint8_t)inside_of(((slope * SLOPE_WEIGHT + 8) >> 4) + SLOPE_CAP, 2 * SLOPE_CAP);
}

static void slope_row(const uint8_t *restrict up, const uint8_t *restrict here, const uint8_t *restrict down, int width,
                      uint8_t *restrict slope)
{
    slope[0] = slope_at(up, here, down, 0, width > 1);
    for (int x = 1; x < width - 1; x++) {
        slope[x] = slope_at(up, here, down, x - 1, x + 1);
    }
    slope[width - 1] = slope_at(up, here, down, width > 1 ? width - 2 : 0, width - 1);
}

static inline uint8_t order_at(const uint8_t *up, const uint8_t *here, const uint8_t *down, int x, int left, int right)
{
    const uint8_t mid = here[x];
    uint8_t darker = up[left] < mid ? 1 : 0;
    darker |= up[x] < mid ? 2 : 0;
    darker |= up[right] < mid ? 4 : 0;
    darker |= here[left] < mid ? 8 : 0;
    darker |= here[right] < mid ? 16 : 0;
    darker |= down[left] < mid ? 32 : 0;
    darker |= down[x] < mid ? 64 : 0;
    darker |= down[right] < mid ? 128 : 0;
    return darker;
}

static void order_row(const uint8_t *restrict up, const uint8_t *restrict here, const uint8_t *restrict down, int width,
                      uint8_t *restrict order)
{
    const int last = width - 1;
    for (int x = 0; x < width && x < 2; x++) {
        order[x] = order_at(up, here, down, x, 0, inside_of(x + 2, last));
    }
    for (int x = 2; x < width - 2; x++) {
        order[x] = order_at(up, here, down, x, x - 2, x + 2);
    }
    for (int x = width < 4 ? 2 : width - 2; x < width; x++) {
        order[x] = order_at(up, here, down, x, x - 2, last);
    }
}

/* Fill the planes of row y, `pitch` bytes apart; the image's borders are repeated. */
static inline void prefilter_row(const uint8_t *image, ptrdiff_t stride, int width, int height, int y, uint8_t *planes, size_t pitch)
{
    const uint8_t *row[5];
    for (int i = 0; i < 5; i++) {
        row[i] = image + inside_of(y + i - 2, height - 1) * stride;
    }
    uint8_t *restrict grey = planes + GREY * pitch;
    for (int x = 0; x < width; x++) {
        grey[x] = (uint8_t)((row[2][x] * GREY_WEIGHT + 8) >> 4);
    }
    slope_row(row[1], row[2], row[3], width, planes + SLOPE * pitch);
    order_row(row[0], row[2], row[4], width, planes + ORDER * pitch);
    interval_row(grey, width, planes + GREY_LOW * pitch, planes + GREY_HIGH * pitch);
    interval_row(planes + SLOPE * pitch, width, planes + SLOPE_LOW * pitch, planes + SLOPE_HIGH * pitch);
}

#endif
