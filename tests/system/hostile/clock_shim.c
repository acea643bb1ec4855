/* Steps CLOCK_MONOTONIC and CLOCK_BOOTTIME of one process: LD_PRELOAD this, with CLOCK_SHIM naming a file of two int64, the steps in ns.
 * The file is mapped: writing to it steps the clocks at once. Calls that wait until a time of the shifted clock get the kernel's time; calls that
 * wait for a duration (poll, select, futex) depend only on the kernel and need no change. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fcntl.h>
#include <pthread.h>
#include <semaphore.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#define SECOND 1000000000LL
#define NEVER_MONOTONIC 1000000000LL /* s: no machine runs for 31 years; a later deadline is on CLOCK_REALTIME */

static const int64_t *steps;

__attribute__((constructor)) static void begin(void) {
    const char *path = getenv("CLOCK_SHIM");
    int file = path ? open(path, O_RDONLY | O_CLOEXEC) : -1;
    if (file < 0) return;
    void *memory = mmap(NULL, 2 * sizeof *steps, PROT_READ, MAP_SHARED, file, 0);
    close(file);
    if (memory != MAP_FAILED) steps = memory;
}

static int64_t step_of(clockid_t clock) {
    if (!steps) return 0;
    if (clock == CLOCK_MONOTONIC || clock == CLOCK_MONOTONIC_RAW || clock == CLOCK_MONOTONIC_COARSE) return __atomic_load_n(steps, __ATOMIC_ACQUIRE);
    return clock == CLOCK_BOOTTIME ? __atomic_load_n(steps + 1, __ATOMIC_ACQUIRE) : 0;
}

static struct timespec moved(const struct timespec *time, int64_t by) {
    int64_t ns = time->tv_sec * SECOND + time->tv_nsec + by;
    if (ns < 0) ns = 0;
    return (struct timespec){ns / SECOND, ns % SECOND};
}

int clock_gettime(clockid_t clock, struct timespec *time) {
    static int (*real)(clockid_t, struct timespec *);
    if (!real) real = (int (*)(clockid_t, struct timespec *))dlsym(RTLD_NEXT, "clock_gettime");
    int failed = real(clock, time);
    int64_t step = failed ? 0 : step_of(clock);
    if (step) *time = moved(time, step);
    return failed;
}

int clock_nanosleep(clockid_t clock, int flags, const struct timespec *until, struct timespec *left) {
    static int (*real)(clockid_t, int, const struct timespec *, struct timespec *);
    if (!real) real = (int (*)(clockid_t, int, const struct timespec *, struct timespec *))dlsym(RTLD_NEXT, "clock_nanosleep");
    struct timespec kernels = *until;
    if (flags & TIMER_ABSTIME) kernels = moved(until, -step_of(clock));
    return real(clock, flags, &kernels, left);
}

int sem_clockwait(sem_t *semaphore, clockid_t clock, const struct timespec *until) {
    static int (*real)(sem_t *, clockid_t, const struct timespec *);
    if (!real) real = (int (*)(sem_t *, clockid_t, const struct timespec *))dlsym(RTLD_NEXT, "sem_clockwait");
    struct timespec kernels = moved(until, -step_of(clock));
    return real(semaphore, clock, &kernels);
}

int pthread_cond_clockwait(pthread_cond_t *condition, pthread_mutex_t *mutex, clockid_t clock, const struct timespec *until) {
    static int (*real)(pthread_cond_t *, pthread_mutex_t *, clockid_t, const struct timespec *);
    if (!real)
        real = (int (*)(pthread_cond_t *, pthread_mutex_t *, clockid_t, const struct timespec *))dlsym(RTLD_NEXT, "pthread_cond_clockwait");
    struct timespec kernels = moved(until, -step_of(clock));
    return real(condition, mutex, clock, &kernels);
}

int pthread_cond_timedwait(pthread_cond_t *condition, pthread_mutex_t *mutex, const struct timespec *until) {
    static int (*real)(pthread_cond_t *, pthread_mutex_t *, const struct timespec *);
    if (!real) real = (int (*)(pthread_cond_t *, pthread_mutex_t *, const struct timespec *))dlsym(RTLD_NEXT, "pthread_cond_timedwait");
    struct timespec kernels = until->tv_sec < NEVER_MONOTONIC ? moved(until, -step_of(CLOCK_MONOTONIC)) : *until;
    return real(condition, mutex, &kernels);
}
