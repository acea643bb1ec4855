/* Several int16 side by side.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef TANDEM_WORD_LANES_H
#define TANDEM_WORD_LANES_H

#include <stdint.h>
#include <string.h>

#if defined(TANDEM_IS_AVX512) || defined(TANDEM_IS_AVX2) || defined(TANDEM_IS_SSE41)
#include <immintrin.h>
#elif defined(TANDEM_IS_NEON)
#include <arm_neon.h>
#endif

#define WORDS_INLINE static inline __attribute__((always_inline))

#if defined(TANDEM_IS_AVX512)
#define WORDS 32
typedef __m512i words;
WORDS_INLINE words words_load(const int16_t *from) { return _mm512_loadu_si512(from); }
WORDS_INLINE void words_store(int16_t *to, words v) { _mm512_storeu_si512(to, v); }
WORDS_INLINE words words_min(words a, words b) { return _mm512_min_epi16(a, b); }
WORDS_INLINE words words_max(words a, words b) { return _mm512_max_epi16(a, b); }
#elif defined(TANDEM_IS_AVX2)
#define WORDS 16
typedef __m256i words;
WORDS_INLINE words words_load(const int16_t *from) { return _mm256_loadu_si256((const __m256i *)(const void *)from); }
WORDS_INLINE void words_store(int16_t *to, words v) { _mm256_storeu_si256((__m256i *)(void *)to, v); }
WORDS_INLINE words words_min(words a, words b) { return _mm256_min_epi16(a, b); }
WORDS_INLINE words words_max(words a, words b) { return _mm256_max_epi16(a, b); }
#elif defined(TANDEM_IS_SSE41)
#define WORDS 8
typedef __m128i words;
WORDS_INLINE words words_load(const int16_t *from) { return _mm_loadu_si128((const __m128i *)(const void *)from); }
WORDS_INLINE void words_store(int16_t *to, words v) { _mm_storeu_si128((__m128i *)(void *)to, v); }
WORDS_INLINE words words_min(words a, words b) { return _mm_min_epi16(a, b); }
WORDS_INLINE words words_max(words a, words b) { return _mm_max_epi16(a, b); }
#elif defined(TANDEM_IS_NEON)
#define WORDS 8
typedef int16x8_t words;
WORDS_INLINE words words_load(const int16_t *from) { return vld1q_s16(from); }
WORDS_INLINE void words_store(int16_t *to, words v) { vst1q_s16(to, v); }
WORDS_INLINE words words_min(words a, words b) { return vminq_s16(a, b); }
WORDS_INLINE words words_max(words a, words b) { return vmaxq_s16(a, b); }
#else
#define WORDS 1
typedef int16_t words;
WORDS_INLINE words words_load(const int16_t *from) { return *from; }
WORDS_INLINE void words_store(int16_t *to, words v) { *to = v; }
WORDS_INLINE words words_min(words a, words b) { return a < b ? a : b; }
WORDS_INLINE words words_max(words a, words b) { return a < b ? b : a; }
#endif

#endif
