/* The steps of the support that follow rows: how badly the two images fit together by the values, and by the guide (capped differences of
 * level and of slope along the row, summed over squares), and which values that speaks against.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <string.h>

#include "flood.h"
#include "kernels.h"
#include "layout.h"
#include "prefilter.h"
#include "support.h"

enum {
    FIT_CAP = 20,    /* grey levels, of level and of slope each: more than this is another surface, no worse match */
    FIT_WINDOW = 5,  /* edge of the square, px; 1 px lets noise decide */
    REACH = FIT_WINDOW / 2,
    PARTS = 4,       /* the right image is read at quarters of a pixel */
    SLIDE = 3,       /* parts: the guide is tried this far to both sides, too, for it was matched at half the size */
    EVEN = 32,       /* 1/16 px of the guide: four of its pixels that differ by more lie on two surfaces */
    FITS = 4,        /* the value; the guide, as it is and slid to both sides */
    LINES = BAND + 2 * REACH,
    ZERO_SLOPE = 128,
    SPAN = 32        /* columns for which costs are computed, or not, together */
};

/* Of two rows of the guide: the least and the greatest of both, and their weighted sum. */
struct guide_cell {
    int16_t *low, *high;
    int32_t *value;
};

struct fit_room {
    size_t pitch;
    uint8_t *fit[FITS];                /* (LINES, pitch): costs of single pixels, REACH columns more on both sides */
    uint8_t *sum;                      /* (pitch,): of five rows */
    uint16_t *own, *parts, *there;     /* level and slope: of the left row; of the right row at each part; as read */
    uint8_t *level, *slope;            /* of a row, with one more pixel */
    int32_t *place;
    struct guide_cell cells;
    uint8_t *asked;                    /* (width,): whether any row of the band asks for the column's costs */
};

struct span {
    int from, to;
};

static size_t laid_out(struct fit_room *room, int columns, uint8_t *scratch)
{
    uint8_t *at = scratch;
    const size_t width = (size_t)columns;
    room->pitch = (width + 2 * REACH + 63) / 64 * 64;
    for (int i = 0; i < FITS; i++) {
        room->fit[i] = taken(&at, LINES * room->pitch);
    }
    room->sum = taken(&at, room->pitch);
    room->own = (uint16_t *)(void *)taken(&at, 2 * width);
    room->parts = (uint16_t *)(void *)taken(&at, 2 * PARTS * width);
    room->there = (uint16_t *)(void *)taken(&at, 2 * width);
    room->level = taken(&at, width + 1);
    room->slope = taken(&at, width + 1);
    room->place = (int32_t *)(void *)taken(&at, 4 * width);
    room->cells.low = (int16_t *)(void *)taken(&at, 2 * width);
    room->cells.high = (int16_t *)(void *)taken(&at, 2 * width);
    room->cells.value = (int32_t *)(void *)taken(&at, 4 * width);
    room->asked = taken(&at, width);
    return (size_t)(at - scratch);
}

size_t ISA_NAME(support_scratch)(int width)
{
    static uint8_t nowhere[64];
    struct fit_room room;
    return laid_out(&room, width, nowhere);
}

/* A pixel of the whole image between two of the guide, at `part` of 2 * factor from the first: even where all four around it lie on one
 * surface, elsewhere that of the nearest. */
static inline int16_t even_or(const struct guide_cell *cells, int i, int part, int whole, int nearest)
{
    const int16_t low = cells->low[i] < cells->low[i + 1] ? cells->low[i] : cells->low[i + 1];
    const int16_t high = cells->high[i] > cells->high[i + 1] ? cells->high[i] : cells->high[i + 1];
    const int even = (cells->value[i] * (whole - part) + cells->value[i + 1] * part + whole) / (2 * whole);
    const int plain = nearest < 0 ? NO_STEPS : nearest * (whole / 2);
    const int is_even = (low >= 0) & (high - low <= EVEN);
    return (int16_t)(is_even ? even : plain);
}

