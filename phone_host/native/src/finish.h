/* The steps between the sweeps and the result that are cheap for one thread.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef TANDEM_FINISH_H
#define TANDEM_FINISH_H

#include <stddef.h>
#include <stdint.h>

struct support;

/* Islands of values. Label all bands of rows, by any threads; then join them; then drop from all bands. */
struct speckles {
    int width, height;
    int band;               /* rows of one */
    int area;               /* islands of up to so many px go */
    int16_t *steps;         /* (height, width): 1/16 px, NO_STEPS = none; changed */
    int32_t *parent, *size; /* (height, width): of the runs of pixels that hang together; a run has the number of its first pixel */
    int32_t *run_of;        /* two rows for each thread */
};

void speckles_label_rows(const struct speckles *job, int from, int to, int thread);
void speckles_join_bands(const struct speckles *job);
void speckles_drop_rows(const struct speckles *job, int from, int to);

/* Narrow gaps are closed by a straight line between their ends: first along all rows, then along all columns. */
struct bridges {
    int width, height;
    int16_t *steps;                /* (height, width): 1/16 px, NO_STEPS = none; changed */
    uint8_t *margin;               /* (height, width): 0 where a value is a bridge's */
    const struct support *support; /* NULL, or what holds the guide: a bridge that does not lie on it is not built */
};

void bridge_rows(const struct bridges *job, int from, int to);
void bridge_columns(const struct bridges *job, int from, int to);

#endif
