/* Cases of tandem_reproject, tandem_pack and tandem_remap.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <stdlib.h>
#include <string.h>

#include "cases.h"
#include "tandem.h"

/* Fields: [width height wide] i32; [doffs product least at_zero far near] f32; disparity; column slopes; row slopes;
 * then what must come out: cloud; [found at_zero in_front too_far too_near] i64. */
int check_points(int32_t isa, const struct one_case *asked)
{
    const struct field *field = asked->field;
    int32_t whole[3];
    float value[6];
    memcpy(whole, field[0].bytes, sizeof whole);
    memcpy(value, field[1].bytes, sizeof value);
    const uint64_t size = field[5].size;
    float *cloud = malloc((size_t)size + 1);
    struct tandem_reproject_job job = {
        .disparity_px = (const float *)(const void *)field[2].bytes,
        .column_slopes = (const float *)(const void *)field[3].bytes,
        .row_slopes = (const float *)(const void *)field[4].bytes,
        .cloud_m = cloud,
        .disparity_stride = whole[0],
        .width = whole[0],
        .height = whole[1],
        .wide = whole[2],
        .doffs_px = value[0],
        .product = value[1],
        .least_px = value[2],
        .at_zero_px = value[3],
        .far_m = value[4],
        .near_m = value[5],
    };
    if (cloud == NULL || tandem_reproject(isa, &job) != TANDEM_DONE) {
        free(cloud);
        return 0;
    }
    const int64_t counts[5] = {job.found, job.at_zero, job.in_front, job.too_far, job.too_near};
    const int cloud_is_right = same_bytes(cloud, size, &field[5]);
    free(cloud);
    return !cloud_is_right ? 5 : same_bytes(counts, sizeof counts, &field[6]) ? -1 : 6;
}

/* Fields: [width height channels] i32; three flips u8; cloud; colours; then what must come out: the records. */
int check_records(int32_t isa, const struct one_case *asked)
{
    const struct field *field = asked->field;
    int32_t whole[3];
    memcpy(whole, field[0].bytes, sizeof whole);
    uint8_t *records = malloc(((size_t)whole[0] * (size_t)whole[1] + 1) * 15);
    struct tandem_pack_job job = {
        .cloud_m = (const float *)(const void *)field[2].bytes,
        .colours = field[3].bytes,
        .records = records,
        .cloud_stride = 3 * (int64_t)whole[0],
        .colour_stride = (int64_t)whole[0] * whole[2],
        .width = whole[0],
        .height = whole[1],
        .channels = whole[2],
    };
    memcpy(job.flips, field[1].bytes, sizeof job.flips);
    if (records == NULL || tandem_pack(isa, &job) != TANDEM_DONE) {
        free(records);
        return 0;
    }
    const int right = same_bytes(records, (uint64_t)job.count * 15, &field[4]);
    free(records);
    return right ? -1 : 4;
}

/* Fields: [image_width image_height] i32; image; places; fractions; then what must come out: the pixels. */
int check_remap(int32_t isa, const struct one_case *asked)
{
    const struct field *field = asked->field;
    int32_t size[2];
    memcpy(size, field[0].bytes, sizeof size);
    uint8_t *out = malloc((size_t)field[4].size + 1);
    struct tandem_remap_job job = {
        .image = field[1].bytes,
        .places = (const int16_t *)(const void *)field[2].bytes,
        .fractions = (const uint16_t *)(const void *)field[3].bytes,
        .out = out,
        .image_stride = 3 * (int64_t)size[0],
        .out_pixels = (int64_t)(field[3].size / sizeof(uint16_t)),
        .image_width = size[0],
        .image_height = size[1],
    };
    if (out == NULL || tandem_remap(isa, &job) != TANDEM_DONE) {
        free(out);
        return 0;
    }
    const int right = same_bytes(out, field[4].size, &field[4]);
    free(out);
    return right ? -1 : 4;
}
