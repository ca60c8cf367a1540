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
#include "sim/base/memory.h"

/* While the parent writes one picture, its process draws the next. */
#define SLOTS 2

/* What a process and its parent both see. */
typedef struct Shared {
    Error error;
    uint8_t rgba[];
} Shared;

/* A frame that a process has, and where it draws it. */
typedef struct Slot {
    Shared *shared;
    int frame; /* -1 = none */
    uint64_t key;
} Slot;

typedef struct Worker {
    pid_t process;
    int socket;        /* the parent's end: a frame number goes, an ExitCode comes back */
    Slot slots[SLOTS]; /* in turn */
} Worker;

struct Jobs {
    int count;        /* workers */
    int next, oldest; /* turns of all slots: worker = turn % count, slot = turn / count */
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

static _Noreturn void work(const Options *options, int socket, const Slot *slots) {
    Options alone = *options;
    Run run = {0};
    RunEnd end;
    Drawer *drawer = NULL;
    int frame, slot = 0;
    alone.threads = 1;
    alone.quiet = true;
    while (read(socket, &frame, sizeof frame) == (ssize_t)sizeof frame) {
        int code = EXIT_OK;
        Shared *shared = slots[slot].shared;
        slot = (slot + 1) % SLOTS;
        ASSERT(shared);
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

static void free_slots(const Jobs *jobs, Worker *worker) {
    for (int i = 0; i < SLOTS && worker->slots[i].shared; i++) {
        munmap(worker->slots[i].shared, jobs->bytes);
    }
}

static bool create_slots(const Jobs *jobs, Worker *worker, Error *error) {
    for (int i = 0; i < SLOTS; i++) {
        void *shared =
            mmap(NULL, jobs->bytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
        if (shared == MAP_FAILED) {
            free_slots(jobs, worker);
            return error_set_errno(error, EXIT_IO, "--jobs: no memory for a picture");
        }
        worker->slots[i] = (Slot){shared, -1, 0};
    }
    return true;
}

static bool start_worker(Jobs *jobs, const Options *options, Error *error) {
    Worker *worker = &jobs->workers[jobs->count];
    int ends[2];
    if (!create_slots(jobs, worker, error)) {
        return false;
    }
    if (socketpair(AF_UNIX, SOCK_STREAM, 0, ends) != 0) {
        free_slots(jobs, worker);
        return error_set_errno(error, EXIT_IO, "--jobs");
    }
    pid_t process = fork();
    if (process == 0) {
        for (int i = 0; i < jobs->count; i++) { /* else a dead parent would not be noticed */
            close(jobs->workers[i].socket);
        }
        close(ends[0]);
        work(options, ends[1], worker->slots);
    }
    close(ends[1]);
    if (process < 0) {
        close(ends[0]);
        free_slots(jobs, worker);
        return error_set_errno(error, EXIT_IO, "--jobs: no process");
    }
    worker->process = process;
    worker->socket = ends[0];
    jobs->count++;
    return true;
}

Jobs *jobs_start(const Options *options, int count, int width, int height, Error *error) {
    Jobs *jobs = memory_zeroed(1, sizeof *jobs);
    ASSERT(count > 0 && count <= JOBS_MOST);
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

static Worker *worker_of(Jobs *jobs, int turn) { return &jobs->workers[turn % jobs->count]; }

static Slot *slot_of(Jobs *jobs, int turn) {
    return &worker_of(jobs, turn)->slots[turn / jobs->count];
}

static int turn_after(const Jobs *jobs, int turn) { return (turn + 1) % (SLOTS * jobs->count); }

bool jobs_are_full(Jobs *jobs) { return slot_of(jobs, jobs->next)->frame >= 0; }

bool jobs_give(Jobs *jobs, int frame, uint64_t key, Error *error) {
    Slot *slot = slot_of(jobs, jobs->next);
    int socket = worker_of(jobs, jobs->next)->socket;
    ASSERT(slot->frame < 0);
    if (send(socket, &frame, sizeof frame, MSG_NOSIGNAL) != (ssize_t)sizeof frame) {
        return error_set_errno(error, EXIT_OUR_BUG, "a drawing process is gone");
    }
    slot->frame = frame;
    slot->key = key;
    jobs->next = turn_after(jobs, jobs->next);
    return true;
}

bool jobs_next(Jobs *jobs, bool *any, Image *image, int *frame, uint64_t *key, Error *error) {
    Slot *slot = slot_of(jobs, jobs->oldest);
    int socket = worker_of(jobs, jobs->oldest)->socket, code;
    ssize_t got;
    *any = slot->frame >= 0;
    if (!*any) {
        return true;
    }
    do {
        got = read(socket, &code, sizeof code);
    } while (got < 0 && errno == EINTR && !interrupt_requested());
    if (interrupt_requested()) {
        return error_set(error, EXIT_INTERRUPTED, "interrupted");
    }
    if (got != (ssize_t)sizeof code) {
        return error_set(error, EXIT_OUR_BUG, "the process that draws frame %d died", slot->frame);
    }
    if (code != EXIT_OK) {
        return error_set(error, (ExitCode)code, "%s", slot->shared->error.text);
    }
    *image = (Image){.width = jobs->width,
                     .height = jobs->height,
                     .rgba = slot->shared->rgba,
                     .clear = jobs->clear};
    *frame = slot->frame;
    *key = slot->key;
    slot->frame = -1;
    jobs->oldest = turn_after(jobs, jobs->oldest);
    return true;
}

void jobs_stop(Jobs *jobs) {
    for (int i = 0; jobs && i < jobs->count; i++) {
        close(jobs->workers[i].socket); /* it ends when it wants its next frame */
        kill(jobs->workers[i].process, SIGKILL);
    }
    for (int i = 0; jobs && i < jobs->count; i++) {
        waitpid(jobs->workers[i].process, NULL, 0);
        free_slots(jobs, &jobs->workers[i]);
    }
    free(jobs);
}
