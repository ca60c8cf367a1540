#include "render/jobs.h"

#include <errno.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "render/interrupt.h"

/* What a process and its parent both see. */
typedef struct Shared {
    Error error;
    uint8_t rgba[];
} Shared;

typedef struct Worker {
    pid_t process;
    int socket; /* the parent's end: a frame number goes, an ExitCode comes back */
    Shared *shared;
    int frame; /* that it has; -1 = none */
    uint64_t key;
} Worker;

struct Jobs {
    int count, next, oldest; /* workers; whose turn it is to get, and to give */
    int width, height;
    bool clear;
    size_t bytes; /* of a Shared */
    Worker workers[JOBS_MOST];
};

/* ---- the other process ---- */

static ExitCode draw_for_parent(Drawer *drawer, Run *run, int frame, Shared *shared) {
    Error error = {0};
    RunEnd end = run_wait(run, frame); /* the parent has seen it */
    const Image *image = end == RUN_FRAME ? draw_frame(drawer, frame, &error) : NULL;
    if (!image) {
        error_set(&error, EXIT_INTERRUPTED, "interrupted");
        shared->error = error;
        return error.code;
    }
    memcpy(shared->rgba, image->rgba,
           (size_t)IMAGE_CHANNELS * (size_t)image->width * (size_t)image->height);
    return EXIT_OK;
}

static _Noreturn void work(const Options *options, int socket, Shared *shared) {
    Options alone = *options;
    Run run = {0};
    RunEnd end;
    Drawer *drawer = NULL;
    int frame;
    alone.threads = 1;
    alone.quiet = true;
    while (read(socket, &frame, sizeof frame) == (ssize_t)sizeof frame) {
        int code = EXIT_OK;
        if (!drawer) {
            drawer = command_open(&alone, &run, &end, &shared->error);
        }
        code = drawer ? (int)draw_for_parent(drawer, &run, frame, shared) : (int)shared->error.code;
        if (write(socket, &code, sizeof code) != (ssize_t)sizeof code) {
            break;
        }
    }
    _exit(0);
}

/* ---- the parent ---- */

static bool start_worker(Jobs *jobs, const Options *options, Error *error) {
    Worker *worker = &jobs->workers[jobs->count];
    int ends[2];
    Shared *shared =
        mmap(NULL, jobs->bytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (shared == MAP_FAILED) {
        return error_set_errno(error, EXIT_IO, "--jobs: no memory for a picture");
    }
    if (socketpair(AF_UNIX, SOCK_STREAM, 0, ends) != 0) {
        munmap(shared, jobs->bytes);
        return error_set_errno(error, EXIT_IO, "--jobs");
    }
    pid_t process = fork();
    if (process == 0) {
        for (int i = 0; i < jobs->count; i++) { /* else a dead parent would not be noticed */
            close(jobs->workers[i].socket);
        }
        close(ends[0]);
        work(options, ends[1], shared);
    }
    close(ends[1]);
    if (process < 0) {
        close(ends[0]);
        munmap(shared, jobs->bytes);
        return error_set_errno(error, EXIT_IO, "--jobs: no process");
    }
    *worker = (Worker){process, ends[0], shared, -1, 0};
    jobs->count++;
    return true;
}

Jobs *jobs_start(const Options *options, int count, int width, int height, Error *error) {
    Jobs *jobs = calloc(1, sizeof *jobs);
    ASSERT(jobs && count > 0 && count <= JOBS_MOST);
    jobs->width = width;
    jobs->height = height;
    jobs->clear = options->clear;
    jobs->bytes = sizeof(Shared) + (size_t)IMAGE_CHANNELS * (size_t)width * (size_t)height;
    for (int i = 0; i < count; i++) {
        if (!start_worker(jobs, options, error)) {
            jobs_stop(jobs);
            return NULL;
        }
    }
    return jobs;
}

bool jobs_are_full(const Jobs *jobs) { return jobs->workers[jobs->next].frame >= 0; }

bool jobs_give(Jobs *jobs, int frame, uint64_t key, Error *error) {
    Worker *worker = &jobs->workers[jobs->next];
    ASSERT(worker->frame < 0);
    if (send(worker->socket, &frame, sizeof frame, MSG_NOSIGNAL) != (ssize_t)sizeof frame) {
        return error_set_errno(error, EXIT_OUR_BUG, "a drawing process is gone");
    }
    worker->frame = frame;
    worker->key = key;
    jobs->next = (jobs->next + 1) % jobs->count;
    return true;
}

bool jobs_next(Jobs *jobs, bool *any, Image *image, int *frame, uint64_t *key, Error *error) {
    Worker *worker = &jobs->workers[jobs->oldest];
    int code;
    ssize_t got;
    *any = worker->frame >= 0;
    if (!*any) {
        return true;
    }
    do {
        got = read(worker->socket, &code, sizeof code);
    } while (got < 0 && errno == EINTR && !interrupt_requested());
    if (interrupt_requested()) {
        return error_set(error, EXIT_INTERRUPTED, "interrupted");
    }
    if (got != (ssize_t)sizeof code) {
        return error_set(error, EXIT_OUR_BUG, "the process that draws frame %d died",
                         worker->frame);
    }
    if (code != EXIT_OK) {
        return error_set(error, (ExitCode)code, "%s", worker->shared->error.text);
    }
    *image = (Image){.width = jobs->width,
                     .height = jobs->height,
                     .rgba = worker->shared->rgba,
                     .clear = jobs->clear};
    *frame = worker->frame;
    *key = worker->key;
    worker->frame = -1;
    jobs->oldest = (jobs->oldest + 1) % jobs->count;
    return true;
}

void jobs_stop(Jobs *jobs) {
    for (int i = 0; jobs && i < jobs->count; i++) {
        close(jobs->workers[i].socket); /* it ends when it wants its next frame */
        kill(jobs->workers[i].process, SIGKILL);
    }
    for (int i = 0; jobs && i < jobs->count; i++) {
        waitpid(jobs->workers[i].process, NULL, 0);
        munmap(jobs->workers[i].shared, jobs->bytes);
    }
    free(jobs);
}
