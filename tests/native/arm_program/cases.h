/* Cases of the native library as bytes, so that a machine without Python can compute them: arm.py writes them, check.c reads them.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef TANDEM_CASES_H
#define TANDEM_CASES_H

#include <stdint.h>

#define MOST_FIELDS 24

struct field {
    uint64_t size;   /* bytes */
    uint8_t *bytes;  /* in memory of its own of just that size, so that a sanitizer sees what lies outside */
};

struct one_case {
    uint32_t kind;
    uint32_t fields;
    struct field field[MOST_FIELDS];
};

/* Each computes a case with an instruction set; returns the number of the first expected field that differs, or -1. */
typedef int check_fn(int32_t isa, const struct one_case *asked);
check_fn check_points, check_records, check_remap, check_match;

/* Whether a result is what a field says, in every bit. */
int same_bytes(const void *result, uint64_t size, const struct field *expected);

#endif
