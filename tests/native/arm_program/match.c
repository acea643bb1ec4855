/* Cases of tandem_match.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <stdlib.h>
#include <string.h>

#include "cases.h"
#include "tandem.h"

/* Fields: [width height disparities threads left_offset left_stride right_offset right_stride guide] i32; left; right;
 * then what must come out: disparity; confidence. */
int check_match(int32_t isa, const struct one_case *asked)
{
    const struct field *field = asked->field;
    int32_t whole[9];
    memcpy(whole, field[0].bytes, sizeof whole);
    struct tandem_match_job job = {
        .left = field[1].bytes + whole[4],
        .right = field[2].bytes + whole[6],
        .left_stride = whole[5],
        .right_stride = whole[7],
        .disparity = malloc((size_t)field[3].size),
        .confidence = malloc((size_t)field[4].size),
        .width = whole[0],
        .height = whole[1],
        .disparities = whole[2],
        .threads = whole[3],
        .guide = whole[8],
    };
    job.workspace_bytes = tandem_match_bytes(isa, &job);
    job.workspace = malloc((size_t)job.workspace_bytes);
    int differs = 0;
    if (job.disparity != NULL && job.confidence != NULL && job.workspace != NULL && tandem_match(isa, &job) == TANDEM_DONE) {
        differs = !same_bytes(job.disparity, field[3].size, &field[3])    ? 3
                  : !same_bytes(job.confidence, field[4].size, &field[4]) ? 4
                                                                         : -1;
    }
    free(job.disparity);
    free(job.confidence);
    free(job.workspace);
    return differs;
}
