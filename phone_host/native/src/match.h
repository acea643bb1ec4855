/* What the parts of the matcher share: its constants and the work of one sweep.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef TANDEM_MATCH_H
#define TANDEM_MATCH_H

#include <stddef.h>
#include <stdint.h>

/* Costs. A pixel's cost is the sum of three, each insensitive to what another one suffers from (decision 0036). */
enum {
    GREY_WEIGHT = 5,   /* of 16: grey levels, told apart as Birchfield and Tomasi do (PAMI 20(4), 1998) */
    SLOPE_WEIGHT = 11, /* of 16: Sobel's slope from left to right, the same way */
    SLOPE_CAP = 21,
    COST_CAP = 40, /* a greater cost says no more than that two pixels differ */
    STEP_COST = 11, /* P1: disparity changes by one */
    JUMP_COST = 40, /* P2: by more, where the image is even */
    LEAST_JUMP_COST = 16, /* P2 at edges of the image */
    JUMP_SLOPE = 8 /* grey levels from one pixel to the next that halve P2 */
};
/* COST_CAP + JUMP_COST bounds a path's cost, three of which must stay below 255. */

enum { MOST_DISPARITIES = 2048, STEPS_PER_PX = 16, NO_STEPS = -16 };

/* The right view only confirms the left one's values: every second row does that as well as all (decision 0036). */
enum { RIGHT_STEP = 2 };

/* Rows and columns of one task after the sweeps, at most. */
enum { BAND = 16, SLAB = 64 };

/* One view's disparities, for a strip of rows. */
struct sweep {
    const uint8_t *own;   /* the view's image, (height, width), rows `stride` bytes apart */
    const uint8_t *other; /* the other one */
    ptrdiff_t own_stride, other_stride;
    int width, height;
    int disparities;
    int is_right;   /* 1: the view is the right one; its pixel x shows the left image's x + d */
    int is_upward;  /* 1: rows are worked on from the last to the first */
    int row_step;   /* 1 or 2: from one row that is worked on to the next */
    int rows;       /* that are worked on in all */
    int first;      /* of them, counted in the direction of work, with which the paths begin */
    int begin, end; /* of them, counted so, that are written */
    int16_t *steps;  /* (rows, width): 1/16 px */
    uint8_t *margin; /* (height, width): how much more the next best disparity costs, beyond the neighbours of the best */
    uint8_t *scratch; /* sweep_scratch() bytes, aligned to 64 */
};

/* A band of rows in the steps after the sweeps; see finish_kernel.c. Planes are (height, width), packed. */
struct finish {
    int width, height;
    const int16_t *left;  /* disparities of the left view, 1/16 px */
    const int16_t *right; /* those of the right one, every RIGHT_STEP-th row: (rows, width) */
    const uint8_t *told; /* (height,): whether the row's texture can say anything */
    int16_t *checked;    /* disparities that are confirmed, NO_STEPS elsewhere; in the end their margins, 0 elsewhere */
    float *rough;        /* px; NONE_PX where there is none; holds GUARD more rows and columns on each side */
    float *disparity;    /* the result, NAN = none */
    uint8_t *confidence; /* margins of the left view's sums, then the result, 0 = none */
};

/* Votes on the surface that pixels belong to; see vote_kernel.c. Planes are (height, width), packed. */
struct vote {
    int width, height;
    const uint8_t *image; /* the left one, rows `stride` bytes apart */
    ptrdiff_t stride;
    const int16_t *before; /* what the round before had; `from` in the first round */
    const int16_t *from;   /* 1/16 px, NO_STEPS = none */
    int16_t *to;
    uint8_t *margin; /* of the values; 0 where a vote decided */
};

enum {
    GUARD = 4,
    MARGIN_CAP = 60 /* a greater margin makes a value no surer */
};
#define NONE_PX (-99.0f)

static inline size_t rough_pitch(int width) { return (size_t)width + 2 * GUARD; }

#endif
