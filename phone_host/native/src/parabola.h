/* Between two disparities: the least of a parabola through three sums.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef TANDEM_PARABOLA_H
#define TANDEM_PARABOLA_H

#include "match.h"

/* 1/16 px: disparity d, whose sum is the least, and half a step at most towards the smaller of its neighbours' sums. Rounded to the
 * nearest: towards zero would be half a step too far on one side. Without both neighbours, give the least sum for each. */
static inline int16_t parabola_steps(int d, int low, int least, int high)
{
    const int a = low - least, b = high - least, bend = a + b;
    const float over = (float)((a - b) * STEPS_PER_PX), under = (float)(bend > 0 ? 2 * bend : 1);
    return (int16_t)((d - 1) * STEPS_PER_PX + (int)(over / under + (STEPS_PER_PX + 0.5f))); /* what is cut off is positive */
}

#endif
