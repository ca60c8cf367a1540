/* arena.h: memory that is freed as a whole.
 *
 * An Arena hands out zeroed, 64-byte aligned blocks from large chunks. A simulation has
 * two: a permanent one, and a scratch one that every step leaves empty. Running out of
 * memory ends the program with a message (exit code 74).
 * Thread-safety: unsafe; one arena belongs to one thread.
 */
#ifndef TOILE_BASE_ARENA_H
#define TOILE_BASE_ARENA_H

#include <stddef.h>

#define ARENA_ALIGNMENT 64 /* [byte] a cache line; also the widest vector register */

typedef struct ArenaChunk ArenaChunk;

typedef struct Arena {
    ArenaChunk *chunk; /* newest chunk, linked to older ones */
    size_t bytes_used; /* handed out now, padding included */
    size_t bytes_peak; /* largest bytes_used so far */
} Arena;

/* A position to go back to. */
typedef struct ArenaMark {
    ArenaChunk *chunk;
    size_t chunk_used;
    size_t bytes_used;
} ArenaMark;

void *arena_alloc(Arena *arena, size_t bytes);
char *arena_strdup(Arena *arena, const char *text);
ArenaMark arena_mark(const Arena *arena);
void arena_rewind(Arena *arena, ArenaMark mark); /* keeps the newest chunks for reuse */
void arena_free(Arena *arena);                   /* leaves a zeroed arena, usable again */

/* A block of `bytes` that begins with the first `used` bytes of `old` (NULL when 0); the rest is
 * zero. The old block stays behind until the arena is freed: for arrays that double. */
void *arena_extend(Arena *arena, const void *old, size_t used, size_t bytes);

/* `count` zeroed objects of `type`; a pointer is returned even for count 0. */
#define arena_push(arena, type, count)                                                             \
    ((type *)arena_alloc((arena), sizeof(type) * (size_t)(count)))

/* `room` objects of which the first `count` are those of `old`. */
#define arena_grow(arena, type, old, count, room)                                                  \
    ((type *)arena_extend((arena), (old), sizeof(type) * (size_t)(count),                          \
                          sizeof(type) * (size_t)(room)))

#endif
