/* Several float32 side by side, by the vector extension that gcc and clang share. One lane where vectors would not keep IEEE's
 * rules: 32-bit NEON rounds tiny numbers to 0.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef TANDEM_LANES_H
#define TANDEM_LANES_H

#include <float.h>
#include <stdint.h>
#include <string.h>

#if defined(__AVX512F__)
#define LANES 16
#elif defined(__AVX__)
#define LANES 8
#elif defined(__SSE2__) && !defined(TANDEM_IS_SCALAR)
#define LANES 4
#elif defined(__aarch64__) && !defined(TANDEM_IS_SCALAR)
#define LANES 4
#else
#define LANES 1
#endif

typedef float lanes_f __attribute__((vector_size(4 * LANES)));
typedef int32_t lanes_i __attribute__((vector_size(4 * LANES)));

static inline lanes_f lanes_load(const float *from)
{
    lanes_f value;
    memcpy(&value, from, sizeof value);
    return value;
}

static inline void lanes_store(float *to, lanes_f value)
{
    memcpy(to, &value, sizeof value);
}

static inline lanes_f lanes_of(float value)
{
    return value - (lanes_f){0};
}

/* A mask's lanes are -1 or 0. */
static inline lanes_f lanes_choose(lanes_i mask, lanes_f yes, lanes_f no)
{
    return (lanes_f)((mask & (lanes_i)yes) | (~mask & (lanes_i)no));
}

static inline lanes_f lanes_abs(lanes_f value)
{
    return (lanes_f)((lanes_i)value & 0x7fffffff);
}

static inline lanes_i lanes_finite(lanes_f value)
{
    return lanes_abs(value) <= lanes_of(FLT_MAX);
}

static inline int64_t lanes_sum(lanes_i value)
{
    int64_t sum = 0;
    for (int i = 0; i < LANES; i++) {
        sum += value[i];
    }
    return sum;
}

#endif
