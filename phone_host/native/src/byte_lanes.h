/* Several bytes side by side: one register of path costs, one lane a disparity.
 *
 * Each instruction set gives the same results; only the number of lanes differs. Lanes beyond the last disparity cost so much
 * that they never win and never change a neighbour: so results do not depend on the number of lanes.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef TANDEM_BYTE_LANES_H
#define TANDEM_BYTE_LANES_H

#include <stdint.h>
#include <string.h>

#if defined(TANDEM_IS_AVX512) || defined(TANDEM_IS_AVX2) || defined(TANDEM_IS_SSE41)
#include <immintrin.h>
#elif defined(TANDEM_IS_NEON)
#include <arm_neon.h>
#endif

#define BYTES_INLINE static inline __attribute__((always_inline))

#if defined(TANDEM_IS_AVX512) || defined(TANDEM_IS_AVX2)
/* Write the least lanes of four registers, found together: a third of the instructions of finding them one by one. */
BYTES_INLINE void least_of_four_halves(const __m256i *v, uint8_t *least)
{
    const __m256i a = _mm256_min_epu8(_mm256_permute2x128_si256(v[0], v[1], 0x21), _mm256_blend_epi32(v[0], v[1], 0xf0));
    const __m256i b = _mm256_min_epu8(_mm256_permute2x128_si256(v[2], v[3], 0x21), _mm256_blend_epi32(v[2], v[3], 0xf0));
    const __m256i eights = _mm256_min_epu8(_mm256_unpacklo_epi64(a, b), _mm256_unpackhi_epi64(a, b)); /* of 0 2, 1 3 */
    const __m128 low = _mm_castsi128_ps(_mm256_castsi256_si128(eights));
    const __m128 high = _mm_castsi128_ps(_mm256_extracti128_si256(eights, 1));
    __m128i fours = _mm_min_epu8(_mm_castps_si128(_mm_shuffle_ps(low, high, 0x88)), _mm_castps_si128(_mm_shuffle_ps(low, high, 0xdd)));
    fours = _mm_min_epu8(fours, _mm_srli_epi32(fours, 16));
    fours = _mm_min_epu8(fours, _mm_srli_epi32(fours, 8));
    const int packed = _mm_cvtsi128_si32(_mm_shuffle_epi8(fours, _mm_cvtsi32_si128(0x0c040800)));
    memcpy(least, &packed, 4);
}
#endif

#if defined(TANDEM_IS_AVX512)

#define BYTES 64
typedef __m512i bytes;
BYTES_INLINE bytes bytes_load(const uint8_t *from) { return _mm512_loadu_si512(from); }
BYTES_INLINE void bytes_store(uint8_t *to, bytes v) { _mm512_storeu_si512(to, v); }
BYTES_INLINE bytes bytes_of(uint8_t value) { return _mm512_set1_epi8((char)value); }
BYTES_INLINE bytes bytes_min(bytes a, bytes b) { return _mm512_min_epu8(a, b); }
BYTES_INLINE bytes bytes_max(bytes a, bytes b) { return _mm512_max_epu8(a, b); }
BYTES_INLINE bytes bytes_plus(bytes a, bytes b) { return _mm512_adds_epu8(a, b); }
BYTES_INLINE bytes bytes_minus(bytes a, bytes b) { return _mm512_subs_epu8(a, b); }
BYTES_INLINE bytes bytes_add(bytes a, bytes b) { return _mm512_add_epi8(a, b); }
BYTES_INLINE bytes bytes_sub(bytes a, bytes b) { return _mm512_sub_epi8(a, b); }
BYTES_INLINE bytes bytes_xor(bytes a, bytes b) { return _mm512_xor_si512(a, b); }
BYTES_INLINE bytes bytes_half(bytes v) { return _mm512_and_si512(_mm512_srli_epi16(v, 1), _mm512_set1_epi8(127)); }
/* Lane i gets lane i - 1; lane 0 gets the last one of the chunk below. */
BYTES_INLINE bytes bytes_from_below(bytes v, bytes below)
{
    const __m512i order = _mm512_add_epi8(_mm512_set_epi8(63,62,61,60,59,58,57,56,55,54,53,52,51,50,49,48,47,46,45,44,43,42,41,40,39,38,37,36,35,34,33,32,31,30,29,28,27,26,25,24,23,22,21,20,19,18,17,16,15,14,13,12,11,10,9,8,7,6,5,4,3,2,1,0),_mm512_set1_epi8(63));
    return _mm512_permutex2var_epi8(below, order, v);
}
/* Lane i gets lane i + 1; the last lane gets lane 0 of the chunk above. */
BYTES_INLINE bytes bytes_from_above(bytes v, bytes above)
{
    const __m512i order = _mm512_set_epi8(64,63,62,61,60,59,58,57,56,55,54,53,52,51,50,49,48,47,46,45,44,43,42,41,40,39,38,37,36,35,34,33,32,31,30,29,28,27,26,25,24,23,22,21,20,19,18,17,16,15,14,13,12,11,10,9,8,7,6,5,4,3,2,1);
    return _mm512_permutex2var_epi8(v, order, above);
}
/* Lane i is table[v[i]]; each v[i] is below 16. */
BYTES_INLINE bytes bytes_of_table(const uint8_t table[16], bytes v)
{
    return _mm512_shuffle_epi8(_mm512_broadcast_i32x4(_mm_loadu_si128((const __m128i *)(const void *)table)), v);
}
/* The number of bits that are set in each lane. */
BYTES_INLINE bytes bytes_ones(bytes v)
{
    return _mm512_popcnt_epi8(v);
}
/* Write the least lanes of four registers. */
BYTES_INLINE void least_of_four(const bytes *v, uint8_t *least)
{
    __m256i half[4];
    for (int i = 0; i < 4; i++) {
        half[i] = _mm256_min_epu8(_mm512_castsi512_si256(v[i]), _mm512_extracti64x4_epi64(v[i], 1));
    }
    least_of_four_halves(half, least);
}
/* The first lane that equals `value`; BYTES if none does. */
BYTES_INLINE int bytes_find(bytes v, bytes value)
{
    return (int)_tzcnt_u64(_mm512_cmpeq_epi8_mask(v, value));
}