/* The pixels between the guide's columns; inlined for the usual factor, so that the compiler divides by shifts. */
static inline __attribute__((always_inline)) void between_columns(const struct guide_cell *cells, const int16_t *restrict here, int columns,
                                                                  const int factor, int16_t *restrict row)
{
    for (int i = 0; i + 1 < columns; i++) {
        for (int k = 0; k < factor; k++) {
            row[i * factor + k] = even_or(cells, i, 2 * k + 1, 2 * factor, here[i + (2 * k >= factor)]);
        }
    }
}

/* A row of the guide at full size. */
static void smooth_row(const struct support *job, int y, const struct guide_cell *cells, int16_t *restrict row)
{
    const struct guide *guide = job->guide;
    const int factor = guide->factor, whole = 2 * factor, columns = guide->small_width, half = factor / 2;
    const int halves = 2 * y + 1 - factor, last = guide->small_height - 1, first = halves < 0 ? 0 : halves / whole;
    const int line = first < last ? first : last, next = halves < 0 || line == last ? line : line + 1, part = next > line ? halves - whole * line : 0;
    const int16_t *restrict upper = guide->steps + (ptrdiff_t)line * columns, *restrict lower = guide->steps + (ptrdiff_t)next * columns;
    const int16_t *restrict here = 2 * part < whole ? upper : lower;
    int16_t *restrict low = cells->low, *restrict high = cells->high;
    int32_t *restrict value = cells->value;
    for (int i = 0; i < columns; i++) {
        const int16_t a = upper[i], b = lower[i];
        low[i] = a < b ? a : b;
        high[i] = a < b ? b : a;
        value[i] = a * (whole - part) + b * part;
    }
    const int from = half < job->width ? half : job->width, to = from + (columns - 1) * factor;
    for (int x = 0; x < from; x++) {
        row[x] = (int16_t)(here[0] < 0 ? NO_STEPS : here[0] * factor);
    }
    if (factor == 2) {
        between_columns(cells, here, columns, 2, row + from);
    } else if (factor == 4) {
        between_columns(cells, here, columns, 4, row + from);
    } else {
        between_columns(cells, here, columns, factor, row + from);
    }
    for (int x = columns > 1 ? to : from; x < job->width; x++) {
        row[x] = (int16_t)(here[columns - 1] < 0 ? NO_STEPS : here[columns - 1] * factor);
    }
}

void ISA_NAME(support_smooth_rows)(const struct support *job, int from, int to, uint8_t *scratch)
{
    struct fit_room room;
    laid_out(&room, job->width, scratch);
    for (int y = from; y < to; y++) {
        smooth_row(job, y, &room.cells, job->smooth + (ptrdiff_t)y * job->width);
    }
}

/* Sobel's weights add up to 8 for a slope of one level a pixel; two of its steps are as bad as one of level. */
static inline uint8_t slope_of(const uint8_t *up, const uint8_t *here, const uint8_t *down, int left, int right)
{
    const int slope = (up[right] - up[left]) + 2 * (here[right] - here[left]) + (down[right] - down[left]);
    return (uint8_t)inside_of((slope >> 2) + ZERO_SLOPE, 255);
}

static void slopes_of_row(const uint8_t *image, ptrdiff_t stride, int width, int height, int y, uint8_t *restrict slope)
{
    const uint8_t *restrict up = image + inside_of(y - 1, height - 1) * stride, *restrict here = image + y * stride;
    const uint8_t *restrict down = image + inside_of(y + 1, height - 1) * stride;
    slope[0] = slope_of(up, here, down, 0, width > 1);
    for (int x = 1; x < width - 1; x++) {
        slope[x] = slope_of(up, here, down, x - 1, x + 1);
    }
    slope[width - 1] = slope_of(up, here, down, width > 1 ? width - 2 : 0, width - 1);
}

