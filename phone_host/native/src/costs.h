/* What two pixels cost by grey level and slope, for many disparities at once.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef TANDEM_COSTS_H
#define TANDEM_COSTS_H

#include "byte_lanes.h"
#include "prefilter.h"

/* How far a value lies outside the other pixel's interval: one direction of Birchfield and Tomasi's measure. */
BYTES_INLINE bytes beyond(bytes value, const uint8_t *lows, const uint8_t *highs)
{
    return bytes_max(bytes_minus(value, bytes_load(highs)), bytes_minus(bytes_load(lows), value));
}

/* The pixel's value in each plane; `there` is the first of the other ones in the first plane, whose planes are `pitch` bytes apart. The
 * sum is at most 80 + 42. */
BYTES_INLINE bytes grey_and_slope(const bytes value[PLANES], const uint8_t *there, size_t pitch)
{
    const bytes grey = beyond(value[GREY], there + GREY_LOW * pitch, there + GREY_HIGH * pitch), slope_there = bytes_load(there + SLOPE * pitch);
    const bytes slope = bytes_min(beyond(value[SLOPE], there + SLOPE_LOW * pitch, there + SLOPE_HIGH * pitch),
                                  bytes_max(bytes_minus(slope_there, value[SLOPE_HIGH]), bytes_minus(value[SLOPE_LOW], slope_there)));
    return bytes_add(grey, slope);
}

#endif
