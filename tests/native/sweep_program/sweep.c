/* Sweeps both views of a fixed pair, over and over, and prints a sum of the results: for tests/bench/match_instructions.py, which
 * counts what that takes on processors that are not here.
 *
 * Compiled with the -DTANDEM_ISA=... of the sweep kernel that it is linked with.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <stdio.h>
#include <stdlib.h>

#include "kernels.h"

/* A blurred noise, so that neighbours are alike as in images, and the same by a sensor with noise of its own. */
static void draw(uint8_t *left, uint8_t *right, int width, int height)
{
    enum { SHIFT = 19 };
    uint32_t state = 1;
    for (int y = 0; y < height; y++) {
        for (int x = 0; x < width; x++) {
            state = state * 1664525u + 1013904223u; /* Numerical Recipes' quick generator */
            const int fresh = (int)(state >> 24), before = x > 0 ? left[y * width + x - 1] : fresh;
            left[y * width + x] = (uint8_t)((fresh + before) / 2);
        }
        for (int x = 0; x < width; x++) {
            state = state * 1664525u + 1013904223u;
            const int from = x + SHIFT < width ? x + SHIFT : width - 1, noise = (int)(state >> 30);
            right[y * width + x] = (uint8_t)(left[y * width + from] / 2 + noise);
        }
    }
}

/* FNV-1a (Fowler, Noll and Vo), 32 bits. */
static uint32_t digest(uint32_t sum, const void *bytes, size_t size)
{
    for (size_t i = 0; i < size; i++) {
        sum = (sum ^ ((const uint8_t *)bytes)[i]) * 16777619u;
    }
    return sum;
}

int main(int argc, char **argv)
{
    if (argc != 5) {
        fputs("usage: sweep WIDTH HEIGHT DISPARITIES REPETITIONS\n", stderr);
        return 2;
    }
    const int width = atoi(argv[1]), height = atoi(argv[2]), disparities = atoi(argv[3]), repetitions = atoi(argv[4]);
    const size_t pixels = (size_t)width * (size_t)height;
    const size_t scratch = (ISA_NAME(sweep_scratch)(width, disparities) + 63) / 64 * 64;
    uint8_t *left = malloc(pixels), *right = malloc(pixels), *margin = malloc(pixels);
    int16_t *steps[2] = {malloc(2 * pixels), malloc(2 * pixels)};
    struct sweep sweep = {.width = width, .height = height, .disparities = disparities, .own_stride = width, .other_stride = width,
                          .row_step = 1, .rows = height, .begin = 0, .end = height, .margin = margin, .scratch = aligned_alloc(64, scratch)};
    if (left == NULL || right == NULL || margin == NULL || steps[0] == NULL || steps[1] == NULL || sweep.scratch == NULL) {
        fputs("error: no memory\n", stderr);
        return 1;
    }
    draw(left, right, width, height);
    for (int i = 0; i < 2 * repetitions; i++) {
        sweep.is_right = sweep.is_upward = i & 1;
        sweep.own = sweep.is_right ? right : left;
        sweep.other = sweep.is_right ? left : right;
        sweep.steps = steps[i & 1];
        ISA_NAME(sweep)(&sweep);
    }
    const uint32_t sum = digest(digest(digest(2166136261u, steps[0], 2 * pixels), steps[1], 2 * pixels), margin, pixels);
    printf("%08x\n", (unsigned)sum);
    return 0;
}
