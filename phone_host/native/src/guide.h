/* The guide: a smooth match of smaller images, which shows where a surface goes on though its texture does not say so (decision 0036).
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef TANDEM_GUIDE_H
#define TANDEM_GUIDE_H

#include <stddef.h>
#include <stdint.h>

/* The costs of a pixel are those of the sweeps without the order of neighbours; paths count half, so that the sums of eight fit a byte where they matter. */
enum {
    GUIDE_LANES = 32,                /* disparities are padded to multiples of it, on every processor */
    GUIDE_VOLUME = 6 * 1024 * 1024,  /* bytes at most; above it the images are made smaller */
    GUIDE_STEP_COST = 32, /* P1: with less, values drift on plain noise */
    GUIDE_JUMP_COST = 200 /* P2: plain areas take the depth of their edges, a board stays on one surface */
};

struct guide {
    const uint8_t *left, *right; /* the whole images, (height, width) */
    ptrdiff_t left_stride, right_stride;
    int width, height, disparities;
    int factor;                               /* a pixel of the guide is the mean of factor x factor pixels */
    int small_width, small_height, small_disparities;
    int16_t *steps;   /* (small_height, small_width), packed; written: 1/16 px of the small images, NO_STEPS = none */
    uint8_t *scratch; /* guide_scratch() bytes, aligned to 64 */
};

/* The size of the guide for images of a size. */
static inline struct guide guide_of(int width, int height, int disparities)
{
    struct guide guide = {.width = width, .height = height, .disparities = disparities, .factor = 1};
    size_t volume;
    do {
        guide.factor *= 2;
        guide.small_width = width / guide.factor > 1 ? width / guide.factor : 1;
        guide.small_height = height / guide.factor > 1 ? height / guide.factor : 1;
        const int wanted = (disparities + guide.factor - 1) / guide.factor;
        guide.small_disparities = wanted < guide.small_width ? wanted : guide.small_width;
        const size_t lanes = ((size_t)guide.small_disparities + GUIDE_LANES - 1) / GUIDE_LANES * GUIDE_LANES;
        volume = (size_t)guide.small_width * (size_t)guide.small_height * lanes;
    } while (volume > GUIDE_VOLUME);
    return guide;
}

#endif
