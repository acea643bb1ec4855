/* SPDX-License-Identifier: Apache-2.0 */
#include "crew.h"

#include <pthread.h>
#include <sched.h>
#include <stdatomic.h>
#include <stddef.h>

enum { PATIENCE = 200 }; /* looks before a thread that waits for the others goes to sleep: steps end at nearly the same time */

struct crew {
    void *context;
    crew_tasks_fn *tasks_of;
    crew_task_fn *do_task;
    int steps;
    pthread_mutex_t lock;
    pthread_cond_t all_done;
    int threads;         /* guarded by lock until all are known */
    atomic_int next[MOST_STEPS];
    atomic_int working;  /* threads that have not ended the step yet */
    atomic_int step;     /* the step that is worked on */
    atomic_int hired;    /* numbers the threads */
};

static void await_others(struct crew *crew, int step)
{
    if (atomic_fetch_sub(&crew->working, 1) == 1) {
        pthread_mutex_lock(&crew->lock);
        atomic_store(&crew->working, crew->threads);
        atomic_store(&crew->step, step + 1);
        pthread_cond_broadcast(&crew->all_done);
        pthread_mutex_unlock(&crew->lock);
        return;
    }
    for (int i = 0; i < PATIENCE; i++) {
        if (atomic_load(&crew->step) > step) {
            return;
        }
        sched_yield();
    }
    pthread_mutex_lock(&crew->lock);
    while (atomic_load(&crew->step) <= step) {
        pthread_cond_wait(&crew->all_done, &crew->lock);
    }
    pthread_mutex_unlock(&crew->lock);
}

static void *work(void *argument)
{
    struct crew *crew = argument;
    pthread_mutex_lock(&crew->lock); /* until the number of threads is known */
    pthread_mutex_unlock(&crew->lock);
    const int thread = atomic_fetch_add(&crew->hired, 1);
    for (int step = 0; step < crew->steps; step++) {
        const int tasks = crew->tasks_of(crew->context, step);
        for (int task = atomic_fetch_add(&crew->next[step], 1); task < tasks; task = atomic_fetch_add(&crew->next[step], 1)) {
            crew->do_task(crew->context, step, task, thread);
        }
        await_others(crew, step);
    }
    return NULL;
}

void crew_works(void *context, int steps, int threads, crew_tasks_fn *tasks_of, crew_task_fn *do_task)
{
    struct crew crew = {.context = context, .tasks_of = tasks_of, .do_task = do_task, .steps = steps, .threads = 1};
    pthread_t others[MOST_THREADS];
    pthread_mutex_init(&crew.lock, NULL);
    pthread_cond_init(&crew.all_done, NULL);
    pthread_mutex_lock(&crew.lock);
    while (crew.threads < threads && crew.threads < MOST_THREADS &&
           pthread_create(&others[crew.threads], NULL, work, &crew) == 0) {
        crew.threads++;
    }
    atomic_store(&crew.working, crew.threads);
    pthread_mutex_unlock(&crew.lock);
    work(&crew);
    for (int i = 1; i < crew.threads; i++) {
        pthread_join(others[i], NULL);
    }
    pthread_cond_destroy(&crew.all_done);
    pthread_mutex_destroy(&crew.lock);
}
