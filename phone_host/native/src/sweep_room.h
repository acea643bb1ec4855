/* The memory of a sweep: what lies where.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef TANDEM_SWEEP_ROOM_H
#define TANDEM_SWEEP_ROOM_H

#include "byte_lanes.h"
#include "layout.h"
#include "match.h"
#include "prefilter.h"

/* Plain C takes long to compile with everything unrolled, and so does what is sanitized. */
#if defined(__SANITIZE_ADDRESS__) || defined(TANDEM_IS_SCALAR)
#define FEW_VARIANTS
#endif

enum {
    MOST_CHUNKS = MOST_DISPARITIES / BYTES,
    MOST_ROWS = 4,
    GROUP = 4,        /* columns whose least costs are found together */
    TILE = 64         /* columns at each end that go through one pass after another: fewer cost more in mispredicted ends of loops */
};

/* Lanes beyond the last disparity cost more than any other, and adding to it does not overflow. */
enum { UNUSED_COST = 255 - JUMP_COST };

/* Where the scratch memory's parts lie. Widths are padded: the paths may begin beyond the last column, where everything costs 0. */
struct room {
    int width, columns, disparities, lanes, chunks, rows;
    size_t row_pitch, other_pitch, part_pitch;  /* from one plane to the next; from one part of a plane to the next */
    uint8_t *own[MOST_ROWS];                    /* PLANES rows of `width` bytes each */
    uint8_t *other[MOST_ROWS];                  /* the same backwards, with `lanes` more; part i is every chunks-th byte from the i-th */
    uint8_t *jump_along[MOST_ROWS];             /* P2 - P1 between a column and the one before it */
    uint8_t *jump_down[MOST_ROWS];              /* P2 - P1 between a pixel and the one in the row before */
    uint8_t *cost[MOST_ROWS], *sum[MOST_ROWS];  /* (columns, lanes) */
    uint8_t *least[MOST_ROWS], *low[MOST_ROWS]; /* of a row: the least sum, those beside it, the next best */
    uint8_t *high[MOST_ROWS], *next[MOST_ROWS];
    uint16_t *best[MOST_ROWS];                  /* where the least is */
    uint8_t *straight[5], *turned[5];           /* rows around the one that is prepared: the left image's; the right one's, backwards */
    uint8_t *planes;                            /* PLANES rows, while a row is prepared */
    uint8_t *down, *down_least;                 /* the vertical path: (columns, lanes), (columns,) */
    uint8_t *along_least;                       /* of each path along a row */
    uint8_t *unused;                            /* (lanes,): UNUSED_COST beyond the last disparity, else 0 */
    uint8_t *total;                             /* (TILE, lanes and more): the sums of all paths */
    size_t total_pitch;
    uint16_t *place;                            /* (lanes + 2,): where disparity d - 1 lies among the lanes */
    int16_t *steps;
};

/* From one plane to the next: an odd number of cache lines, so that planes do not compete for the same ones. */
static inline size_t apart(size_t size) { return (size + 127) / 128 * 128 + 64; }

/* How many rows are worked on together: four are faster (two need half of the cache). */
static inline int rows_together(size_t row_bytes)
{
#if defined(FEW_VARIANTS)
    (void)row_bytes;
    return 2;
#else
    return 9 * row_bytes <= 1536u * 1024u ? 4 : 2;
#endif
}

static inline void row_laid_out(struct room *room, int k, uint8_t **at)
{
    const size_t columns = (size_t)room->columns, row_bytes = columns * (size_t)room->lanes;
    room->own[k] = taken(at, PLANES * room->row_pitch) + MARGIN;
    room->other[k] = taken(at, PLANES * room->other_pitch) + MARGIN;
    room->jump_along[k] = taken(at, columns + BEYOND);
    room->jump_down[k] = taken(at, columns + BEYOND);
    room->cost[k] = taken(at, row_bytes);
    room->sum[k] = taken(at, row_bytes);
    room->least[k] = taken(at, columns);
    room->low[k] = taken(at, columns);
    room->high[k] = taken(at, columns);
    room->next[k] = taken(at, columns);
    room->best[k] = (uint16_t *)(void *)taken(at, 2 * columns);
}

static inline size_t laid_out(struct room *room, int width, int disparities, uint8_t *scratch)
{
    uint8_t *at = scratch;
    room->width = width;
    room->columns = (width + 2 * GROUP - 1) / (2 * GROUP) * (2 * GROUP);
    room->disparities = disparities;
    room->chunks = (disparities + BYTES - 1) / BYTES;
    room->lanes = room->chunks * BYTES;
    const size_t columns = (size_t)room->columns, lanes = (size_t)room->lanes;
    room->rows = rows_together(columns * lanes);
    room->row_pitch = apart(columns + lanes + MARGIN + BEYOND);
    room->part_pitch = apart(room->row_pitch / (size_t)room->chunks);
    room->other_pitch = room->part_pitch * (size_t)room->chunks;
    for (int k = 0; k < room->rows; k++) {
        row_laid_out(room, k, &at);
    }
    for (int i = 0; i < 5; i++) {
        room->straight[i] = taken(&at, room->row_pitch) + MARGIN;
        room->turned[i] = taken(&at, room->row_pitch) + MARGIN;
    }
    room->planes = taken(&at, PLANES * room->row_pitch) + MARGIN;
    room->down = taken(&at, columns * lanes);
    room->down_least = taken(&at, columns);
    room->along_least = taken(&at, 2 * MOST_ROWS);
    room->unused = taken(&at, lanes);
    room->total_pitch = lanes + BYTES;
    room->total = taken(&at, TILE * room->total_pitch);
    room->place = (uint16_t *)(void *)taken(&at, 2 * (lanes + 2));
    room->steps = (int16_t *)(void *)taken(&at, 2 * columns);
    return (size_t)(at - scratch);
}

#endif