#elif defined(TANDEM_IS_AVX2)

#define BYTES 32
typedef __m256i bytes;
BYTES_INLINE bytes bytes_load(const uint8_t *from) { return _mm256_loadu_si256((const __m256i *)(const void *)from); }
BYTES_INLINE void bytes_store(uint8_t *to, bytes v) { _mm256_storeu_si256((__m256i *)(void *)to, v); }
BYTES_INLINE bytes bytes_of(uint8_t value) { return _mm256_set1_epi8((char)value); }
BYTES_INLINE bytes bytes_min(bytes a, bytes b) { return _mm256_min_epu8(a, b); }
BYTES_INLINE bytes bytes_max(bytes a, bytes b) { return _mm256_max_epu8(a, b); }
BYTES_INLINE bytes bytes_plus(bytes a, bytes b) { return _mm256_adds_epu8(a, b); }
BYTES_INLINE bytes bytes_minus(bytes a, bytes b) { return _mm256_subs_epu8(a, b); }
BYTES_INLINE bytes bytes_add(bytes a, bytes b) { return _mm256_add_epi8(a, b); }
BYTES_INLINE bytes bytes_sub(bytes a, bytes b) { return _mm256_sub_epi8(a, b); }
BYTES_INLINE bytes bytes_xor(bytes a, bytes b) { return _mm256_xor_si256(a, b); }
BYTES_INLINE bytes bytes_half(bytes v) { return _mm256_and_si256(_mm256_srli_epi16(v, 1), _mm256_set1_epi8(127)); }
BYTES_INLINE bytes bytes_from_below(bytes v, bytes below)
{
    return _mm256_alignr_epi8(v, _mm256_permute2x128_si256(below, v, 0x21), 15);
}
BYTES_INLINE bytes bytes_from_above(bytes v, bytes above)
{
    return _mm256_alignr_epi8(_mm256_permute2x128_si256(v, above, 0x21), v, 1);
}
BYTES_INLINE bytes bytes_of_table(const uint8_t table[16], bytes v)
{
    return _mm256_shuffle_epi8(_mm256_broadcastsi128_si256(_mm_loadu_si128((const __m128i *)(const void *)table)), v);
}
BYTES_INLINE bytes bytes_ones(bytes v)
{
    const __m256i table = _mm256_broadcastsi128_si256(_mm_setr_epi8(0, 1, 1, 2, 1, 2, 2, 3, 1, 2, 2, 3, 2, 3, 3, 4));
    const __m256i nibble = _mm256_set1_epi8(15);
    const __m256i low = _mm256_shuffle_epi8(table, _mm256_and_si256(v, nibble));
    const __m256i high = _mm256_shuffle_epi8(table, _mm256_and_si256(_mm256_srli_epi16(v, 4), nibble));
    return _mm256_add_epi8(low, high);
}
BYTES_INLINE void least_of_four(const bytes *v, uint8_t *least) { least_of_four_halves(v, least); }
BYTES_INLINE int bytes_find(bytes v, bytes value)
{
    return (int)_tzcnt_u32((uint32_t)_mm256_movemask_epi8(_mm256_cmpeq_epi8(v, value)));
}

#elif defined(TANDEM_IS_SSE41)

