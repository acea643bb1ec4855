/* What the library offers to Python (library.py and volume_jobs.py declare the same). Plain C11, no global state.
 *
 * Rules:
 * - every function that is compiled per instruction set takes it as its first argument and gives the same bits for all of them:
 *   IEEE float32 in the stated order, no contraction, no reordering;
 * - lengths and strides are checked by the Python side (one place per function), pointers are never kept;
 * - nothing here prints, exits or throws.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef TANDEM_H
#define TANDEM_H

#include <stdint.h>

#define TANDEM_API __attribute__((visibility("default")))

/* Raise it, here and in library.py, when a signature or a struct changes. */
#define TANDEM_ABI 4

/* Instruction sets, from the plainest. The numbers are part of the ABI, isa_name() their names for people. */
enum tandem_isa {
    TANDEM_SCALAR = 0,
    TANDEM_SSE41 = 1,
    TANDEM_AVX2 = 2,
    TANDEM_AVX512 = 3,
    TANDEM_NEON = 4,
    TANDEM_ISA_COUNT = 5
};

enum tandem_isa_state {
    TANDEM_USABLE = 0,
    TANDEM_NOT_BUILT = 1,    /* the compiler has no such flags, or this is another architecture */
    TANDEM_NOT_SUPPORTED = 2 /* built, but this processor lacks it */
};

TANDEM_API int32_t tandem_abi(void);
TANDEM_API const char *tandem_sources(void); /* digest of the sources it was built from */
TANDEM_API const char *tandem_isa_name(int32_t isa); /* NULL beyond the last */
TANDEM_API int32_t tandem_isa_state(int32_t isa);
TANDEM_API int32_t tandem_isa_best(void); /* the widest that is usable */

/* From disparities to points, cut to the limits; see reproject_kernel.c. */
struct tandem_reproject_job {
    const float *disparity_px;  /* (height, width), rows `disparity_stride` floats apart, NaN = none */
    const float *column_slopes; /* (width,) (u - cx) / f */
    const float *row_slopes;    /* (height,) (v - cy) / f */
    float *cloud_m;             /* (height, width, 3), packed; written */
    int64_t disparity_stride;
    int32_t width;
    int32_t height;
    float doffs_px;
    float product;     /* f b, px m */
    float least_px;    /* d + doffs at or below it is behind infinity */
    float at_zero_px;  /* d at or below it cannot be told from infinity */
    float far_m;       /* coordinates at or beyond it are cut */
    float near_m;      /* depths below it are cut; 0: none */
    int32_t wide;      /* 1: |x| and |y| are compared with far_m, too */
    int32_t reserved;
    int64_t found;     /* written: disparities that are finite */
    int64_t at_zero;   /* written: disparities dropped by at_zero_px */
    int64_t in_front;  /* written: points before the cut */
    int64_t too_far;   /* written */
    int64_t too_near;  /* written */
};

TANDEM_API int32_t tandem_reproject(int32_t isa, struct tandem_reproject_job *job);

/* Finite points as records of 15 bytes: x y z float32, red green blue uint8; see pack_kernel.c. */
struct tandem_pack_job {
    const float *cloud_m;     /* (height, width, 3), rows `cloud_stride` floats apart, NaN = none */
    const uint8_t *colours;   /* (height, width, channels) grey or BGR, rows `colour_stride` bytes apart */
    uint8_t *records;         /* room for height * width + 1 records; written from its beginning */
    int64_t cloud_stride;
    int64_t colour_stride;
    int32_t width;
    int32_t height;
    int32_t channels;         /* 1 or 3 */
    uint8_t flips[3];         /* 1: x, y or z changes its sign */
    uint8_t reserved;
    int64_t count;            /* written: records */
};

TANDEM_API int32_t tandem_pack(int32_t isa, struct tandem_pack_job *job);

