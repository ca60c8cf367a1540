/* twins.h: which contacts gave a force already. Several pairs may stand for one contact, as the triangles around a
 * vertex do (pair_twin_key in lists.h); the first of them gives its force. */
#ifndef TOILE_CONTACT_TWINS_H
#define TOILE_CONTACT_TWINS_H

#include "sim/base/arena.h"

/* A contact, and the pair that came first. */
typedef struct Twin {
    int key[3], pair; /* pair < 0: a free place */
} Twin;

typedef struct Twins {
    Twin *table; /* (room, a power of two) by a hash of the key */
    int *used;   /* (count) places of it */
    int room, count;
} Twins;

/* Forgets all, and makes room for `most`. */
void twins_clear(Twins *twins, int most, Arena *arena);
/* The pair that came first with this key since twins_clear, or -1: this one is the first. */
int twins_find(Twins *twins, const int key[3], int pair);

#endif
