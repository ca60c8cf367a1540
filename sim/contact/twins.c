#include "sim/contact/twins.h"

#include <stdint.h>
#include <string.h>

#define TWIN_SPACE 4 /* places of the hash table per contact */
#define LEAST_ROOM 256

void twins_clear(Twins *twins, int most, Arena *arena) {
    for (int k = 0; k < twins->count; k++) {
        twins->table[twins->used[k]].pair = -1;
    }
    twins->count = 0;
    if (twins->room >= TWIN_SPACE * most) {
        return;
    }
    twins->room = twins->room > 0 ? twins->room : LEAST_ROOM;
    while (twins->room < TWIN_SPACE * most) {
        twins->room *= 2;
    }
    twins->table = arena_push(arena, Twin, twins->room);
    twins->used = arena_push(arena, int, twins->room);
    for (int k = 0; k < twins->room; k++) {
        twins->table[k].pair = -1;
    }
}

/* multiplied by odd numbers without a pattern; the upper bits are mixed best */
static uint64_t hash_of(const int key[3]) {
    uint64_t ends = (uint64_t)(uint32_t)key[1] << 32 | (uint32_t)key[2];
    uint64_t all = ends * 0x9e3779b97f4a7c15U ^ (uint64_t)(uint32_t)key[0] * 0xc2b2ae3d27d4eb4fU;
    return all * 0x9e3779b97f4a7c15U >> 32;
}

int twins_find(Twins *twins, const int key[3], int pair) {
    uint64_t mask = (uint64_t)twins->room - 1;
    for (uint64_t at = hash_of(key);; at++) {
        Twin *twin = &twins->table[at & mask];
        if (twin->pair < 0) {
            *twin = (Twin){{key[0], key[1], key[2]}, pair};
            twins->used[twins->count++] = (int)(at & mask);
            return -1;
        }
        if (memcmp(twin->key, key, sizeof twin->key) == 0) {
            return twin->pair;
        }
    }
}
