/* Whether the images support a disparity, or the guide's smoother surface explains them as well (decision 0036).
 *
 * The steps, in this order; those over bands of rows and over slabs of columns may be done by any threads:
 * support_smooth_rows (bands), support_cost_rows (bands), support_regions (whole), support_drop_rows (bands), support_fill (slabs).
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef TANDEM_SUPPORT_H
#define TANDEM_SUPPORT_H

#include "guide.h"
#include "match.h"

/* What is known of a pixel, and from which sides the guide leads to it, without a break, from a value that confirms the guide. */
enum support_flag {
    CONFIRMS = 1,
    BREAKS = 2,        /* no guide, or a value far from it */
    STEP_LEFT = 4,     /* the guide steps between this pixel and the one to the left */
    STEP_ABOVE = 8,
    FROM_LEFT = 16,
    FROM_RIGHT = 32,
    FROM_ABOVE = 64,
    FROM_BELOW = 128,
    FROM_ALL = FROM_LEFT | FROM_RIGHT | FROM_ABOVE | FROM_BELOW
};

/* Distances between a value and the guide, 1/16 px, for a guide of half size; half as much again for one of a quarter, and so on. */
enum { AGREE = 12, NEARLY = 8, APART = 24 };

enum { NOT_APART = 0, AS_FAR = 128, DROPPED = 255 };

enum { DOUBTFUL = 19 /* margins below it are no surer than chance */ };

struct region {
    int32_t parent;
    int32_t pixels;
    uint32_t margin; /* sums over the pixels; of more than 16 million they wrap around */
    uint32_t apart;  /* px that the values are nearer than the guide, AS_FAR more for each pixel */
    uint32_t own, other;
};

struct region_run { /* of pixels of one row */
    int32_t from, to, region;
};

struct support {
    int width, height;
    const uint8_t *left, *right;
    ptrdiff_t left_stride, right_stride;
    const struct guide *guide;
    int16_t *smooth;        /* (height, width): the guide at full size, 1/16 px, NO_STEPS = none */
    int16_t *steps;         /* (height, width): the values, 1/16 px, NO_STEPS = none; changed */
    uint8_t *own, *other;   /* (height, width): cost of the value and of the guide */
    uint8_t *margin;        /* (height, width): of the values' costs; 0 where the guide gave the value */
    uint8_t *apart;         /* (height, width): AS_FAR + px that the value is nearer than the guide where that is much, NOT_APART elsewhere */
    uint8_t *flags;         /* (height, width): enum support_flag */
    struct region *regions; /* region_capacity of them */
    struct region_run *runs; /* 2 (width + 1) */
    int32_t region_capacity;
};

static inline int support_scaled(const struct support *job, int distance) { return distance * (job->guide->factor + 2) / 4; }

/* Whether a value for the pixel at an offset lies on the guide, or there is none to say. */
static inline int support_allows(const struct support *job, ptrdiff_t at, int value)
{
    const int smooth = job->smooth[at], far = smooth - value, agree = support_scaled(job, AGREE);
    return smooth < 0 || (far <= agree && -far <= agree);
}

void support_regions(const struct support *job);
void support_fill(const struct support *job, int from, int to);

#endif
