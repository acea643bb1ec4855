/* What a pixel is compared by: grey level, slope and the order of its neighbours, each as one byte.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef TANDEM_PREFILTER_H
#define TANDEM_PREFILTER_H

#include <stddef.h>
#include <stdint.h>

#include "byte_lanes.h"
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

/* Values on each side of a row that repeat its ends, and as many bytes more as a register may reach beyond. */
enum { MARGIN = 64, BEYOND = 2 * MARGIN };

static inline int inside_of(int value, int most) { return value < 0 ? 0 : value > most ? most : value; }

/* Repeat the ends of a row. */
static inline void widen(uint8_t *row, int width, int by)
{
    for (int i = 1; i <= by; i++) {
        row[-i] = row[0];
        row[width - 1 + i] = row[width - 1];
    }
}

/* How many values are computed: more than the width, so that none is left over. */
static inline int whole_registers(int width) { return (width + MARGIN - 1) / MARGIN * MARGIN; }

/* Half-way between two values, rounded down, without a greater type. */
static inline uint8_t between(uint8_t a, uint8_t b) { return (uint8_t)((a & b) + ((uint8_t)(a ^ b) >> 1)); }

/* The interval that each value and the half-way points to its neighbours span. */
static inline void interval_row(const uint8_t *restrict value, int width, uint8_t *restrict low, uint8_t *restrict high)
{
    for (int x = 0; x < whole_registers(width); x++) {
        const uint8_t here = value[x], a = between(here, value[x - 1]), b = between(here, value[x + 1]);
        const uint8_t less = a < b ? a : b, more = a < b ? b : a;
        low[x] = here < less ? here : less;
        high[x] = here > more ? here : more;
    }
}

static inline void grey_row(const uint8_t *restrict row, int width, uint8_t *restrict grey)
{
    for (int x = 0; x < whole_registers(width); x++) {
        grey[x] = (uint8_t)((row[x] * GREY_WEIGHT + 8) >> 4);
    }
}

static inline void slope_row(const uint8_t *restrict up, const uint8_t *restrict here, const uint8_t *restrict down, int width,
                             int16_t weight, uint8_t *restrict slope)
{
    for (int x = 0; x < whole_registers(width); x++) {
        const int16_t outer = (int16_t)((up[x + 1] - up[x - 1]) + (down[x + 1] - down[x - 1]));
        const int16_t whole = (int16_t)(outer + 2 * (here[x + 1] - here[x - 1]));
        const int16_t weighted = (int16_t)((int16_t)((int16_t)(whole * weight) + 8) >> 4);
        const int16_t low = weighted < -SLOPE_CAP ? -SLOPE_CAP : weighted, both = low > SLOPE_CAP ? SLOPE_CAP : low;
        slope[x] = (uint8_t)(both + SLOPE_CAP);
    }
}

/* One bit more: whether `there` is darker. */
BYTES_INLINE bytes with_darker(bytes bits, bytes here, const uint8_t *there)
{
    return bytes_add(bytes_add(bits, bits), bytes_min(bytes_minus(here, bytes_load(there)), bytes_of(1)));
}

static inline void order_row(const uint8_t *up, const uint8_t *row, const uint8_t *down, int width, int side, uint8_t *order)
{
    for (int x = 0; x < width; x += BYTES) {
        const bytes here = bytes_load(row + x);
        bytes bits = with_darker(bytes_of(0), here, up + x - side);
        bits = with_darker(bits, here, up + x);
        bits = with_darker(bits, here, up + x + side);
        bits = with_darker(bits, here, row + x - side);
        bits = with_darker(bits, here, row + x + side);
        bits = with_darker(bits, here, down + x - side);
        bits = with_darker(bits, here, down + x);
        bytes_store(order + x, with_darker(bits, here, down + x + side));
    }
}

/* Fill the planes of a row, `pitch` bytes apart, from it and two rows on each side, which are wider by 2; all have MARGIN bytes before
 * and BEYOND bytes behind them. If the image is turned, left is right. */
static inline void prefilter_row(uint8_t *const row[5], int width, int is_turned, uint8_t *planes, size_t pitch)
{
    uint8_t *grey = planes + GREY * pitch, *slope = planes + SLOPE * pitch;
    grey_row(row[2], width, grey);
    slope_row(row[1], row[2], row[3], width, is_turned ? -SLOPE_WEIGHT : SLOPE_WEIGHT, slope);
    order_row(row[0], row[2], row[4], width, is_turned ? -2 : 2, planes + ORDER * pitch);
    widen(grey, width, 1);
    widen(slope, width, 1);
    interval_row(grey, width, planes + GREY_LOW * pitch, planes + GREY_HIGH * pitch);
    interval_row(slope, width, planes + SLOPE_LOW * pitch, planes + SLOPE_HIGH * pitch);
}

/* P2 - P1 by the difference of two grey levels: at most LEAST_JUMP_COST from a difference of 12 on. */
static inline void jump_row(const uint8_t *one, const uint8_t *another, int width, uint8_t *jump)
{
#define JUMP(d) ((JUMP_COST * JUMP_SLOPE / (JUMP_SLOPE + (d)) > LEAST_JUMP_COST ? JUMP_COST * JUMP_SLOPE / (JUMP_SLOPE + (d)) : LEAST_JUMP_COST) - STEP_COST)
    _Static_assert(JUMP(15) == LEAST_JUMP_COST - STEP_COST, "the table holds all jump costs");
    static const uint8_t costs[16] = {JUMP(0), JUMP(1), JUMP(2),  JUMP(3),  JUMP(4),  JUMP(5),  JUMP(6),  JUMP(7),
                                      JUMP(8), JUMP(9), JUMP(10), JUMP(11), JUMP(12), JUMP(13), JUMP(14), JUMP(15)};
#undef JUMP
    for (int x = 0; x < width; x += BYTES) {
        const bytes a = bytes_load(one + x), b = bytes_load(another + x);
        const bytes difference = bytes_max(bytes_minus(a, b), bytes_minus(b, a));
        bytes_store(jump + x, bytes_of_table(costs, bytes_min(difference, bytes_of(15))));
    }
}

#endif
