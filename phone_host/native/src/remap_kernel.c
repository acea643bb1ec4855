/* An image seen through a map, interpolated between 2 x 2 pixels: what rectification does to a coloured image.
 *
 * The arithmetic of cv2.remap with CV_16SC2 maps, INTER_LINEAR and BORDER_REPLICATE (OpenCV, imgproc, remap): places in 1/32 px,
 * weights (32 - fx)(32 - fy) and so on, which add up to 1024, the sum rounded. So the bits are OpenCV's.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <stddef.h>
#include <string.h>

#include "kernels.h"

#define CHANNELS 3
#define ONE 32 /* pixel, in the map's units */

static inline int32_t within(int32_t value, int32_t size)
{
    return value < 0 ? 0 : value >= size ? size - 1 : value;
}

/* One pixel, wherever it lies: beyond the image its edge goes on. */
static void one_pixel(const struct tandem_remap_job *job, size_t at, uint8_t *out)
{
    const int32_t x = job->places[2 * at], y = job->places[2 * at + 1];
    const int32_t fx = job->fractions[at] % ONE, fy = job->fractions[at] / ONE % ONE;
    const ptrdiff_t left = (ptrdiff_t)within(x, job->image_width) * CHANNELS;
    const ptrdiff_t right = (ptrdiff_t)within(x + 1, job->image_width) * CHANNELS;
    const uint8_t *above = job->image + (ptrdiff_t)within(y, job->image_height) * job->image_stride;
    const uint8_t *below = job->image + (ptrdiff_t)within(y + 1, job->image_height) * job->image_stride;
    for (int c = 0; c < CHANNELS; c++) {
        const int32_t upper = (ONE - fx) * above[left + c] + fx * above[right + c];
        const int32_t lower = (ONE - fx) * below[left + c] + fx * below[right + c];
        out[c] = (uint8_t)(((ONE - fy) * upper + fy * lower + ONE * ONE / 2) / (ONE * ONE));
    }
}

#if defined(__SSE4_1__)
#include <immintrin.h>

#define GROUP 4

/* Both rows' 2 pixels and what lies behind them: 8 bytes of each. */
static inline __m128i four_pixels(const uint8_t *at, ptrdiff_t stride)
{
    const __m128i above = _mm_loadl_epi64((const __m128i *)(const void *)at);
    const __m128i below = _mm_loadl_epi64((const __m128i *)(const void *)(at + stride));
    return _mm_unpacklo_epi64(above, below);
}

static inline __m128i mixed(__m128i pixels, __m128i across, __m128i down)
{
    /* Of each channel: left and right of the upper row, then of the lower one. */
    const __m128i order = _mm_setr_epi8(0, 3, 8, 11, 1, 4, 9, 12, 2, 5, 10, 13, -1, -1, -1, -1);
    const __m128i rows = _mm_maddubs_epi16(_mm_shuffle_epi8(pixels, order), across);
    return _mm_srli_epi32(_mm_add_epi32(_mm_madd_epi16(rows, down), _mm_set1_epi32(ONE * ONE / 2)), 10);
}

/* Four neighbours, if all lie inside; writes 16 bytes, of which 12 count. */
static inline int one_group(const struct tandem_remap_job *job, size_t at, __m128i most, uint8_t *out)
{
    const __m128i places = _mm_loadu_si128((const __m128i *)(const void *)(job->places + 2 * at));
    if (_mm_movemask_epi8(_mm_cmpeq_epi16(_mm_min_epu16(places, most), places)) != 0xffff) {
        return 0; /* a negative one is a large one without its sign */
    }
    const __m128i both = _mm_cvtepu16_epi32(_mm_loadl_epi64((const __m128i *)(const void *)(job->fractions + at)));
    const __m128i fx = _mm_and_si128(both, _mm_set1_epi32(ONE - 1)), fy = _mm_srli_epi32(both, 5);
    /* Bytes 32 - fx, fx, twice; words 32 - fy, fy. */
    const __m128i once = _mm_or_si128(_mm_sub_epi32(_mm_set1_epi32(ONE), fx), _mm_slli_epi32(fx, 8));
    const __m128i across = _mm_or_si128(once, _mm_slli_epi32(once, 16));
    const __m128i down = _mm_or_si128(_mm_sub_epi32(_mm_set1_epi32(ONE), fy), _mm_slli_epi32(fy, 16));
    const ptrdiff_t stride = job->image_stride;
    const uint64_t front = (uint64_t)_mm_cvtsi128_si64(places), back = (uint64_t)_mm_extract_epi64(places, 1);
#define PLACE(word) (job->image + (ptrdiff_t)((word) >> 16 & 0xffff) * stride + (ptrdiff_t)((word)&0xffff) * CHANNELS)
    const __m128i a = mixed(four_pixels(PLACE(front), stride), _mm_shuffle_epi32(across, 0x00), _mm_shuffle_epi32(down, 0x00));
    const __m128i b = mixed(four_pixels(PLACE(front >> 32), stride), _mm_shuffle_epi32(across, 0x55), _mm_shuffle_epi32(down, 0x55));
    const __m128i c = mixed(four_pixels(PLACE(back), stride), _mm_shuffle_epi32(across, 0xaa), _mm_shuffle_epi32(down, 0xaa));
    const __m128i d = mixed(four_pixels(PLACE(back >> 32), stride), _mm_shuffle_epi32(across, 0xff), _mm_shuffle_epi32(down, 0xff));
#undef PLACE
    const __m128i all = _mm_packus_epi16(_mm_packus_epi32(a, b), _mm_packus_epi32(c, d));
    const __m128i packed = _mm_shuffle_epi8(all, _mm_setr_epi8(0, 1, 2, 4, 5, 6, 8, 9, 10, 12, 13, 14, -1, -1, -1, -1));
    _mm_storeu_si128((__m128i *)(void *)out, packed);
    return 1;
}

static size_t fast_pixels(const struct tandem_remap_job *job, size_t count)
{
    /* Two pixels beside each other and the 2 bytes behind them lie inside up to here. */
    if (job->image_width < 3 || job->image_height < 2) {
        return 0;
    }
    const __m128i most = _mm_set1_epi32((int32_t)((uint32_t)(job->image_height - 2) << 16 | (uint32_t)(job->image_width - 3)));
    size_t at = 0;
    for (; at + GROUP + 2 <= count; at += GROUP) { /* 16 bytes are written for 4 pixels: 2 more must follow */
        if (!one_group(job, at, most, job->out + at * CHANNELS)) {
            for (size_t i = at; i < at + GROUP; i++) {
                one_pixel(job, i, job->out + i * CHANNELS);
            }
        }
    }
    return at;
}
#else
static size_t fast_pixels(const struct tandem_remap_job *job, size_t count)
{
    (void)job;
    (void)count;
    return 0;
}
#endif

void ISA_NAME(remap)(struct tandem_remap_job *job)
{
    const size_t count = (size_t)job->out_pixels;
    for (size_t at = fast_pixels(job, count); at < count; at++) {
        one_pixel(job, at, job->out + at * CHANNELS);
    }
}