/* The right row at every quarter of a pixel. */
static void part_row(const struct support *job, const struct fit_room *room, int y)
{
    const int width = job->width;
    uint8_t *restrict level = room->level, *restrict slope = room->slope;
    uint16_t *restrict parts = room->parts;
    memcpy(level, job->right + y * job->right_stride, (size_t)width);
    slopes_of_row(job->right, job->right_stride, width, job->height, y, slope);
    level[width] = level[width - 1];
    slope[width] = slope[width - 1];
    for (int x = 0; x < width; x++) {
        const int a = level[x], b = level[x + 1], s = slope[x], t = slope[x + 1];
        parts[PARTS * x] = (uint16_t)(a | s << 8);
        parts[PARTS * x + 1] = (uint16_t)((3 * a + b + 2) >> 2 | ((3 * s + t + 2) >> 2) << 8);
        parts[PARTS * x + 2] = (uint16_t)((a + b + 1) >> 1 | ((s + t + 1) >> 1) << 8);
        parts[PARTS * x + 3] = (uint16_t)((a + 3 * b + 2) >> 2 | ((s + 3 * t + 2) >> 2) << 8);
    }
}

/* Costs of the span's pixels where the right image is read at `place`, slid. */
static void fit_row(const struct fit_room *room, int width, struct span span, int slide, uint8_t *restrict fit)
{
    const int from = span.from, to = span.to;
    const uint16_t *restrict own = room->own, *restrict parts = room->parts;
    const int32_t *restrict place = room->place;
    uint16_t *restrict there = room->there;
    const int last = PARTS * (width - 1);
    for (int x = from; x < to; x++) {
        const int at = place[x] + slide;
        there[x] = parts[at < 0 ? 0 : at > last ? last : at];
    }
    for (int x = from; x < to; x++) {
        const int a = own[x] & 255, b = there[x] & 255, s = own[x] >> 8, t = there[x] >> 8;
        const int level = a < b ? b - a : a - b, slope = s < t ? t - s : s - t;
        fit[x] = (uint8_t)((level < FIT_CAP ? level : FIT_CAP) + (slope < FIT_CAP ? slope : FIT_CAP));
    }
    for (int x = 1; x <= REACH && from == 0; x++) {
        fit[-x] = fit[0];
    }
    for (int x = 1; x <= REACH && to == width; x++) {
        fit[width - 1 + x] = fit[width - 1];
    }
}

/* The four costs of a span of an image row whose parts are known. A value that is missing has the guide's cost, and the other way round. */
static void fit_span(const struct support *job, const struct fit_room *room, int y, int line, struct span span)
{
    const int width = job->width, slide = SLIDE * job->guide->factor / 2;
    const int16_t *restrict steps = job->steps + (ptrdiff_t)y * width, *restrict guide = job->smooth + (ptrdiff_t)y * width;
    int32_t *restrict place = room->place;
    const size_t at = (size_t)line * room->pitch + REACH;
    span.from = span.from > REACH ? span.from - REACH : 0;
    span.to = span.to + REACH < width ? span.to + REACH : width;
    for (int x = span.from; x < span.to; x++) {
        const int value = steps[x], smooth = guide[x];
        place[x] = PARTS * x - (((value >= 0 ? value : smooth) + 2) >> 2);
    }
    fit_row(room, width, span, 0, room->fit[0] + at);
    for (int x = span.from; x < span.to; x++) {
        const int value = steps[x], smooth = guide[x];
        place[x] = PARTS * x - (((smooth >= 0 ? smooth : value) + 2) >> 2);
    }
    fit_row(room, width, span, 0, room->fit[1] + at);
    fit_row(room, width, span, slide, room->fit[2] + at);
    fit_row(room, width, span, -slide, room->fit[3] + at);
}

