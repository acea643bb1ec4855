/* Some threads that work through steps together. Which thread does which task never matters.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef TANDEM_CREW_H
#define TANDEM_CREW_H

enum { MOST_THREADS = 64, MOST_STEPS = 24 };

typedef int crew_tasks_fn(void *context, int step);
typedef void crew_task_fn(void *context, int step, int task, int thread);

/* Do all tasks of each step, one step after the other. `threads` includes the caller's. If a thread cannot be had, the others do its work. */
void crew_works(void *context, int steps, int threads, crew_tasks_fn *tasks_of, crew_task_fn *do_task);

#endif