/* A coloured image through a map of OpenCV's kind; see remap_kernel.c. */
struct tandem_remap_job {
    const uint8_t *image;      /* (image_height, image_width, 3), rows `image_stride` bytes apart */
    const int16_t *places;     /* (out_pixels, 2): x and y of the upper left of 2 x 2 pixels, px */
    const uint16_t *fractions; /* (out_pixels,): 32 fy + fx, 1/32 px */
    uint8_t *out;              /* (out_pixels, 3); written */
    int64_t image_stride;
    int64_t out_pixels;
    int32_t image_width;       /* at least 1, at most 32767 */
    int32_t image_height;
};

TANDEM_API int32_t tandem_remap(int32_t isa, struct tandem_remap_job *job);

/* Disparities of a rectified pair; see match.c. */
struct tandem_match_job {
    const uint8_t *left;     /* (height, width) grey, rows `left_stride` bytes apart (it may be negative) */
    const uint8_t *right;
    int64_t left_stride;
    int64_t right_stride;
    float *disparity;        /* (height, width), packed; written: px, NAN = none */
    uint8_t *confidence;     /* (height, width), packed; written: 0 = none, 255 = best */
    uint8_t *workspace;      /* tandem_match_bytes() bytes */
    int64_t workspace_bytes;
    int32_t width;
    int32_t height;
    int32_t disparities;     /* 0 <= d < disparities */
    int32_t threads;         /* results do not depend on it */
    int32_t guide;           /* 1: what the images do not support is dropped, and surfaces are completed (support.h); 0: neither */
    int32_t reserved;
};

TANDEM_API int64_t tandem_match_bytes(int32_t isa, const struct tandem_match_job *job); /* of the workspace; -1: no such set, or a size that tandem_match refuses: sides of 1 to 32767 px, 1 to 2048 disparities */
TANDEM_API int32_t tandem_match(int32_t isa, struct tandem_match_job *job);

/* A distance field in blocks; see volume.h. The caller owns the arrays. */
struct tandem_volume {
    int32_t *slots;      /* (slot_count,) number of a block + 1, 0 = free */
    int32_t *places;     /* (room, 3) of the blocks, in blocks */
    int16_t *field;      /* (room, 512) distance in truncations, 32000 = 1, positive before the surface */
    uint16_t *weights;   /* (room, 512), 0 = nothing was seen */
    uint8_t *colours;    /* (room, 512, 3) BGR */
    int64_t slot_count;  /* a power of 2, at least 2 room */
    int32_t room;        /* blocks that the arrays hold */
    int32_t count;       /* blocks in use; tandem_touch adds some */
    float voxel_m;
    float truncation_m;
};

/* Blocks where a depth image shows a surface; see volume.c. */
struct tandem_touch_job {
    struct tandem_volume *volume;
    const float *depth_m;      /* (height, width), packed, NAN = none */
    float world_camera[12];    /* 3 rows of rotation and translation, m */
    int32_t width;
    int32_t height;
    float focal_px;
    float cx_px;
    float cy_px;
    float far_m;
    int32_t step;              /* of the pixels that are looked at */
    int32_t reserved;
    int64_t missing;           /* written: blocks for which there was no room, the same one perhaps several times */
};

TANDEM_API int32_t tandem_touch(struct tandem_touch_job *job);

/* A depth image into all blocks; see fuse_kernel.c. */
struct tandem_fuse_job {
    const struct tandem_volume *volume;
    const float *depth_m;      /* (height, width), packed, NAN = none */
    const uint8_t *colours;    /* (height, width, 3) BGR, packed */
    uint8_t *changed;          /* (count,) written: 1 where the block got something */
    float camera_world[12];
    int32_t width;
    int32_t height;
    float focal_px;
    float cx_px;
    float cy_px;
    float far_m;
    float noise_per_m;         /* of a depth 1 m away; it grows with the depth squared */
    float sure_m;              /* a depth with this noise or less has the full weight */
    float weight_one;          /* the full weight */
    int32_t most_weight;       /* at which a voxel's weight stays */
    int32_t threads;           /* results do not depend on it */
    int32_t reserved;
};

