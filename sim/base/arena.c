#include "sim/base/arena.h"

#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "sim/base/error.h"
#include "sim/base/memory.h"

/* [byte] smallest chunk; larger requests get a chunk of their own */
#define ARENA_CHUNK_BYTES ((size_t)1 << 18)

struct ArenaChunk {
    ArenaChunk *older;
    ArenaChunk *spare; /* one emptied chunk kept for reuse */
    size_t capacity;
    size_t used;
    size_t blank; /* from here on nothing was ever written: zeroes */
    unsigned char *data, *memory;
};

/* A large one is not written to: the system hands out zeroes, and pages that nobody touches cost nothing. */
static ArenaChunk *chunk_create(size_t bytes) {
    bool large = bytes > ARENA_CHUNK_BYTES;
    size_t capacity = large ? bytes : ARENA_CHUNK_BYTES, room = capacity + ARENA_ALIGNMENT;
    if (room < capacity) {
        memory_exhausted(bytes);
    }
    ArenaChunk *chunk = memory_new(sizeof *chunk);
    unsigned char *memory = large ? memory_zeroed(room, 1) : memory_new(room);
    size_t skip = ARENA_ALIGNMENT - (uintptr_t)memory % ARENA_ALIGNMENT;
    *chunk = (ArenaChunk){
        .capacity = capacity,
        .blank = large ? 0 : capacity,
        .data = memory + skip,
        .memory = memory,
    };
    return chunk;
}

static void chunk_destroy(ArenaChunk *chunk) {
    if (chunk) {
        free(chunk->memory);
        free(chunk);
    }
}

/* `bytes` from a place on; only what was written to is touched */
static void clear(ArenaChunk *chunk, size_t from, size_t bytes) {
    if (from < chunk->blank) {
        size_t written = chunk->blank - from;
        memset(chunk->data + from, 0, written < bytes ? written : bytes);
    }
    chunk->blank = from + bytes > chunk->blank ? from + bytes : chunk->blank;
}

void *arena_alloc(Arena *arena, size_t bytes) {
    size_t padded = (bytes + ARENA_ALIGNMENT) / ARENA_ALIGNMENT * ARENA_ALIGNMENT;
    if (padded < bytes) {
        memory_exhausted(bytes);
    }
    ArenaChunk *chunk = arena->chunk;
    if (!chunk || chunk->capacity - chunk->used < padded) {
        ArenaChunk *next = chunk ? chunk->spare : NULL;
        if (next && next->capacity >= padded) {
            chunk->spare = NULL;
        } else {
            next = chunk_create(padded);
        }
        next->older = chunk;
        arena->chunk = chunk = next;
    }
    void *block = chunk->data + chunk->used;
    chunk->used += padded;
    arena->bytes_used += padded;
    if (arena->bytes_used > arena->bytes_peak) {
        arena->bytes_peak = arena->bytes_used;
    }
    clear(chunk, chunk->used - padded, padded);
    return block;
}

void *arena_extend(Arena *arena, const void *old, size_t used, size_t bytes) {
    void *block = arena_alloc(arena, bytes);
    return used > 0 ? (memcpy(block, old, used), block) : block;
}

char *arena_strdup(Arena *arena, const char *text) {
    size_t bytes = strlen(text) + 1;
    return memcpy(arena_alloc(arena, bytes), text, bytes);
}

ArenaMark arena_mark(const Arena *arena) {
    return (ArenaMark){arena->chunk, arena->chunk ? arena->chunk->used : 0, arena->bytes_used};
}

void arena_rewind(Arena *arena, ArenaMark mark) {
    while (arena->chunk != mark.chunk) {
        ArenaChunk *emptied = arena->chunk;
        ASSERT(emptied); /* or the mark is of another arena */
        arena->chunk = emptied->older;
        chunk_destroy(emptied->spare);
        emptied->spare = NULL;
        emptied->used = 0;
        if (arena->chunk && !arena->chunk->spare) {
            arena->chunk->spare = emptied;
        } else {
            chunk_destroy(emptied);
        }
    }
    if (arena->chunk) {
        arena->chunk->used = mark.chunk_used;
    }
    arena->bytes_used = mark.bytes_used;
}

void arena_free(Arena *arena) {
    while (arena->chunk) {
        ArenaChunk *chunk = arena->chunk;
        arena->chunk = chunk->older;
        chunk_destroy(chunk->spare);
        chunk_destroy(chunk);
    }
    *arena = (Arena){0};
}
