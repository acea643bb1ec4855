/* The functions that are compiled once per instruction set, and the table that leads to them.
 *
 * To add one: give it a `typedef ... tandem_NAME_fn(...)` and a line in TANDEM_KERNELS, define it in a file NAME_kernel.c as
 * `... ISA_NAME(NAME)(...)`, name that file in PER_ISA of build_library.py, call it by `tandem_kernels_of(isa)->NAME`.
 *
 * The compiler is given -DTANDEM_ISA=avx512 (or avx2, sse41, neon, scalar) and -DTANDEM_IS_AVX512=1 (...) with the flags of that
 * set. A file may choose intrinsics by TANDEM_IS_...; without a choice the compiler vectorises what it can.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef TANDEM_KERNELS_H
#define TANDEM_KERNELS_H

#include <float.h>

#include "guide.h"
#include "match.h"
#include "support.h"
#include "tandem.h"

#if FLT_EVAL_METHOD != 0
#error "float32 must be computed as float32, or results differ between machines (x86: -mfpmath=sse)"
#endif
#if __BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__
#error "the records of a cloud are little endian; numpy does it elsewhere"
#endif

typedef void tandem_reproject_fn(struct tandem_reproject_job *job);
typedef void tandem_pack_fn(struct tandem_pack_job *job);
typedef void tandem_remap_fn(struct tandem_remap_job *job);
typedef void tandem_sweep_fn(const struct sweep *job);
typedef size_t tandem_sweep_scratch_fn(int width, int disparities);
typedef void tandem_check_rows_fn(const struct finish *job, int from, int to);
typedef void tandem_smooth_rows_fn(const struct finish *job, int from, int to);
typedef void tandem_vote_rows_fn(const struct vote *job, int from, int to);
typedef void tandem_guide_fn(const struct guide *job);
typedef size_t tandem_guide_scratch_fn(const struct guide *job);
typedef void tandem_support_smooth_rows_fn(const struct support *job, int from, int to, uint8_t *scratch);
typedef void tandem_support_cost_rows_fn(const struct support *job, int from, int to, uint8_t *scratch);
typedef void tandem_support_drop_rows_fn(const struct support *job, int from, int to);
typedef size_t tandem_support_scratch_fn(int width);
typedef void tandem_fuse_blocks_fn(const struct tandem_fuse_job *job, int32_t from, int32_t to);
typedef void tandem_carve_layer_fn(const struct tandem_carve_job *job, int32_t layer);
typedef void tandem_cast_row_fn(const struct tandem_cast_job *job, int32_t v);
typedef void tandem_cast_normals_fn(const struct tandem_cast_job *job, int32_t v);

#define TANDEM_KERNELS(KERNEL) \
    KERNEL(reproject)          \
    KERNEL(pack)               \
    KERNEL(remap)              \
    KERNEL(sweep)              \
    KERNEL(sweep_scratch)      \
    KERNEL(check_rows)         \
    KERNEL(smooth_rows)        \
    KERNEL(vote_rows)          \
    KERNEL(guide)              \
    KERNEL(guide_scratch)      \
    KERNEL(support_smooth_rows) \
    KERNEL(support_cost_rows)  \
    KERNEL(support_drop_rows)  \
    KERNEL(support_scratch)   \
    KERNEL(fuse_blocks)       \
    KERNEL(carve_layer)       \
    KERNEL(cast_row)          \
    KERNEL(cast_normals)

struct tandem_kernels {
#define TANDEM_FIELD(name) tandem_##name##_fn *name;
    TANDEM_KERNELS(TANDEM_FIELD)
#undef TANDEM_FIELD
};

/* NULL if the set is not built or this processor lacks it. */
const struct tandem_kernels *tandem_kernels_of(int32_t isa);

#ifdef TANDEM_ISA
#define TANDEM_PASTE_(name, isa) name##_##isa
#define TANDEM_PASTE(name, isa) TANDEM_PASTE_(name, isa)
#define ISA_NAME(name) TANDEM_PASTE(tandem_##name, TANDEM_ISA)
#define TANDEM_DECLARED(name) tandem_##name##_fn ISA_NAME(name);
TANDEM_KERNELS(TANDEM_DECLARED)
#undef TANDEM_DECLARED
#endif

#endif
