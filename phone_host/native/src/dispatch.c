/* Which instruction sets were built, which of them this processor has, and the calls from Python.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <stddef.h>

#include "kernels.h"

#if defined(__arm__) && (defined(__linux__) || defined(__ANDROID__))
#include <sys/auxv.h>
#define HWCAP_OF_NEON (1UL << 12) /* Linux, arch/arm/include/uapi/asm/hwcap.h */
#endif

#ifndef TANDEM_SOURCES
#define TANDEM_SOURCES ""
#endif

#ifdef TANDEM_HAS_SSE41
extern const struct tandem_kernels tandem_kernels_sse41;
#endif
#ifdef TANDEM_HAS_AVX2
extern const struct tandem_kernels tandem_kernels_avx2;
#endif
#ifdef TANDEM_HAS_AVX512
extern const struct tandem_kernels tandem_kernels_avx512;
#endif
#ifdef TANDEM_HAS_NEON
extern const struct tandem_kernels tandem_kernels_neon;
#endif
extern const struct tandem_kernels tandem_kernels_scalar;

static const struct tandem_kernels *built(int32_t isa)
{
    switch (isa) {
    case TANDEM_SCALAR:
        return &tandem_kernels_scalar;
#ifdef TANDEM_HAS_SSE41
    case TANDEM_SSE41:
        return &tandem_kernels_sse41;
#endif
#ifdef TANDEM_HAS_AVX2
    case TANDEM_AVX2:
        return &tandem_kernels_avx2;
#endif
#ifdef TANDEM_HAS_AVX512
    case TANDEM_AVX512:
        return &tandem_kernels_avx512;
#endif
#ifdef TANDEM_HAS_NEON
    case TANDEM_NEON:
        return &tandem_kernels_neon;
#endif
    default:
        return NULL;
    }
}

/* The flags of each set in build_library.py name the same features. */
static int supported(int32_t isa)
{
#if defined(__x86_64__) || defined(__i386__)
    __builtin_cpu_init();
    switch (isa) {
    case TANDEM_SSE41:
        return __builtin_cpu_supports("sse4.1") && __builtin_cpu_supports("ssse3");
    case TANDEM_AVX2:
        return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2") &&
               __builtin_cpu_supports("popcnt");
    case TANDEM_AVX512:
        return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
               __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq") &&
               __builtin_cpu_supports("avx512vbmi") && __builtin_cpu_supports("avx512bitalg") && __builtin_cpu_supports("avx2") &&
               __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2") && __builtin_cpu_supports("popcnt");
    default:
        return isa == TANDEM_SCALAR;
    }
#elif defined(__arm__)
#if defined(__linux__) || defined(__ANDROID__)
    return isa == TANDEM_SCALAR || (isa == TANDEM_NEON && (getauxval(AT_HWCAP) & HWCAP_OF_NEON) != 0);
#else
    return isa == TANDEM_SCALAR;
#endif
#else
    return isa == TANDEM_SCALAR || isa == TANDEM_NEON; /* aarch64: part of the architecture */
#endif
}

const struct tandem_kernels *tandem_kernels_of(int32_t isa)
{
    return tandem_isa_state(isa) == TANDEM_USABLE ? built(isa) : NULL;
}

int32_t tandem_abi(void)
{
    return TANDEM_ABI;
}

const char *tandem_sources(void)
{
    return TANDEM_SOURCES;
}

const char *tandem_isa_name(int32_t isa)
{
    static const char *const names[TANDEM_ISA_COUNT] = {"scalar", "sse41", "avx2", "avx512", "neon"};
    return isa >= 0 && isa < TANDEM_ISA_COUNT ? names[isa] : NULL;
}

int32_t tandem_isa_state(int32_t isa)
{
    if (built(isa) == NULL) {
        return TANDEM_NOT_BUILT;
    }
    return supported(isa) ? TANDEM_USABLE : TANDEM_NOT_SUPPORTED;
}

int32_t tandem_isa_best(void)
{
    static const int32_t widest_first[] = {TANDEM_AVX512, TANDEM_AVX2, TANDEM_SSE41, TANDEM_NEON};
    for (size_t i = 0; i < sizeof widest_first / sizeof widest_first[0]; i++) {
        if (tandem_isa_state(widest_first[i]) == TANDEM_USABLE) {
            return widest_first[i];
        }
    }
    return TANDEM_SCALAR;
}

int32_t tandem_reproject(int32_t isa, struct tandem_reproject_job *job)
{
    const struct tandem_kernels *kernels = tandem_kernels_of(isa);
    if (kernels == NULL) {
        return TANDEM_NO_SUCH_ISA;
    }
    kernels->reproject(job);
    return TANDEM_DONE;
}

int32_t tandem_pack(int32_t isa, struct tandem_pack_job *job)
{
    const struct tandem_kernels *kernels = tandem_kernels_of(isa);
    if (kernels == NULL) {
        return TANDEM_NO_SUCH_ISA;
    }
    kernels->pack(job);
    return TANDEM_DONE;
}

int32_t tandem_remap(int32_t isa, struct tandem_remap_job *job)
{
    const struct tandem_kernels *kernels = tandem_kernels_of(isa);
    if (kernels == NULL) {
        return TANDEM_NO_SUCH_ISA;
    }
    kernels->remap(job);
    return TANDEM_DONE;
}