TANDEM_API int32_t tandem_fuse(int32_t isa, struct tandem_fuse_job *job);

/* The surface as a camera sees it; see cast_kernel.c. */
struct tandem_cast_job {
    const struct tandem_volume *volume;
    const float *seeds_m;      /* (height, width) near which the surface is looked for, packed, NAN = none; NULL: none at all */
    float *points_m;           /* (height, width, 3), packed; written: in the camera's axes, NAN = none */
    float *normals;            /* (height, width, 3), packed; written: towards the camera, NAN = none */
    float world_camera[12];
    int32_t width;
    int32_t height;
    float focal_px;
    float cx_px;
    float cy_px;
    float near_m;
    float far_m;
    int32_t search;            /* 1: rays without a seed are searched from near_m to far_m */
    int32_t threads;           /* results do not depend on it */
    int32_t reserved;
};

TANDEM_API int32_t tandem_cast(int32_t isa, struct tandem_cast_job *job);

/* Where a camera looked through a grid of cells, and where it could not; see carve_kernel.c. */
struct tandem_carve_job {
    uint8_t *looked_through;   /* (z, y, x) views that measured something clearly beyond the cell, 255 = that or more */
    uint8_t *hidden;           /* (z, y, x) views that measured something clearly before it */
    uint8_t *blank;            /* (z, y, x) views that have no depth there */
    const float *depth_m;      /* (height, width), packed, NAN = none, infinite = nothing is there */
    float camera_world[12];
    int32_t counts[3];         /* cells along x, y, z */
    float low_m[3];            /* middle of the first one */
    float cell_m;              /* from middle to middle */
    int32_t width;
    int32_t height;
    float focal_px;
    float cx_px;
    float cy_px;
    float noise_per_m;
    float sigmas;              /* "clearly" is so many standard deviations of the depth */
    float clear_m;             /* and this */
    int32_t threads;           /* results do not depend on it */
};

TANDEM_API int32_t tandem_carve(int32_t isa, struct tandem_carve_job *job);

/* How a depth image lies against such a surface; see register.c. */
struct tandem_register_job {
    const float *depth_m;      /* (height, width), packed, NAN = none */
    const float *points_m;     /* (height, width, 3), as tandem_cast writes them */
    const float *normals;
    double *sums;              /* (rows, 31); written: 21 of the upper triangle, 6 of the right side, partners within 3 sigma, sum of |distance|, partners, pixels in view */
    float model_camera[12];    /* takes the depth's points to the axes of the surface */
    int32_t width;
    int32_t height;
    float focal_px;
    float cx_px;
    float cy_px;
    float most_m;              /* partners lie no farther apart */
    float floor_m;             /* least noise of a distance */
    float noise_per_m;
    float huber_sigmas;
    int32_t step;              /* of the pixels that are looked at: rows = ceil(height / step) */
    int32_t threads;           /* results do not depend on it */
    int32_t reserved;
};

TANDEM_API int32_t tandem_register(struct tandem_register_job *job);

/* A field taken into another at a rigid motion; see absorb.c. */
struct tandem_absorb_job {
    const struct tandem_volume *into; /* its blocks are there already; their values change */
    const struct tandem_volume *of;   /* its voxels are as wide */
    uint8_t *chosen;                  /* (count of into): 1: the block is looked at; written: whether it got something */
    double of_into[12];               /* takes voxels of the one to voxels of the other */
    int32_t most_weight;
    int32_t threads;                  /* results do not depend on it */
};

TANDEM_API int32_t tandem_absorb(struct tandem_absorb_job *job);

/* What these functions return. */
enum tandem_result {
    TANDEM_DONE = 0,
    TANDEM_NO_SUCH_ISA = 1,
    TANDEM_BAD_SIZE = 2,
    TANDEM_NO_ROOM = 3
};

#endif
