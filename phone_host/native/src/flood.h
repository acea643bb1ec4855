/* From which sides of a row a confirmed surface is reached: 64 pixels at once, as the bits of a number. What reaches one pixel reaches the next
 * unless something is in between, as the carry of a sum does.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef TANDEM_FLOOD_H
#define TANDEM_FLOOD_H

#include <stdint.h>
#include <string.h>

#include "support.h"

#define FLOOD_ONES 0x0101010101010101u

struct flood {
    uint64_t confirms, breaks, step_left;
};

/* The lowest bits of eight bytes, the first byte's lowest. */
static inline uint64_t flood_packed(uint64_t bytes) { return ((bytes & FLOOD_ONES) * 0x0102040810204080u) >> 56; }

/* The other way round. */
static inline uint64_t flood_spread(uint64_t bits)
{
    return ((((bits & 255) * FLOOD_ONES & 0x8040201008040201u) + 0x7f7f7f7f7f7f7f7fu) >> 7) & FLOOD_ONES;
}

static inline struct flood flood_of(const uint8_t *flags)
{
    struct flood flood = {0, 0, 0};
    for (int i = 0; i < 64; i += 8) {
        uint64_t eight;
        memcpy(&eight, flags + i, 8);
        flood.confirms |= flood_packed(eight) << i;
        flood.breaks |= flood_packed(eight >> 1) << i;
        flood.step_left |= flood_packed(eight >> 2) << i;
    }
    return flood;
}

static inline uint64_t flood_reversed(uint64_t v)
{
    v = __builtin_bswap64(v);
    v = (v >> 4 & 0x0f0f0f0f0f0f0f0fu) | (v & 0x0f0f0f0f0f0f0f0fu) << 4;
    v = (v >> 2 & 0x3333333333333333u) | (v & 0x3333333333333333u) << 2;
    return (v >> 1 & 0x5555555555555555u) | (v & 0x5555555555555555u) << 1;
}

/* Pixels that are reached: those that confirm, and upwards from them until one is `shut`. `carry` leads from one call to the next. */
static inline uint64_t flood_up(uint64_t confirms, uint64_t shut, uint64_t *carry)
{
    const uint64_t open = confirms | ~shut, into = (open + confirms + *carry) ^ open ^ confirms;
    const uint64_t reached = confirms | (open & into);
    *carry = reached >> 63;
    return reached;
}

static inline void flood_row(uint8_t *flags, int width)
{
    enum { MOST = INT16_MAX / 64 + 1 };
    struct flood parts[MOST];
    uint64_t from_left[MOST], carry = 0, step_after = 0;
    uint8_t last[64] = {0};
    const int count = (width + 63) / 64, rest = width - 64 * (count - 1);
    memcpy(last, flags + 64 * (count - 1), (size_t)rest);
    for (int i = 0; i < count; i++) {
        parts[i] = flood_of(i < count - 1 ? flags + 64 * i : last);
        from_left[i] = flood_up(parts[i].confirms, parts[i].breaks | parts[i].step_left, &carry);
    }
    carry = 0;
    for (int i = count - 1; i >= 0; i--) {
        const uint64_t shut = parts[i].breaks | parts[i].step_left >> 1 | step_after << 63;
        const uint64_t from_right = flood_reversed(flood_up(flood_reversed(parts[i].confirms), flood_reversed(shut), &carry));
        uint8_t *row = i < count - 1 ? flags + 64 * i : last;
        step_after = parts[i].step_left & 1;
        for (int k = 0; k < 64; k += 8) {
            uint64_t eight;
            memcpy(&eight, row + k, 8);
            eight |= flood_spread(from_left[i] >> k) * FROM_LEFT | flood_spread(from_right >> k) * FROM_RIGHT;
            memcpy(row + k, &eight, 8);
        }
    }
    memcpy(flags + 64 * (count - 1), last, (size_t)rest);
}

#endif
