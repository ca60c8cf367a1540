/* hash.h: 64-bit checksums (xxHash XXH3). Same value on every machine. */
#ifndef TOILE_BASE_HASH_H
#define TOILE_BASE_HASH_H

#include <stddef.h>
#include <stdint.h>

uint64_t hash_bytes(const void *data, size_t bytes);

/* A repeatable stream of numbers from a seed: uniform in [-1, 1). */
double hash_random(uint64_t seed, uint64_t index);

#endif