/* What the costs of a row are computed from. */
static void prepare_row(const struct support *job, const struct fit_room *room, int y)
{
    const int width = job->width;
    const uint8_t *restrict left = job->left + y * job->left_stride;
    uint8_t *restrict slope = room->slope;
    uint16_t *restrict own = room->own;
    slopes_of_row(job->left, job->left_stride, width, job->height, y, slope);
    for (int x = 0; x < width; x++) {
        own[x] = (uint16_t)(left[x] | slope[x] << 8);
    }
    part_row(job, room, y);
}

/* A quarter of the sum over the square around each pixel of a row; if not the first, the less of that and what is there. */
static void square_row(const struct fit_room *room, int i, int line, struct span span, int is_first, uint8_t *restrict out)
{
    const int from = span.from, to = span.to;
    const uint8_t *restrict a = room->fit[i] + (size_t)line * room->pitch, *restrict b = a + room->pitch;
    const uint8_t *restrict c = b + room->pitch, *restrict d = c + room->pitch, *restrict e = d + room->pitch;
    uint8_t *restrict sum = room->sum;
    for (int x = from; x < to + 2 * REACH; x++) {
        sum[x] = (uint8_t)(a[x] + b[x] + c[x] + d[x] + e[x]);
    }
    for (int x = from; x < to; x++) {
        const uint16_t all = (uint16_t)(sum[x] + sum[x + 1] + sum[x + 2] + sum[x + 3] + sum[x + 4]);
        const uint8_t value = (uint8_t)(all >> 2);
        out[x] = is_first || value < out[x] ? value : out[x];
    }
}

/* How far the values of a row are from the guide, and where that has steps. */
static void flag_row(const struct support *job, int y)
{
    const int width = job->width, agree = support_scaled(job, AGREE), much = support_scaled(job, APART);
    const int16_t *restrict steps = job->steps + (ptrdiff_t)y * width, *restrict guide = job->smooth + (ptrdiff_t)y * width;
    const int16_t *restrict above = y > 0 ? guide - width : guide;
    uint8_t *restrict apart = job->apart + (ptrdiff_t)y * width, *restrict flags = job->flags + (ptrdiff_t)y * width;
    for (int x = 0; x < width; x++) {
        const int value = steps[x], smooth = guide[x], far = value < smooth ? smooth - value : value - smooth;
        const int is_both = (smooth >= 0) & (value >= 0);
        const int px = inside_of((value - smooth) / STEPS_PER_PX + AS_FAR, DROPPED - 1), rise = above[x] < smooth ? smooth - above[x] : above[x] - smooth;
        apart[x] = (uint8_t)((is_both & (far > much)) ? (px > 1 ? px : 1) : NOT_APART);
        flags[x] = (uint8_t)(rise > agree ? STEP_ABOVE : 0);
    }
    for (int x = 1; x < width; x++) {
        const int rise = guide[x] < guide[x - 1] ? guide[x - 1] - guide[x] : guide[x] - guide[x - 1];
        flags[x] = (uint8_t)(flags[x] | (rise > agree ? STEP_LEFT : 0));
    }
}

/* Costs are asked for where a value may be dropped or filled in. */
static void ask_row(const struct support *job, const struct fit_room *room, int y)
{
    const int width = job->width;
    const ptrdiff_t at = (ptrdiff_t)y * width;
    const int16_t nearly = (int16_t)support_scaled(job, NEARLY);
    const int16_t *restrict steps = job->steps + at, *restrict guide = job->smooth + at;
    const uint8_t *restrict apart = job->apart + at, *restrict margin = job->margin + at;
    uint8_t *restrict asked = room->asked;
    for (int x = 0; x < width; x++) {
        const int16_t value = steps[x], smooth = guide[x], far = (int16_t)(value < smooth ? smooth - value : value - smooth);
        const uint8_t is_both = (value | smooth) >= 0, is_off = far > nearly, is_unsure = margin[x] < DOUBTFUL;
        const uint8_t is_open = (value & ~smooth) < 0, is_apart = apart[x] != NOT_APART;
        asked[x] |= (uint8_t)((is_both & is_off & is_unsure) | is_open | is_apart);
    }
}

