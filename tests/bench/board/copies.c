/* Counts large copies by caller, for bench_board: LD_PRELOAD=copies.so COPIES=FILE PROGRAM. On SIGUSR2 it writes the counts so far to FILE,
 * one line for each object that called memcpy or memmove with at least 4 KiB: `OBJECT CALLS BYTES`. It sees every such copy of a
 * program linked to libc, but neither the program's own loops nor copies by the kernel. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fcntl.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

enum { LEAST_BYTES = 4096, CALLERS = 64 };
static struct {
    _Atomic(uintptr_t) address;
    atomic_ulong calls;
    atomic_ullong bytes;
} callers[CALLERS];

static void count(void *from, size_t size) {
    if (size < LEAST_BYTES)
        return;
    uintptr_t address = (uintptr_t)from;
    for (int i = 0; i < CALLERS; i++) {
        uintptr_t known = 0;
        if (atomic_load(&callers[i].address) == address || atomic_compare_exchange_strong(&callers[i].address, &known, address) ||
            known == address) {
            atomic_fetch_add(&callers[i].calls, 1);
            atomic_fetch_add(&callers[i].bytes, size);
            return;
        }
    }
}

/* Word by word where both ends are aligned; the speed of a counted program does not matter. */
static void *move(void *to, const void *from, size_t size) {
    uint8_t *out = to;
    const uint8_t *in = from;
    if (out <= in || out >= in + size) {
        if ((((uintptr_t)out | (uintptr_t)in) & 3) == 0)
            for (; size >= 4; size -= 4, out += 4, in += 4)
                *(volatile uint32_t *)out = *(const uint32_t *)in;
        for (; size; size--)
            *(volatile uint8_t *)out++ = *in++;
    } else
        while (size--)
            ((volatile uint8_t *)out)[size] = in[size];
    return to;
}

void *memcpy(void *to, const void *from, size_t size) {
    count(__builtin_return_address(0), size);
    return move(to, from, size);
}

void *memmove(void *to, const void *from, size_t size) {
    count(__builtin_return_address(0), size);
    return move(to, from, size);
}

void *__memcpy_chk(void *to, const void *from, size_t size, size_t room) {
    if (size > room)
        abort();
    count(__builtin_return_address(0), size);
    return move(to, from, size);
}

void *__memmove_chk(void *to, const void *from, size_t size, size_t room) {
    if (size > room)
        abort();
    count(__builtin_return_address(0), size);
    return move(to, from, size);
}

static void tell(int number) {
    (void)number;
    int file = open(getenv("COPIES"), O_WRONLY | O_CREAT | O_TRUNC, 0644);
    for (int i = 0; file >= 0 && i < CALLERS && callers[i].address; i++) {
        Dl_info info;
        const char *name = dladdr((void *)callers[i].address, &info) && info.dli_fname ? info.dli_fname : "?";
        dprintf(file, "%s %lu %llu\n", name, (unsigned long)callers[i].calls, (unsigned long long)callers[i].bytes);
    }
    if (file >= 0)
        close(file);
}

__attribute__((constructor)) static void begin(void) { signal(SIGUSR2, tell); }