#define BYTES 16
typedef __m128i bytes;
BYTES_INLINE bytes bytes_load(const uint8_t *from) { return _mm_loadu_si128((const __m128i *)(const void *)from); }
BYTES_INLINE void bytes_store(uint8_t *to, bytes v) { _mm_storeu_si128((__m128i *)(void *)to, v); }
BYTES_INLINE bytes bytes_of(uint8_t value) { return _mm_set1_epi8((char)value); }
BYTES_INLINE bytes bytes_min(bytes a, bytes b) { return _mm_min_epu8(a, b); }
BYTES_INLINE bytes bytes_max(bytes a, bytes b) { return _mm_max_epu8(a, b); }
BYTES_INLINE bytes bytes_plus(bytes a, bytes b) { return _mm_adds_epu8(a, b); }
BYTES_INLINE bytes bytes_minus(bytes a, bytes b) { return _mm_subs_epu8(a, b); }
BYTES_INLINE bytes bytes_add(bytes a, bytes b) { return _mm_add_epi8(a, b); }
BYTES_INLINE bytes bytes_sub(bytes a, bytes b) { return _mm_sub_epi8(a, b); }
BYTES_INLINE bytes bytes_xor(bytes a, bytes b) { return _mm_xor_si128(a, b); }
BYTES_INLINE bytes bytes_half(bytes v) { return _mm_and_si128(_mm_srli_epi16(v, 1), _mm_set1_epi8(127)); }
BYTES_INLINE bytes bytes_from_below(bytes v, bytes below) { return _mm_alignr_epi8(v, below, 15); }
BYTES_INLINE bytes bytes_from_above(bytes v, bytes above) { return _mm_alignr_epi8(above, v, 1); }
BYTES_INLINE bytes bytes_of_table(const uint8_t table[16], bytes v) { return _mm_shuffle_epi8(bytes_load(table), v); }
BYTES_INLINE bytes bytes_ones(bytes v)
{
    const __m128i table = _mm_setr_epi8(0, 1, 1, 2, 1, 2, 2, 3, 1, 2, 2, 3, 2, 3, 3, 4);
    const __m128i nibble = _mm_set1_epi8(15);
    const __m128i low = _mm_shuffle_epi8(table, _mm_and_si128(v, nibble));
    const __m128i high = _mm_shuffle_epi8(table, _mm_and_si128(_mm_srli_epi16(v, 4), nibble));
    return _mm_add_epi8(low, high);
}
BYTES_INLINE __m128i bytes_minpos(bytes v) { return _mm_minpos_epu16(_mm_min_epu8(v, _mm_srli_epi16(v, 8))); }
BYTES_INLINE void least_of_four(const bytes *v, uint8_t *least)
{
    const __m128i pairs = _mm_unpacklo_epi8(bytes_minpos(v[0]), bytes_minpos(v[1]));
    const __m128i others = _mm_unpacklo_epi8(bytes_minpos(v[2]), bytes_minpos(v[3]));
    const int packed = _mm_cvtsi128_si32(_mm_unpacklo_epi16(pairs, others));
    memcpy(least, &packed, 4);
}
BYTES_INLINE int bytes_find(bytes v, bytes value)
{
    return __builtin_ctz((unsigned)_mm_movemask_epi8(_mm_cmpeq_epi8(v, value)) | 1u << BYTES);
}

#elif defined(TANDEM_IS_NEON)