/* The next span from `from` on that asks for costs. Returns an empty one at the end of the row. */
static struct span next_span(const uint8_t *asked, int from, int width)
{
    struct span span = {width, width};
    for (int x = from; x < width; x += SPAN) {
        const int is_asked = memchr(asked + x, 1, (size_t)(width - x < SPAN ? width - x : SPAN)) != NULL;
        if (is_asked && span.from == width) {
            span.from = x;
        } else if (!is_asked && span.from < width) {
            span.to = x;
            break;
        }
    }
    return span;
}

void ISA_NAME(support_cost_rows)(const struct support *job, int from, int to, uint8_t *scratch)
{
    const int width = job->width;
    struct fit_room room;
    laid_out(&room, width, scratch);
    memset(room.asked, 0, (size_t)width);
    for (int y = from; y < to; y++) {
        flag_row(job, y);
        ask_row(job, &room, y);
    }
    const struct span first = next_span(room.asked, 0, width);
    for (int y = from - REACH; y < to + REACH && first.from < width; y++) {
        const int row = inside_of(y, job->height - 1);
        prepare_row(job, &room, row);
        for (struct span span = first; span.from < width; span = next_span(room.asked, span.to, width)) {
            fit_span(job, &room, row, y - from + REACH, span);
        }
    }
    for (struct span span = first; span.from < width; span = next_span(room.asked, span.to, width)) {
        for (int y = from; y < to; y++) {
            uint8_t *own = job->own + (ptrdiff_t)y * width, *other = job->other + (ptrdiff_t)y * width;
            square_row(&room, 0, y - from, span, 1, own);
            for (int i = 1; i < FITS; i++) {
                square_row(&room, i, y - from, span, i == 1, other);
            }
        }
    }
}

/* Drop what is marked, and single values a little off that fit worse than the guide; flag what confirms the guide and what breaks it. */
static void drop_row(const struct support *job, int y)
{
    const int width = job->width;
    const ptrdiff_t at = (ptrdiff_t)y * width;
    const int16_t agree = (int16_t)support_scaled(job, AGREE), nearly = (int16_t)support_scaled(job, NEARLY);
    int16_t *restrict steps = job->steps + at;
    const int16_t *restrict guide = job->smooth + at;
    uint8_t *restrict flags = job->flags + at;
    const uint8_t *restrict apart = job->apart + at, *restrict own = job->own + at, *restrict other = job->other + at;
    const uint8_t *restrict margin = job->margin + at;
    for (int x = 0; x < width; x++) {
        const int16_t value = steps[x], smooth = guide[x];
        const int16_t far = (int16_t)(value < smooth ? smooth - value : value - smooth);
        const uint8_t is_worse = 2 * other[x] < 3 * own[x], is_unsure = margin[x] < DOUBTFUL, is_near = apart[x] == NOT_APART;
        const uint8_t is_both = (value | smooth) >= 0, is_off = far > nearly, agrees = far <= agree, is_marked = apart[x] == DROPPED;
        const uint8_t is_dropped = (uint8_t)((is_both & is_near & is_off & is_unsure & is_worse) | is_marked), is_kept = is_both & (is_dropped ^ 1);
        const uint8_t breaks = (uint8_t)((smooth < 0) | (is_kept & (agrees ^ 1)));
        steps[x] = (int16_t)(is_dropped ? NO_STEPS : value);
        flags[x] = (uint8_t)((flags[x] & (STEP_LEFT | STEP_ABOVE)) | (is_kept & agrees) * CONFIRMS | breaks * BREAKS);
    }
}

void ISA_NAME(support_drop_rows)(const struct support *job, int from, int to)
{
    for (int y = from; y < to; y++) {
        drop_row(job, y);
        flood_row(job->flags + (ptrdiff_t)y * job->width, job->width);
    }
}
