#include "sim/contact/motion.h"

#include <string.h>

#define LONGEST_RUN 256 /* vertices: a share of what a thread takes at once */
#define RUN_GRAIN 26    /* runs a thread takes at once, some 2 to 5 us */

MotionRows motion_rows_create(const Surface *surface, int vertex_count, Arena *arena) {
    static const MotionKernel *const kernels[] = {&motion_kernel_scalar, &motion_kernel_sse2,
                                                  &motion_kernel_avx2, &motion_kernel_avx512};
    return (MotionRows){.kernel = kernels[vector_best()],
                        .slot = arena_push(arena, int, vertex_count),
                        .runs = arena_push(arena, MotionRun, vertex_count),
                        .blocks = arena_push(arena, MotionBlock, surface->group_count),
                        .others = arena_push(arena, int, surface->group_count)};
}

static void find_runs(MotionRows *rows, const int *slot, int vertex_count) {
    rows->run_count = 0;
    for (int i = 0; i < vertex_count; i++) {
        MotionRun *last = rows->run_count > 0 ? &rows->runs[rows->run_count - 1] : NULL;
        if (last && last->count < LONGEST_RUN && slot[i] == last->slot + last->count) {
            last->count++;
        } else {
            rows->runs[rows->run_count++] = (MotionRun){i, slot[i], 1};
        }
    }
}

/* how many of the rows hold a slot */
static int rows_around(const MotionBlock *block, int rows, int slot) {
    int count = 0;
    for (int j = 0; j < rows; j++) {
        count += slot >= block->row[j] && slot < block->row[j] + MOTION_BLOCK;
    }
    return count;
}

static bool has_slot(const int *places, int count, const int *slot, int wanted) {
    bool has = false;
    for (int k = 0; k < count && !has; k++) {
        has = slot[places[k]] == wanted;
    }
    return has;
}

/* The slots of a group, when they are rows and nothing else; they come in the order of its cells. */
static bool find_block(const Surface *surface, int g, const int *slot, MotionBlock *block) {
    const SurfaceGroup *group = &surface->groups[g];
    const int *places = surface->group_vertices + group->vertex_begin;
    int count = group->vertex_end - group->vertex_begin, rows = 0;
    if (count != MOTION_BLOCK * MOTION_BLOCK) {
        return false;
    }
    for (int k = 0; k < count; k++) {
        if (!has_slot(places, count, slot, slot[places[k]] - 1)) { /* a row begins */
            if (rows == MOTION_BLOCK) {
                return false;
            }
            block->row[rows++] = slot[places[k]];
        }
    }
    for (int k = 0; k < count; k++) {
        if (rows_around(block, rows, slot[places[k]]) != 1) {
            return false;
        }
    }
    block->group = g;
    block->middle = slot[places[count / 2]];
    return rows == MOTION_BLOCK;
}

void motion_rows_set(MotionRows *rows, const Surface *surface, const int *slot, int vertex_count) {
    size_t bytes = (size_t)vertex_count * sizeof *slot;
    if (rows->run_count > 0 && memcmp(rows->slot, slot, bytes) == 0) {
        return;
    }
    memcpy(rows->slot, slot, bytes);
    find_runs(rows, slot, vertex_count);
    rows->block_count = rows->other_count = 0;
    for (int g = 0; g < surface->group_count; g++) {
        const SurfacePanel *panel = &surface->panels[surface->groups[g].panel];
        if (!panel->obstacle && find_block(surface, g, slot, &rows->blocks[rows->block_count])) {
            rows->block_count++;
        } else if (!panel->still) {
            rows->others[rows->other_count++] = g;
        }
    }
}

static void copy_chunk(int chunk, int first, int end, void *context) {
    (void)chunk;
    const MotionCopy *copy = context;
    copy->rows->kernel->copy(copy->rows->runs + first, end - first, copy->lanes, copy->out);
}

ParallelLoop motion_copy_loop(MotionCopy *copy) {
    return (ParallelLoop){copy->rows->run_count, RUN_GRAIN, copy_chunk, copy};
}

void motion_bound(const MotionRows *rows, int first, int end, double *const v[3],
                  GroupMotion *motion) {
    rows->kernel->bound(rows->blocks + first, end - first, v, motion);
}