#define BYTES 16
typedef uint8x16_t bytes;
BYTES_INLINE bytes bytes_load(const uint8_t *from) { return vld1q_u8(from); }
BYTES_INLINE void bytes_store(uint8_t *to, bytes v) { vst1q_u8(to, v); }
BYTES_INLINE bytes bytes_of(uint8_t value) { return vdupq_n_u8(value); }
BYTES_INLINE bytes bytes_min(bytes a, bytes b) { return vminq_u8(a, b); }
BYTES_INLINE bytes bytes_max(bytes a, bytes b) { return vmaxq_u8(a, b); }
BYTES_INLINE bytes bytes_plus(bytes a, bytes b) { return vqaddq_u8(a, b); }
BYTES_INLINE bytes bytes_minus(bytes a, bytes b) { return vqsubq_u8(a, b); }
BYTES_INLINE bytes bytes_add(bytes a, bytes b) { return vaddq_u8(a, b); }
BYTES_INLINE bytes bytes_sub(bytes a, bytes b) { return vsubq_u8(a, b); }
BYTES_INLINE bytes bytes_xor(bytes a, bytes b) { return veorq_u8(a, b); }
BYTES_INLINE bytes bytes_half(bytes v) { return vshrq_n_u8(v, 1); }
BYTES_INLINE bytes bytes_from_below(bytes v, bytes below) { return vextq_u8(below, v, 15); }
BYTES_INLINE bytes bytes_from_above(bytes v, bytes above) { return vextq_u8(v, above, 1); }
BYTES_INLINE bytes bytes_ones(bytes v) { return vcntq_u8(v); }
BYTES_INLINE bytes bytes_of_table(const uint8_t table[16], bytes v)
{
    const uint8x8x2_t halves = {{vld1_u8(table), vld1_u8(table + 8)}};
    return vcombine_u8(vtbl2_u8(halves, vget_low_u8(v)), vtbl2_u8(halves, vget_high_u8(v)));
}
BYTES_INLINE void least_of_four(const bytes *v, uint8_t *least)
{
    uint8x8_t half[4];
    for (int i = 0; i < 4; i++) {
        half[i] = vpmin_u8(vget_low_u8(v[i]), vget_high_u8(v[i]));
    }
    const uint8x8_t fours = vpmin_u8(vpmin_u8(half[0], half[1]), vpmin_u8(half[2], half[3]));
    const uint32_t packed = vget_lane_u32(vreinterpret_u32_u8(vpmin_u8(fours, fours)), 0);
    memcpy(least, &packed, 4);
}
BYTES_INLINE int bytes_find(bytes v, bytes value)
{
    const uint8x8_t nibbles = vshrn_n_u16(vreinterpretq_u16_u8(vceqq_u8(v, value)), 4);
    const uint64_t equal = vget_lane_u64(vreinterpret_u64_u8(nibbles), 0);
    return equal == 0 ? BYTES : (int)(__builtin_ctzll(equal) >> 2);
}

#else

#define BYTES 16
typedef struct {
    uint8_t lane[BYTES];
} bytes;
#define BYTES_EACH(expression)          \
    bytes r;                            \
    for (int i = 0; i < BYTES; i++) {   \
        r.lane[i] = (uint8_t)(expression); \
    }                                   \
    return r
BYTES_INLINE bytes bytes_load(const uint8_t *from) { BYTES_EACH(from[i]); }
BYTES_INLINE void bytes_store(uint8_t *to, bytes v) { memcpy(to, v.lane, BYTES); }
BYTES_INLINE bytes bytes_of(uint8_t value) { BYTES_EACH(value); }
BYTES_INLINE bytes bytes_min(bytes a, bytes b) { BYTES_EACH(a.lane[i] < b.lane[i] ? a.lane[i] : b.lane[i]); }
BYTES_INLINE bytes bytes_max(bytes a, bytes b) { BYTES_EACH(a.lane[i] > b.lane[i] ? a.lane[i] : b.lane[i]); }
BYTES_INLINE bytes bytes_plus(bytes a, bytes b)
{
    BYTES_EACH(a.lane[i] + b.lane[i] > 255 ? 255 : a.lane[i] + b.lane[i]);
}
BYTES_INLINE bytes bytes_minus(bytes a, bytes b) { BYTES_EACH(a.lane[i] > b.lane[i] ? a.lane[i] - b.lane[i] : 0); }
BYTES_INLINE bytes bytes_add(bytes a, bytes b) { BYTES_EACH(a.lane[i] + b.lane[i]); }
BYTES_INLINE bytes bytes_sub(bytes a, bytes b) { BYTES_EACH(a.lane[i] - b.lane[i]); }
BYTES_INLINE bytes bytes_xor(bytes a, bytes b) { BYTES_EACH(a.lane[i] ^ b.lane[i]); }
BYTES_INLINE bytes bytes_half(bytes v) { BYTES_EACH(v.lane[i] >> 1); }
BYTES_INLINE bytes bytes_from_below(bytes v, bytes below) { BYTES_EACH(i > 0 ? v.lane[i - 1] : below.lane[BYTES - 1]); }
BYTES_INLINE bytes bytes_from_above(bytes v, bytes above) { BYTES_EACH(i < BYTES - 1 ? v.lane[i + 1] : above.lane[0]); }
BYTES_INLINE bytes bytes_of_table(const uint8_t table[16], bytes v) { BYTES_EACH(table[v.lane[i]]); }
BYTES_INLINE bytes bytes_ones(bytes v) { BYTES_EACH(__builtin_popcount(v.lane[i])); }
BYTES_INLINE void least_of_four(const bytes *v, uint8_t *least)
{
    for (int i = 0; i < 4; i++) {
        least[i] = 255;
        for (int lane = 0; lane < BYTES; lane++) {
            least[i] = v[i].lane[lane] < least[i] ? v[i].lane[lane] : least[i];
        }
    }
}
BYTES_INLINE int bytes_find(bytes v, bytes value)
{
    for (int i = 0; i < BYTES; i++) {
        if (v.lane[i] == value.lane[i]) {
            return i;
        }
    }
    return BYTES;
}

#endif

#endif
